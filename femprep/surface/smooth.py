"""A LabelObject in, a template placed evenly on the surface its labels most likely come from out."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from femprep.errors import StageError
from femprep.geometry.intersection import self_intersections
from femprep.geometry.patches import PatchSurface
from femprep.geometry.topology import edge_table, volume
from femprep.geometry.triangles import triangle_quality
from femprep.image.boundary import BoundaryPoints
from femprep.image.object import LabelObject
from femprep.model import FloatArray, IntArray, split_quads
from femprep.surface.estimate import estimate_surface
from femprep.surface.estimate.chords import outset
from femprep.surface.estimate.evidence import Evidence
from femprep.surface.estimate.outline import outline
from femprep.surface.estimate.sheets import apart
from femprep.surface.place import Chart, Connectivity, Goal, Placed, place_evenly
from femprep.surface.placed import PlacedShape
from femprep.template import charge_template

#: Vertices of the outline's mesh, and of the mesh on it that is bent; in the end that has four times as many.
_OUTLINE: Final = 1000
_COARSE: Final = 752
#: Least Q with which the placed template is left; else it is placed anew by a map that is made for the bent surface,
#: then with finer triangles where that is curved, by this power.
_FAIR: Final = 0.6
_FINER: Final = 0.5
#: Least Q of its triangles in the template's order; where one is worse, edges are flipped.
_POOR: Final = 0.3


def smooth_map(
    obj: LabelObject,
    boundary: BoundaryPoints,
    axes: FloatArray,
    directions: FloatArray,
    cells: IntArray,
    connectivity: Connectivity,
    curvature: float,
) -> tuple[PlacedShape, FloatArray, IntArray, dict[str, Any]]:
    """Estimate an object's surface from its labels, beginning with an outline of its voxels; place a template on it.

    Parameters
    ----------
    obj : LabelObject
    boundary : BoundaryPoints
        Its boundary.
    axes : (3, 3) array
        The image's axes as a rotation, columns. All is done along them, so that a turned image gives the same surface,
        turned.
    directions : (V, 3) array
        The template's vertices, unit vectors.
    cells : (m, 3) or (m, 4) array
        Its triangles or quadrilaterals.
    connectivity, curvature
        As for :func:`~femprep.surface.place.place_evenly`.

    Returns
    -------
    shape : PlacedShape
        The smooth surface.
    points : (V, 3) array
        The template's vertices on it, mm LPS.
    cells : (m, 3) or (m, 4) array
        The template's, or others on the same vertices.
    info : dict

    Raises
    ------
    StageError
        Triangles cross or are folded.
    """
    begin = _begin(obj, axes)
    estimate = estimate_surface(begin.points, begin.cells, Evidence.of(obj, axes, boundary))
    surface = outset(estimate, Goal(estimate, len(split_quads(cells)), curvature).area)
    if len(self_intersections(surface.points, surface.triangles)):
        surface = PatchSurface(apart(estimate.points, surface.points, surface.triangles), surface.triangles)
    if len(self_intersections(surface.points, surface.triangles)):
        # No template can be placed on what is not a surface.
        raise StageError(f"the smooth surface of {obj.name!r} crosses itself")
    # The triangles of the mesh it began with were cut at the middles of their sides.
    middles = begin.directions[edge_table(begin.cells).nodes].sum(axis=1)
    middles /= np.linalg.norm(middles, axis=1, keepdims=True)
    chart = Chart(surface.points, surface.triangles, np.concatenate([begin.directions, middles]))
    best: tuple[float, Placed] | None = None
    for known, sizing in ((chart, curvature), (None, curvature), (None, max(curvature, _FINER))):
        placed = place_evenly(
            directions @ axes, cells, surface, chart=known, connectivity=connectivity, curvature=sizing
        )
        quality = _quality(placed)
        if best is None or quality > best[0]:
            best = quality, placed
        if quality >= _FAIR:
            break
    assert best is not None
    quality, placed = best
    if quality < 0.0:
        raise StageError(f"the smooth surface of {obj.name!r} bends too sharply for {len(directions)} vertices")
    directions = placed.directions @ axes.T
    shape = PlacedShape(surface, directions, split_quads(placed.cells), placed.points, axes, obj.barycentre)
    notices = []
    if placed.flips and connectivity == "auto":
        notices.append(
            f"surface {obj.name} is too long or branched for even triangles in the template's order; edges were flipped"
        )
    info = {"steps": placed.steps, "flips": placed.flips, "notices": notices}
    return shape, shape.to_world(placed.points), placed.cells, info


def _quality(placed: Placed) -> float:
    """Least Q of a placed template's triangles, -1 where some cross or are folded."""
    triangles = split_quads(placed.cells)
    if placed.folded or not volume(placed.points, triangles) > 0.0:
        return -1.0
    if len(self_intersections(placed.points, triangles)):
        return -1.0
    return float(triangle_quality(placed.points, triangles).min())


def _begin(obj: LabelObject, axes: FloatArray) -> Placed:
    """An even mesh around an object's voxels."""
    rough = PatchSurface(*outline(obj, axes, _OUTLINE))
    template = charge_template(_COARSE)
    placed = place_evenly(template.directions, template.cells, rough)
    if placed.folded or triangle_quality(placed.points, placed.cells).min() < _POOR:
        placed = place_evenly(template.directions, template.cells, rough, connectivity="auto")
    return placed
