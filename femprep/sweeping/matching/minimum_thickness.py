"""Endocardium and epicardium in, an epicardium that keeps a least distance from the endocardium out."""

from __future__ import annotations

import logging
from functools import partial
from typing import Any, Final

import numpy as np

from femprep.errors import InputError
from femprep.mesh.measures.triangles import vertex_normals
from femprep.mesh.operations.push import Pushing, push
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import BoolArray, FloatArray, IntArray, Plane, Surface
from femprep.model.products import product
from femprep.options.advice import thinner

_log = logging.getLogger(__name__)

#: How the epicardium is pushed; swept meshes of 200 maps were counted with these.
_PUSHING: Final = Pushing(rounds=8, reach=2, fade=0.7)
#: Share of the least distance by which it may be missed.
_CLOSE = 0.02
#: What lies farther above the base than this is cut away and stays as it is, mm; so does all above it that looks up
#: more than this, the cap in which the closed surface ends.
_ABOVE = 1.0
_CAP = 0.5


def push_outwards(
    endo: Surface, epi: Surface, base: Plane, least: float, most: float
) -> tuple[FloatArray, dict[str, Any]]:
    """Push vertices of the epicardium outwards until they are at least a given distance from the endocardium.

    Parameters
    ----------
    endo, epi : Surface
        Closed.
    base : Plane
        What lies well above it is left alone.
    least : float
        Least distance, mm.
    most : float
        Farthest a vertex may be pushed, mm.

    Returns
    -------
    points : (n, 3) array
        Vertices of the epicardium.
    info : dict
        ``vertices`` pushed, the farthest push ``maximum_mm``, the distance asked for, ``least_mm``, and, where a
        vertex was pushed, where the farthest was, ``worst_at_mm``.

    Raises
    ------
    InputError
        A vertex would have to be pushed farther.
    """
    finder = ClosestFinder(endo.points, endo.triangles)
    points = np.array(epi.points)
    cells = epi.triangles
    low = _kept(points, cells, base)
    inner = endo.points[_kept(endo.points, endo.triangles, base)]
    lacking = partial(_lacking, points, cells, low, finder, inner, least)
    push(points, cells, _PUSHING, lacking, _CLOSE * least)
    moved = np.linalg.norm(points - epi.points, axis=1)
    short = np.where(low, least - finder.signed(points), 0.0)
    worst = int(np.argmax(np.maximum(moved - most, short - 0.5 * least)))
    if moved.max() > most or short.max() > 0.5 * least:
        raise InputError(
            f"epicardium {epi.name!r} comes nearer than {least:g} mm to endocardium {endo.name!r} near "
            f"{np.round(epi.points[worst], 1).tolist()} (mm LPS) and would have to be pushed by more than {most:g} mm",
            advice=thinner(least - max(float(moved.max()) - most, float(short.max()))),
        )
    count = int(np.count_nonzero(moved > 1e-6))
    if count:
        _log.warning("epicardium pushed outwards by up to %.2f mm at %d vertices", moved.max(), count)
    found: dict[str, Any] = {"vertices": count, "maximum_mm": float(moved.max()), "least_mm": least}
    if count:
        found["worst_at_mm"] = [round(float(x), 3) for x in epi.points[int(moved.argmax())]]
    return points, found


def _lacking(
    points: FloatArray, cells: IntArray, low: BoolArray, finder: ClosestFinder, inner: FloatArray, least: float
) -> tuple[FloatArray, FloatArray]:
    """What each vertex that counts lacks to the least distance, mm, and which way is outward."""
    wanted = np.where(low, np.maximum(least - finder.signed(points), 0.0), 0.0)
    # Seen from the other side as well: an edge of the endocardium may come close between vertices.
    other = ClosestFinder(points, cells)
    short = least + other.signed(inner)
    feet = cells[other(inner).triangle]
    for corner in range(3):
        np.maximum.at(wanted, feet[:, corner], np.where(low[feet[:, corner]], short, 0.0))
    return wanted, vertex_normals(points, cells)


def _kept(points: FloatArray, cells: IntArray, base: Plane) -> BoolArray:
    """Which vertices lie below the base, or belong to the wall that rises a little above it."""
    height = base.signed_distance(points)
    wall = product(vertex_normals(points, cells), base.normal) < _CAP
    return np.asarray((height < 0.0) | (wall & (height < _ABOVE)))
