"""A LabelObject in, a template placed evenly on the surface its labels most likely come from out."""

from __future__ import annotations

from typing import Any, NamedTuple

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
from femprep.surface.estimate.outline import outlines
from femprep.surface.fitting.place import Chart, Connectivity, Goal, Placed, place_evenly
from femprep.surface.fitting.placed_parametrisation import PlacedShape
from femprep.surface.fitting.remeshing import even_mesh, redraw
from femprep.surface.fitting.ways import ACCEPTANCE, BEGINNINGS, WAYS, Attempt, Beginning, Way
from femprep.surface.measure.inslice import label_distance
from femprep.template import charge_template


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
    slices = _Outlines(rest.obj)
    goal = _Goal(rest.directions(directions), cells, connectivity, curvature)
    tried: list[_Laid] = []
    for beginning in BEGINNINGS:
        tried += _fitted(rest.obj, beginning, evidence, goal, slices)
        best = min(tried, key=lambda one: one.short)
        if best.short <= 1.0:
            break
    if best.shape is None or best.placed is None or best.short == np.inf:
        raise StageError(f"the smooth surface of {obj.name!r} bends too sharply for {len(directions)} vertices")
    placed = best.placed
    shape = PlacedShape(
        best.shape,
        product(placed.directions, rest.axes.T),
        split_quads(placed.cells),
        placed.points,
        rest.axes,
        obj.barycentre,
    )
    notices = []
    redrawn = best.attempt.way == WAYS[-1].name
    if redrawn:
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
        "redrawn": redrawn,
        "attempts": [
            each.attempt.model_copy(update={"status": "taken"} if each is best else {}).model_dump(exclude_none=True)
            for each in tried
        ],
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

    def short(self, off: float, estimate: PatchSurface, outset: PatchSurface) -> float:
        """How many times farther than it should be a template is, ``off`` pixels, on the outset of an estimate."""
        if off <= ACCEPTANCE.distance:
            return off / ACCEPTANCE.distance
        best = self.off(estimate.points, estimate.triangles)
        if best > ACCEPTANCE.distance:
            # Not for its flat triangles: another estimate may come closer.
            return off / ACCEPTANCE.distance
        # Flat triangles come no closer than the surface is, give or take half of the most they cut off.
        cut = float(np.linalg.norm(outset.points - estimate.points, axis=1).mean()) / self._pixel
        return off / max(ACCEPTANCE.distance, best + 0.5 * cut)


class _Laid(NamedTuple):
    """An attempt and what it came to; how many times worse than good it is at most, infinite for no candidate."""

    attempt: Attempt
    short: float = np.inf
    shape: PatchSurface | None = None
    placed: Placed | None = None


def _fitted(obj: LabelObject, beginning: Beginning, evidence: Evidence, goal: _Goal, slices: _Outlines) -> list[_Laid]:
    """Bend a mesh to the surface and lay the template on it, by one way after the other until one is good."""
    mesh = _begin(obj, beginning)
    if mesh is None:
        return [_Laid(Attempt(beginning=beginning.name, status="no mesh"))]
    estimate = estimate_surface(mesh.points, mesh.cells, evidence, beginning.rounds)
    surface = outset(estimate, Goal(estimate, len(split_quads(goal.cells)), goal.curvature).area)
    if len(self_intersections(surface.points, surface.triangles)):
        surface = PatchSurface(apart(estimate.points, surface.points, surface.triangles), surface.triangles)
    if len(self_intersections(surface.points, surface.triangles)):
        # No template can be placed on what is not a surface.
        return [_Laid(Attempt(beginning=beginning.name, status="folded"))]
    chart = None if mesh.sphere is None else _chart(surface, mesh.cells, mesh.sphere)
    triangles = goal.cells.shape[1] == 3

    def attempt(way: Way, placed: Placed | None) -> _Laid:
        quality = -1.0 if placed is None else _quality(placed)
        if placed is None or quality < 0.0:
            status = "no mesh" if placed is None else "folded"
            return _Laid(Attempt(beginning=beginning.name, way=way.name, status=status), shape=surface, placed=placed)
        mean = float(triangle_quality(placed.points, placed.cells).mean()) if triangles else None
        record = Attempt(
            beginning=beginning.name, way=way.name, status="sound", least_quality=quality, mean_quality=mean
        )
        return _Laid(record, shape=surface, placed=placed)

    def judged(laid: _Laid) -> _Laid:
        record = laid.attempt
        if laid.placed is None or record.least_quality is None:
            return laid
        off = slices.off(laid.placed.points, split_quads(laid.placed.cells))
        short = [ACCEPTANCE.least / max(record.least_quality, 1e-9), slices.short(off, estimate, surface)]
        if record.mean_quality is not None:
            short.append((1.0 - record.mean_quality) / (1.0 - ACCEPTANCE.mean))
        return laid._replace(short=max(short), attempt=record.model_copy(update={"distance_pixels": off}))

    tried: list[_Laid] = []
    for way in WAYS:
        if way.redrawn or (way.known and chart is None):
            continue
        placed = place_evenly(
            goal.directions,
            goal.cells,
            surface,
            chart=chart if way.known else None,
            connectivity=goal.connectivity,
            curvature=max(goal.curvature, way.finer),
        )
        tried.append(attempt(way, placed))
        if (tried[-1].attempt.least_quality or 0.0) >= ACCEPTANCE.fair:
            break
    # Of the maps the one with the best triangles alone is a candidate.
    best = max(range(len(tried)), key=lambda k: -1.0 if (q := tried[k].attempt.least_quality) is None else q)
    tried[best] = judged(tried[best])
    if tried[best].short > 1.0 and goal.connectivity != "template" and triangles:
        redrawn = redraw(goal.directions, surface, goal.curvature)
        tried.append(judged(attempt(WAYS[-1], redrawn)))
    return tried


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


def _begin(obj: LabelObject, beginning: Beginning) -> Rough | None:
    """An even mesh around the voxels of an object at rest; None where it could not be made."""
    fine, coarse = outlines(obj, beginning.outline)
    if beginning.drawn:
        drawn = even_mesh(*coarse, PatchSurface(*fine), beginning.vertices)
        return None if drawn is None or drawn.folded else Rough(drawn.points, drawn.cells, None)
    rough = PatchSurface(*coarse)
    template = charge_template(beginning.vertices)
    placed = place_evenly(template.directions, template.cells, rough)
    if placed.folded or triangle_quality(placed.points, placed.cells).min() < ACCEPTANCE.rough:
        placed = place_evenly(template.directions, template.cells, rough, connectivity="auto")
    if placed.folded or len(self_intersections(placed.points, placed.cells)):
        return None
    return Rough(placed.points, placed.cells, placed.directions)
