"""A finished mesh and the surfaces given for it in, how far its facets lie from them out: fidelity without labels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

import numpy as np

from femprep.mesh.sampling import sample_surface
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import Surface, VolumeMesh
from femprep.model.facets import facet_triangles
from femprep.model.notice import spot
from femprep.model.shared_records.surface_fidelity import SurfaceFidelity
from femprep.volume.quality.report import QualityReport
from femprep.volume.quality.verdicts import Verdicts

#: Points at which each surface is measured.
_SAMPLES: Final = 8000
#: Of what was given, only what lies at least so far within the planes that cut the mesh counts, mm.
_WITHIN: Final = 0.2


def given_fidelity(mesh: VolumeMesh, given: Mapping[str, Surface]) -> tuple[SurfaceFidelity, ...]:
    """Distance of facets from the surfaces given for them, and back.

    Parameters
    ----------
    mesh : VolumeMesh
        With facet tags. What was given beyond its planes does not count.
    given : mapping of str to Surface
        By facet name.

    Returns
    -------
    tuple of SurfaceFidelity
    """
    found = []
    for facets, surface in given.items():
        if facets not in mesh.facet_names:
            continue
        own = facet_triangles(mesh, facets)
        there = sample_surface(surface.points, surface.triangles, _SAMPLES).points
        for plane in mesh.planes.values():
            there = there[plane.signed_distance(there) < -_WITHIN]
        here = sample_surface(mesh.points, own, _SAMPLES).points
        off = ClosestFinder(surface.points, surface.triangles)(here).distance
        back = ClosestFinder(mesh.points, own)(there).distance
        both, where = np.concatenate([off, back]), np.concatenate([here, there])
        worst = int(both.argmax())
        x, y, z = (round(float(c), 2) for c in where[worst])
        found.append(
            SurfaceFidelity(
                surface=facets,
                given=surface.name,
                mean_mm=float(0.5 * (off.mean() + (back.mean() if len(back) else off.mean()))),
                p95_mm=float(np.quantile(both, 0.95)),
                greatest_mm=float(both[worst]),
                at_mm=(x, y, z),
            )
        )
    return tuple(found)


def with_given_fidelity(report: QualityReport, records: Iterable[SurfaceFidelity]) -> QualityReport:
    """The report with the distances, and a verdict on each that its options hold a limit for."""
    held, options, records = Verdicts(), report.options, tuple(records)
    for record in records:
        for name, value, limit, words in (
            ("mean", record.mean_mm, options.mean_surface_distance, "in the mean"),
            ("maximum", record.greatest_mm, options.maximum_surface_distance, f"at {spot(record.at_mm)}"),
        ):
            if held.misses(f"{record.surface}_{name}_surface_distance", "at most", limit, value):
                held.failures.append(
                    f"{record.surface} against the surface given as {record.given}: {value:.2f} mm {words}, asked for "
                    f"is at most {limit:g}; more --vertices or a smaller --edge-length follow it more closely"
                )
    return held.on(report, given_fidelity=records)
