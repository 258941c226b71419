"""A finished mesh and the surfaces given for it in, how far its facets lie from them out: fidelity without labels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

import numpy as np

from femprep.mesh.sampling import sample_surface
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import Surface, VolumeMesh
from femprep.model.distance import SurfaceFidelity
from femprep.model.facets import facet_triangles
from femprep.options import CheckOptions
from femprep.volume.quality.report import LimitRecord, QualityReport

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
    """A quality report that holds the distances to given surfaces too, and its verdict."""
    records = tuple(records)
    verdicts, failures = judge_given(records, report.options)
    return report.model_copy(
        update={
            "given_fidelity": records,
            "limits": (*report.limits, *verdicts),
            "failures": (*report.failures, *failures),
        }
    )


def judge_given(
    records: Iterable[SurfaceFidelity], options: CheckOptions
) -> tuple[tuple[LimitRecord, ...], tuple[str, ...]]:
    """Compare distances to given surfaces with their limits."""
    verdicts, failures = [], []
    for record in records:
        x, y, z = record.at_mm
        for name, value, limit, words in (
            ("mean_surface_distance", record.mean_mm, options.mean_surface_distance, "in the mean"),
            (
                "maximum_surface_distance",
                record.greatest_mm,
                options.maximum_surface_distance,
                f"at ({x:.1f}, {y:.1f}, {z:.1f})",
            ),
        ):
            if limit is None:
                continue
            passed = value <= limit
            verdicts.append(
                LimitRecord(name=f"{record.surface}_{name}", kind="at most", limit=limit, value=value, passed=passed)
            )
            if not passed:
                failures.append(
                    f"{record.surface} against the surface given as {record.given}: {value:.2f} mm {words}, asked for "
                    f"is at most {limit:g}; more --vertices or a smaller --edge-length follow it more closely"
                )
    return tuple(verdicts), tuple(failures)
