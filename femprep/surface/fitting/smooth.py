"""A LabelObject in, a template placed evenly on the surface its labels most likely come from out."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np

from femprep.errors import InputError, StageError
from femprep.image.boundary import BoundaryPoints
from femprep.image.canonical_frame import AtRest
from femprep.image.object import LabelObject
from femprep.mesh.intersection import self_intersections
from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.operations.step_back import apart
from femprep.mesh.patches import PatchSurface
from femprep.mesh.topology import edge_table, volume
from femprep.model import FloatArray, IntArray, Notice, Surface, records, split_quads
from femprep.model.products import product
from femprep.surface.estimate import estimate_surface
from femprep.surface.estimate.chords import outset
from femprep.surface.estimate.observations import Evidence
from femprep.surface.estimate.outline import outline, outlines
from femprep.surface.fitting.place import Chart, Connectivity, Goal, Placed, place_evenly
from femprep.surface.fitting.placed_parametrisation import PlacedShape
from femprep.surface.fitting.remeshing import even_mesh, redraw
from femprep.surface.measure.inslice import label_distance
from femprep.template import charge_template

#: Vertices of the outline's mesh, and of the mesh on it that is bent; in the end that has four times as many.
_OUTLINE: Final = 1000
_COARSE: Final = 752
#: The same where the mesh is drawn on the outline instead of carried there from a sphere, and rounds of bending it in
#: the end.
_OUTLINE_DRAWN: Final = 2000
_COARSE_DRAWN: Final = 1000
_ROUNDS_DRAWN: Final = 4
#: Least quality of triangles with which the template on the outline is left.
_POOR: Final = 0.3


class Rough(NamedTuple):
    """A mesh near an object's surface.

    Attributes
    ----------
    points : (n, 3) array
        Vertices, in coordinates along the image's axes from the object's barycentre, mm.
    cells : (m, 3) array
        Triangles, wound outward.
    sphere : (n, 3) array, optional
        Where the vertices lie on the sphere, if they come from there.
    """

    points: FloatArray
    cells: IntArray
    sphere: FloatArray | None


class _Try(NamedTuple):
    """Least stiffness of the surface, mm^4, smoothing of the outline it begins with, in voxels, and how that is meshed:
    by a sphere carried there, or drawn on it."""

    softest: float
    blur: float
    drawn: bool


#: The first two leave all to the labels; the others follow for the sake of sound triangles.
_FAITHFUL: Final = (_Try(0.0, 1.0, False), _Try(0.0, 1.0, True))
_SMOOTHER: Final = (_Try(3e3, 1.5, True), _Try(1e4, 2.0, True), _Try(5e4, 2.0, True))
#: Least Q with which no surface is smoothed more.
_ACCEPTED: Final = 0.4
#: Quality of the triangles, mean and least, and mean distance to the labels' outlines in the slices, in pixels, with
#: which nothing else is tried.
_MEAN: Final = 0.95
_LEAST: Final = 0.5
_DISTANCE: Final = 0.25
#: Least Q with which the placed template is left; else it is placed anew by a map that is made for the bent surface,
#: then with finer triangles where that is curved, by this power.
_FAIR: Final = 0.6
_FINER: Final = 0.5


def smooth_map(
    obj: LabelObject,
    boundary: BoundaryPoints,
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
    directions : (V, 3) array
        The template's vertices, unit vectors.
    cells : (m, 3) or (m, 4) array
        Its triangles or quadrilaterals.
    connectivity, curvature
        As for :func:`~femprep.surface.fitting.place.place_evenly`.

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
    # All is done at rest, so that a turned image gives the same surface, turned.
    rest = AtRest.of(obj)
    evidence = Evidence.of(rest.obj, rest.boundary(boundary))
    # Whatever was put elsewhere than the labels have it lies beyond their slices: in them their outlines hold.
    outlines = _Outlines(rest.obj)
    goal = _Goal(rest.directions(directions), cells, connectivity, curvature)
    best = None
    for each in _FAITHFUL + _SMOOTHER:
        if best is not None and (best.short <= 1.0 or (each in _SMOOTHER and best.quality >= _ACCEPTED)):
            break
        begin = _begin(rest.obj, each)
        # None where triangles cross or are folded already.
        found = None if begin is None else _smoothed(begin, evidence, goal, outlines, each)
        if found is not None and (best is None or found.short < best.short):
            best = found
    if best is None:
        raise StageError(f"the smooth surface of {obj.name!r} bends too sharply for {len(directions)} vertices")
    placed = best.placed
    shape = PlacedShape(
        best.surface,
        product(placed.directions, rest.axes.T),
        split_quads(placed.cells),
        placed.points,
        rest.axes,
        obj.barycentre,
    )
    notices = []
    if best.softest > 0.0:
        notices.append(
            f"surface {obj.name} bends too sharply for {len(directions)} vertices where it follows the labels closely; "
            "it was smoothed more"
        )
    if best.redrawn:
        notices.append(
            f"surface {obj.name} is too long or branched to be covered from a sphere; its triangles were drawn anew, "
            "and vertices lie less exactly where those of the same number lie in other phases and hearts"
        )
    elif placed.flips and connectivity == "auto":
        notices.append(
            f"surface {obj.name} is too long or branched for even triangles in the template's order; edges were flipped"
        )
    info = {
        "steps": placed.steps,
        "flips": placed.flips,
        "redrawn": best.redrawn,
        "notices": records(*(Notice.of("repaired", line) for line in notices)),
    }
    return shape, shape.to_world(placed.points), placed.cells, info


class _Goal(NamedTuple):
    """A template in the image's axes, and how it is placed."""

    directions: FloatArray
    cells: IntArray
    connectivity: Connectivity
    curvature: float


class _Outlines:
    """What a surface is measured against: an object's outlines in its slices.

    Parameters
    ----------
    obj : LabelObject
        At rest; surfaces are given from its barycentre.
    """

    def __init__(self, obj: LabelObject) -> None:
        self._obj = obj
        self._pixel = min(float(s) for axis, s in enumerate(obj.grid.spacing) if axis != obj.stack_axis)

    def off(self, points: FloatArray, triangles: IntArray) -> float:
        """Mean distance of a surface from them, in pixels."""
        surface = Surface(self._obj.barycentre + points, triangles, self._obj.name)
        try:
            return label_distance(surface, self._obj).nearest / self._pixel
        except InputError:
            # It has shrunk away from all slices.
            return np.inf

    def short(self, placed: Placed, estimate: PatchSurface, outset: PatchSurface) -> float:
        """How many times farther than it should be a template is that was placed on the outset of an estimate."""
        off = self.off(placed.points, split_quads(placed.cells))
        if off <= _DISTANCE:
            return off / _DISTANCE
        best = self.off(estimate.points, estimate.triangles)
        if best > _DISTANCE:
            # Not for its flat triangles: another estimate may come closer.
            return off / _DISTANCE
        # Flat triangles come no closer than the surface is, give or take half of the most they cut off.
        cut = float(np.linalg.norm(outset.points - estimate.points, axis=1).mean()) / self._pixel
        return off / max(_DISTANCE, best + 0.5 * cut)


class _Smoothed(NamedTuple):
    """A smooth surface and the template on it: its least Q and how many times worse than good it is at most; whether
    its triangles were drawn anew, and the least stiffness the surface was bent with."""

    surface: PatchSurface
    placed: Placed
    quality: float
    short: float
    redrawn: bool
    softest: float


def _smoothed(begin: Rough, evidence: Evidence, goal: _Goal, outlines: _Outlines, each: _Try) -> _Smoothed | None:
    """Estimate the surface and place the template on it; None where triangles cross or are folded."""
    points, cells, sphere = begin
    rounds = {"rounds": _ROUNDS_DRAWN} if each.drawn else {}
    estimate = estimate_surface(points, cells, evidence, each.softest, **rounds)
    surface = outset(estimate, Goal(estimate, len(split_quads(goal.cells)), goal.curvature).area)
    if len(self_intersections(surface.points, surface.triangles)):
        surface = PatchSurface(apart(estimate.points, surface.points, surface.triangles), surface.triangles)
    if len(self_intersections(surface.points, surface.triangles)):
        # No template can be placed on what is not a surface.
        return None
    chart = None if sphere is None else _chart(surface, cells, sphere)

    def judged(placed: Placed | None, redrawn: bool) -> _Smoothed | None:
        quality = -1.0 if placed is None else _quality(placed)
        if placed is None or quality < 0.0:
            return None
        short = [_LEAST / max(quality, 1e-9)]
        if goal.cells.shape[1] == 3:
            mean = float(triangle_quality(placed.points, placed.cells).mean())
            short.append((1.0 - mean) / (1.0 - _MEAN))
        short.append(outlines.short(placed, estimate, surface))
        return _Smoothed(surface, placed, quality, max(short), redrawn, each.softest)

    best = judged(_carried(goal, surface, chart), False)
    if (best is None or best.short > 1.0) and goal.connectivity != "template" and goal.cells.shape[1] == 3:
        other = judged(redraw(goal.directions, surface, goal.curvature), True)
        if other is not None and (best is None or other.short < best.short):
            best = other
    return best


def _carried(goal: _Goal, surface: PatchSurface, chart: Chart | None) -> Placed:
    """The template carried to the surface by the map known, or by others where its triangles are poor."""
    tries = [(None, goal.curvature), (None, max(goal.curvature, _FINER))]
    best, highest = None, -np.inf
    for known, curvature in tries if chart is None else [(chart, goal.curvature), *tries]:
        placed = place_evenly(
            goal.directions, goal.cells, surface, chart=known, connectivity=goal.connectivity, curvature=curvature
        )
        quality = _quality(placed)
        if best is None or quality > highest:
            best, highest = placed, quality
        if quality >= _FAIR:
            break
    assert best is not None
    return best


def _chart(surface: PatchSurface, cells: IntArray, sphere: FloatArray) -> Chart:
    """The map known from the mesh a surface began with, whose triangles were cut at the middles of their sides."""
    middles = sphere[edge_table(cells).nodes].sum(axis=1)
    middles /= np.linalg.norm(middles, axis=1, keepdims=True)
    return Chart(surface.points, surface.triangles, np.concatenate([sphere, middles]))


def _quality(placed: Placed) -> float:
    """Least Q of a placed template's triangles, -1 where some cross or are folded."""
    triangles = split_quads(placed.cells)
    if placed.folded or not volume(placed.points, triangles) > 0.0:
        return -1.0
    if len(self_intersections(placed.points, triangles)):
        return -1.0
    return float(triangle_quality(placed.points, triangles).min())


def _begin(obj: LabelObject, each: _Try) -> Rough | None:
    """An even mesh around the voxels of an object at rest; None where it could not be made."""
    if each.drawn:
        fine, coarse = outlines(obj, _OUTLINE_DRAWN, each.blur)
        drawn = even_mesh(*coarse, PatchSurface(*fine), _COARSE_DRAWN)
        return None if drawn is None or drawn.folded else Rough(drawn.points, drawn.cells, None)
    rough = PatchSurface(*outline(obj, _OUTLINE, each.blur))
    template = charge_template(_COARSE)
    placed = place_evenly(template.directions, template.cells, rough)
    if placed.folded or triangle_quality(placed.points, placed.cells).min() < _POOR:
        placed = place_evenly(template.directions, template.cells, rough, connectivity="auto")
    if placed.folded or len(self_intersections(placed.points, placed.cells)):
        return None
    return Rough(placed.points, placed.cells, placed.directions)
