"""A LabelObject in, a template placed evenly on the surface its labels most likely come from out."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

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
#: Least stiffness, mm^4, and smoothing of the outline, in voxels, of the tries: the first leaves all to the labels, the
#: others follow for the sake of sound triangles, and of a least Q of this.
_SMOOTHER: Final = ((0.0, 1.0), (3e3, 1.5), (1e4, 2.0), (5e4, 2.0))
_ACCEPTED: Final = 0.4
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
    evidence = Evidence.of(obj, axes, boundary)
    goal = _Goal(directions @ axes, cells, connectivity, curvature)
    best = None
    for softest, blur in _SMOOTHER:
        found = _smoothed(obj, axes, evidence, goal, softest, blur)
        if found is not None and (best is None or found.quality > best.quality):
            best = found
        if best is not None and best.quality >= _ACCEPTED:
            break
    if best is None:
        raise StageError(f"the smooth surface of {obj.name!r} bends too sharply for {len(directions)} vertices")
    placed = best.placed
    shape = PlacedShape(
        best.surface, placed.directions @ axes.T, split_quads(placed.cells), placed.points, axes, obj.barycentre
    )
    notices = []
    if best.softest > 0.0:
        notices.append(
            f"surface {obj.name} bends too sharply for {len(directions)} vertices where it follows the labels closely; "
            "it was smoothed more"
        )
    if placed.flips and connectivity == "auto":
        notices.append(
            f"surface {obj.name} is too long or branched for even triangles in the template's order; edges were flipped"
        )
    info = {"steps": placed.steps, "flips": placed.flips, "notices": notices}
    return shape, shape.to_world(placed.points), placed.cells, info


class _Goal(NamedTuple):
    """A template in the image's axes, and how it is placed."""

    directions: FloatArray
    cells: IntArray
    connectivity: Connectivity
    curvature: float


class _Smoothed(NamedTuple):
    """A smooth surface, the template on it, its least Q, and the least stiffness it was bent with."""

    surface: PatchSurface
    placed: Placed
    quality: float
    softest: float


def _smoothed(
    obj: LabelObject, axes: FloatArray, evidence: Evidence, goal: _Goal, softest: float, blur: float
) -> _Smoothed | None:
    """Estimate the surface and place the template on it; None where triangles cross or are folded."""
    begin = _begin(obj, axes, blur)
    estimate = estimate_surface(begin.points, begin.cells, evidence, softest)
    surface = outset(estimate, Goal(estimate, len(split_quads(goal.cells)), goal.curvature).area)
    if len(self_intersections(surface.points, surface.triangles)):
        surface = PatchSurface(apart(estimate.points, surface.points, surface.triangles), surface.triangles)
    if len(self_intersections(surface.points, surface.triangles)):
        # No template can be placed on what is not a surface.
        return None
    # The triangles of the mesh it began with were cut at the middles of their sides.
    middles = begin.directions[edge_table(begin.cells).nodes].sum(axis=1)
    middles /= np.linalg.norm(middles, axis=1, keepdims=True)
    chart = Chart(surface.points, surface.triangles, np.concatenate([begin.directions, middles]))
    best = None
    for known, curvature in ((chart, goal.curvature), (None, goal.curvature), (None, max(goal.curvature, _FINER))):
        placed = place_evenly(
            goal.directions, goal.cells, surface, chart=known, connectivity=goal.connectivity, curvature=curvature
        )
        quality = _quality(placed)
        if quality >= 0.0 and (best is None or quality > best.quality):
            best = _Smoothed(surface, placed, quality, softest)
        if quality >= _FAIR:
            break
    return best


def _quality(placed: Placed) -> float:
    """Least Q of a placed template's triangles, -1 where some cross or are folded."""
    triangles = split_quads(placed.cells)
    if placed.folded or not volume(placed.points, triangles) > 0.0:
        return -1.0
    if len(self_intersections(placed.points, triangles)):
        return -1.0
    return float(triangle_quality(placed.points, triangles).min())


def _begin(obj: LabelObject, axes: FloatArray, blur: float) -> Placed:
    """An even mesh around an object's voxels."""
    rough = PatchSurface(*outline(obj, axes, _OUTLINE, blur))
    template = charge_template(_COARSE)
    placed = place_evenly(template.directions, template.cells, rough)
    if placed.folded or triangle_quality(placed.points, placed.cells).min() < _POOR:
        placed = place_evenly(template.directions, template.cells, rough, connectivity="auto")
    return placed
