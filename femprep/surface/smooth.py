"""A harmonic map and labels in, the template placed evenly on the surface the labels most likely come from out."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from femprep.errors import StageError
from femprep.geometry.intersection import self_intersections
from femprep.geometry.topology import volume
from femprep.image.boundary import BoundaryPoints
from femprep.image.object import LabelObject
from femprep.model import FloatArray, IntArray, split_quads
from femprep.surface.estimate import estimate_surface
from femprep.surface.estimate.evidence import Evidence
from femprep.surface.mend import Target
from femprep.surface.place import place_evenly
from femprep.surface.placed import PlacedShape
from femprep.template import charge_template

#: Vertices of the mesh that is bent.
_DENSE: Final = 3000
#: Share of its triangles that may cross: a few in a sharp bend are passed over by the template's.
_CROSSED: Final = 0.02
#: Smoothing of the stopping function the mesh begins with.
_ROUGH: Final = 1e-5


def smooth_map(
    target: Target, obj: LabelObject, boundary: BoundaryPoints
) -> tuple[PlacedShape, FloatArray, IntArray, dict[str, Any]]:
    """Estimate an object's surface from its labels, beginning with the harmonic map, and place the template on it.

    Parameters
    ----------
    target : Target
        The paper's field, boundary values and template.
    obj : LabelObject
    boundary : BoundaryPoints
        Its boundary.

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
    template = charge_template(_DENSE)
    rough = target.stopped(_ROUGH)[0]
    # All is done along the image's axes, so that a turned image gives the same surface, turned.
    axes, centre = target.axes, obj.barycentre
    begin = (rough(template.directions @ axes.T) - centre) @ axes
    surface = estimate_surface(begin, template.cells, Evidence.of(obj, axes, boundary))
    crossing = len(np.unique(self_intersections(surface.points, surface.triangles)))
    if crossing > _CROSSED * len(surface.triangles):
        # No template can be placed on what is not a surface.
        raise StageError(f"the smooth surface of {obj.name!r} crosses itself in {crossing} places")
    start = (rough(target.directions) - centre) @ axes
    placed = place_evenly(
        target.directions @ axes,
        target.cells,
        surface,
        start,
        connectivity=target.connectivity,
        curvature=target.curvature,
    )
    triangles, directions = split_quads(placed.cells), placed.directions @ axes.T
    shape = PlacedShape(surface, directions, triangles, placed.points, axes, centre)
    points = shape(directions)
    crossing = len(np.unique(self_intersections(points, triangles)))
    if crossing or placed.folded or not volume(points, triangles) > 0.0:
        raise StageError(
            f"the smooth surface of {obj.name!r} has {crossing} crossing and {placed.folded} folded triangles"
        )
    return shape, points, placed.cells, {"steps": placed.steps, "flips": placed.flips, "notices": []}
