"""Clipped endo- and epicardia in: wall thickness out, and a wall that is too thin pushed apart.

Thickness is the distance from a vertex of one clipped surface to the nearest point of the other, negative where they
have changed sides.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np

from femprep.errors import InputError
from femprep.mesh.measures.triangles import vertex_normals
from femprep.mesh.operations.push import Pushing, push
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import FloatArray, IntArray, Notice, noted
from femprep.model.notice import spot
from femprep.model.products import product, unit_vectors
from femprep.options.advice import MORE_VERTICES, thinner
from femprep.wall.clipping.clipped_surface import ClippedSurface
from femprep.wall.clipping.sampled import SampledMap

logger = logging.getLogger(__name__)

#: How surfaces of walls are pushed, and the margin by which each push aims beyond the limit.
PUSHING: Final = Pushing(rounds=40, reach=4, fade=0.9)
_MARGIN = 1.02


@dataclass(frozen=True)
class SheetThickness:
    """Thickness at the vertices of the two clipped surfaces.

    Attributes
    ----------
    epi, endo : (n,) array
        Signed distance from the other clipped surface, mm: positive where the epicardium lies outside.
    """

    epi: FloatArray
    endo: FloatArray

    @property
    def least(self) -> float:
        """Least thickness, mm."""
        return float(min(self.epi.min(), self.endo.min()))


def measure(epi: ClippedSurface, endo: ClippedSurface) -> SheetThickness:
    """Thickness at all vertices of both clipped surfaces."""
    outside, _, _ = _signed(ClosestFinder(endo.points, endo.triangles), endo, epi.points)
    inside, _, _ = _signed(ClosestFinder(epi.points, epi.triangles), epi, endo.points)
    return SheetThickness(outside, -inside)


def _signed(
    finder: ClosestFinder, clipped: ClippedSurface, where: FloatArray
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Signed distance from an open surface, positive on its outer side; normal and triangle at the nearest point."""
    near = finder(where)
    across = unit_vectors(near.at(vertex_normals(clipped.points, clipped.triangles)))
    side = np.einsum("qc,qc->q", where - near.points, across)
    return np.where(side < 0, -near.distance, near.distance), across, near.triangle


def summary(epi: ClippedSurface, endos: Sequence[ClippedSurface]) -> dict[str, Any]:
    """Least thickness and where, mean, and percentiles, over the vertices of the clipped endocardia; JSON-ready."""
    least, place, of = np.inf, np.zeros(3), endos[0].name
    values = []
    for endo in endos:
        thickness = measure(epi, endo)
        values.append(thickness.endo)
        for at, points in ((thickness.endo, endo.points), (thickness.epi, epi.points)):
            if at.min() < least:
                least, place, of = float(at.min()), points[int(at.argmin())], endo.name
    all_ = np.concatenate(values)
    fifth, median, most = np.percentile(all_, [5, 50, 95])
    return {
        "minimum_mm": least,
        "minimum_at_mm": [round(float(x), 3) for x in place],
        "minimum_beside": of,
        "mean_mm": float(all_.mean()),
        "percentiles_5_50_95_mm": [float(fifth), float(median), float(most)],
    }


def require_nested(epi: ClippedSurface, endo: ClippedSurface) -> None:
    """Refuse an endocardium that is not, by and large, inside the epicardium.

    Raises
    ------
    InputError
        More than a fifth of its vertices lie outside.
    """
    thickness = measure(epi, endo).endo
    outside = thickness < 0
    if outside.mean() > 0.2:
        worst = int(thickness.argmin())
        raise InputError(
            f"surface {endo.name!r} does not lie inside surface {epi.name!r}: "
            f"{100 * outside.mean():.0f} % of its vertices are outside, by {-thickness[worst]:.1f} mm at "
            f"{spot(endo.points[worst])}",
            advice=[MORE_VERTICES],
        )


def push_apart(epi: ClippedSurface, endo: ClippedSurface, limit: float, most: float) -> dict[str, Any] | None:
    """Push the epicardium outwards where the wall is thinner than a limit.

    The push spreads smoothly over the neighbourhood, and is along the plane for vertices of the rim.

    Parameters
    ----------
    epi : ClippedSurface
        Changed in place, with its smooth map.
    endo : ClippedSurface
    limit : float
        Least thickness, mm.
    most : float
        Farthest a vertex may be pushed, mm.

    Returns
    -------
    dict or None
        What was done, JSON-ready; None where the wall was thick enough.

    Raises
    ------
    InputError
        The wall cannot be brought to the limit within ``most``.
    """
    start = epi.points.copy()
    before = measure(epi, endo)
    if before.least >= limit:
        return None
    worst_epi, worst_endo = int(before.epi.argmin()), int(before.endo.argmin())
    place = epi.points[worst_epi] if before.epi.min() <= before.endo.min() else endo.points[worst_endo]
    finder = ClosestFinder(endo.points, endo.triangles)
    lacking = partial(_lacking, epi, endo, finder, _MARGIN * limit)
    push(epi.points, epi.triangles, PUSHING, lacking, (_MARGIN - 1.0) * limit, partial(_within_planes, epi))
    moved = np.linalg.norm(epi.points - start, axis=1)
    reached = measure(epi, endo).least
    if reached < limit - 1e-9 or moved.max() > most:
        raise InputError(
            f"the wall is {before.least:.2f} mm thick near {spot(place)}, beside {endo.name!r}; pushing the "
            f"epicardium outwards by {moved.max():.1f} mm leaves {reached:.2f} mm, but minimum_thickness = {limit:g} "
            f"mm is asked within maximum_push = {most:g} mm",
            advice=thinner(min(reached, limit - float(moved.max()) + most)),
        )
    epi.smooth = SampledMap(epi.directions, epi.points)
    info = {
        "beside": endo.name,
        "thickness_before_mm": before.least,
        "thickness_after_mm": reached,
        "worst_at_mm": [round(float(x), 3) for x in place],
        "vertices_pushed": int((moved > 0.01).sum()),
        "farthest_push_mm": float(moved.max()),
    }
    logger.warning(
        "wall %.2f mm thick near %s: pushed apart by up to %.2f mm", before.least, info["worst_at_mm"], moved.max()
    )
    return info


def pushed(step: dict[str, Any]) -> dict[str, Any]:
    """What :func:`push_apart` did, with its notice."""
    before, after, beside = step["thickness_before_mm"], step["thickness_after_mm"], step["beside"]
    thin = f"was {before:.1f} mm thick" if before >= 0.0 else f"had its surfaces crossed by {-before:.1f} mm"
    words = (
        f"the wall beside cavity {beside} {thin} near {{place}}: the epicardium was pushed outwards by up to "
        f"{{amount}}, which makes it {after:.1f} mm"
    )
    return noted(
        step, Notice.of("repaired", words, amount=step["farthest_push_mm"], unit="mm", place=step["worst_at_mm"])
    )


def _lacking(
    epi: ClippedSurface, endo: ClippedSurface, finder: ClosestFinder, limit: float
) -> tuple[FloatArray, FloatArray]:
    """What is lacking to the limit at each epicardial vertex, mm, and which way is outward there."""
    outside, across, _ = _signed(finder, endo, epi.points)
    own = vertex_normals(epi.points, epi.triangles)
    # Near a rim or a sharp apex the nearest point's normal jumps; the clipped surface's own normal steadies it.
    along = unit_vectors(across + own * np.maximum(np.einsum("ij,ij->i", across, own), 0.0)[:, None])
    lacking = np.maximum(limit - outside, 0.0)
    # An endocardial vertex may come near the middle of an epicardial triangle: its corners have to go.
    inside, _, nearest = _signed(ClosestFinder(epi.points, epi.triangles), epi, endo.points)
    short = np.maximum(limit + inside, 0.0)
    np.maximum.at(lacking, epi.triangles[nearest].ravel(), np.repeat(short, 3))
    return lacking, along


def _within_planes(clipped: ClippedSurface, displacement: FloatArray) -> FloatArray:
    """Keep rim vertices in their planes: the part of a push along the plane, lengthened to make up for the rest."""
    displacement = displacement.copy()
    for number in range(len(clipped.planes)):
        rim = clipped.on_plane == number
        normal = clipped.plane_of(number).normal
        whole = np.linalg.norm(displacement[rim], axis=1)
        flat = displacement[rim] - product(displacement[rim], normal)[:, None] * normal
        size = np.linalg.norm(flat, axis=1)
        displacement[rim] = flat * np.minimum(whole / np.maximum(size, 1e-300), 2.0)[:, None]
    return displacement
