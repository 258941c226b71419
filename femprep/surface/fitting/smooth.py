"""A LabelObject in, a template placed evenly on the surface its labels most likely come from out."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from femprep.errors import StageError
from femprep.image.boundary import BoundaryPoints
from femprep.image.canonical_frame import CanonicalFrame
from femprep.image.hull import hull_share
from femprep.image.object import LabelObject
from femprep.mesh.operations.step_back import step_uncrossed
from femprep.mesh.patches import PatchSurface
from femprep.mesh.search.intersection import self_intersections
from femprep.mesh.topology import edge_table
from femprep.model import FloatArray, IntArray, split_quads
from femprep.model.products import unit_vectors
from femprep.surface.estimate import estimate_surface
from femprep.surface.estimate.chords import outset
from femprep.surface.estimate.observations import Observations
from femprep.surface.estimate.outline import outlines
from femprep.surface.fitting.chart import Chart
from femprep.surface.fitting.laying import Laid, Laying, Outlines, TemplateToLay
from femprep.surface.fitting.place import placed_or_flipped
from femprep.surface.fitting.placed_parametrisation import PlacedShape
from femprep.surface.fitting.remeshing import even_mesh
from femprep.surface.fitting.slide import Connectivity, Goal
from femprep.surface.fitting.taken import Taken
from femprep.surface.fitting.ways import ACCEPTANCE, BEGINNINGS, TIPLESS, Beginning, FitAttempt
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
    NoSurfaceError
        Triangles cross or are folded, or a mesh could not be bent; it has the attempts.
    """
    # All is done in the canonical frame, so that a turned image gives the same surface, turned.
    canonical = CanonicalFrame.of(obj)
    observations = Observations.of(canonical.obj, canonical.boundary(boundary))
    # Whatever was put elsewhere than the labels have it lies beyond their slices: in them their outlines hold.
    slices = Outlines(canonical.obj)
    template = TemplateToLay(canonical.directions(directions), cells, connectivity, curvature)
    tried: list[Laid] = []
    for beginning in BEGINNINGS:
        if beginning.tips and (min(one.poor for one in tried) > 1.0 or hull_share(obj) > TIPLESS):
            break
        try:
            tried += _fitted(canonical.obj, beginning, observations, template, slices)
        except StageError:  # a mesh crumpled while it was bent; one that begins otherwise may not
            tried.append(Laid(FitAttempt(beginning=beginning.name, status="no mesh")))
        if min(one.short for one in tried) <= 1.0:
            break
    taken = Taken.of(tried, f"the smooth surface of {obj.name!r} bends too sharply for {len(directions)} vertices")
    shape = taken.shape(canonical.axes, obj.barycentre)
    return shape, shape.to_world(taken.placed.points), taken.placed.cells, taken.info(obj.name, connectivity)


def _fitted(
    obj: LabelObject, beginning: Beginning, observations: Observations, template: TemplateToLay, slices: Outlines
) -> list[Laid]:
    """Bend a mesh to the surface and lay the template on it, by one way after the other until one is good."""
    mesh = _begin(obj, beginning)
    if mesh is None:
        return [Laid(FitAttempt(beginning=beginning.name, status="no mesh"))]
    estimate = estimate_surface(mesh.points, mesh.cells, observations, beginning.rounds)
    surface = outset(estimate, Goal(estimate, len(split_quads(template.cells)), template.curvature).area)
    if len(self_intersections(surface.points, surface.triangles)):
        surface = PatchSurface(step_uncrossed(estimate.points, surface.points, surface.triangles), surface.triangles)
    if len(self_intersections(surface.points, surface.triangles)):
        # No template can be placed on what is not a surface.
        return [Laid(FitAttempt(beginning=beginning.name, status="folded"))]
    chart = None if mesh.sphere is None else _chart(surface, mesh.cells, mesh.sphere)
    return Laying(beginning.name, template, slices, estimate, surface, chart).attempts()


def _chart(surface: PatchSurface, cells: IntArray, sphere: FloatArray) -> Chart:
    """The map known from the mesh a surface began with, whose triangles were cut at the middles of their sides."""
    middles = unit_vectors(sphere[edge_table(cells).nodes].sum(axis=1))
    return Chart(surface.points, surface.triangles, np.concatenate([sphere, middles]))


def _begin(obj: LabelObject, beginning: Beginning) -> Rough | None:
    """An even mesh around the voxels of an object in its canonical frame; None where it could not be made."""
    fine, coarse = outlines(obj, beginning.outline)
    if beginning.drawn:
        drawn = even_mesh(*coarse, PatchSurface(*fine), beginning.vertices)
        return None if drawn is None or drawn.folded else Rough(drawn.points, drawn.cells, None)
    rough = PatchSurface(*coarse)
    template = charge_template(beginning.vertices)
    placed = placed_or_flipped(template.directions, template.cells, rough, ACCEPTANCE.rough)
    if placed.folded or len(self_intersections(placed.points, placed.cells)):
        return None
    return Rough(placed.points, placed.cells, placed.directions)
