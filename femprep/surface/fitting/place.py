"""A template and a smooth closed surface in, the template placed on it with even triangles out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femprep.errors import StageError
from femprep.mesh.energies.distortion import Ideal
from femprep.mesh.energies.lbfgs import Place, descend, on_sphere, smoother
from femprep.mesh.measures.triangles import areas
from femprep.mesh.patches import PatchSurface
from femprep.mesh.topology import euler_characteristic, is_closed
from femprep.model import FloatArray, IntArray
from femprep.model.products import product
from femprep.surface.fitting.chart import Chart, turn
from femprep.surface.fitting.parametrisation import sphere_map
from femprep.surface.fitting.slide import SIZE, STEPS, Connectivity, Goal, Slid, slide_evenly


@dataclass(frozen=True, eq=False)
class Placed(Slid):
    """A template on a surface.

    Attributes
    ----------
    directions : (V, 3) array
        Its vertices on the sphere, unit vectors: where they were, or where they belong after edges were flipped, so
        that the cells are not folded there either.
    """

    directions: FloatArray


def place_evenly(
    directions: FloatArray,
    cells: IntArray,
    surface: PatchSurface,
    *,
    chart: Chart | None = None,
    connectivity: Connectivity = "template",
    curvature: float = 0.0,
) -> Placed:
    """Place a template on a smooth closed surface so that its triangles, or quadrilaterals, are even.

    The surface is mapped to the sphere with little distortion of angles and areas and turned so that a vertex should
    lie in its direction as seen from the surface's middle; through that map the template is carried to the surface,
    and there its vertices slide to a minimum of the distortion of its cells. A body much longer than wide, or with a
    narrow appendage, has no even triangles in the order of a sphere's: there, by choice, edges are flipped as well.

    Parameters
    ----------
    directions : (V, 3) array
        The template's vertices, unit vectors.
    cells : (T, 3) or (T, 4) array
        Its triangles or quadrilaterals, wound outward.
    surface : PatchSurface
        The smooth surface, of a ball's topology, wound outward.
    chart : Chart, optional
        A map of the surface to the sphere that is known already, in place of one made here.
    connectivity : str
        ``"template"``: the template's cells. ``"free"``: edges are flipped wherever that makes triangles more even.
        ``"auto"``: flipped where triangles would be worse than usual otherwise, or cut off too much. Quadrilaterals
        stay as they are.
    curvature : float
        The area of cells goes with the curvature to minus this power where that is large; 0: the same everywhere.

    Raises
    ------
    StageError
        The surface is not a closed surface of one piece without handles.
    """
    if not is_closed(surface.triangles) or euler_characteristic(surface.triangles) != 2:
        raise StageError(
            "the smooth surface is not a ball's: it is open or has "
            f"Euler characteristic {euler_characteristic(surface.triangles)}, not 2"
        )
    goal = Goal(surface, len(cells), curvature)
    chart = Chart.of(goal, directions) if chart is None else chart
    slid = slide_evenly(chart.points_at(directions), cells, goal, connectivity)
    if slid.flips:
        directions = _unfolded(chart.directions_at(slid.points), slid)
    return Placed(**vars(slid), directions=directions)


def placed_or_flipped(directions: FloatArray, cells: IntArray, surface: PatchSurface, least: float) -> Placed:
    """A template placed on a surface, its edges flipped where it is folded or the least Q is below one asked for."""
    placed = place_evenly(directions, cells, surface)
    if placed.folded or placed.least < least:
        placed = place_evenly(directions, cells, surface, connectivity="auto")
    return placed


def _unfolded(directions: FloatArray, slid: Slid) -> FloatArray:
    """Unit vectors near directions at which none of the triangles is folded on the sphere, if there are any."""
    whole = areas(slid.points, slid.cells)
    ideal = Ideal.of(slid.points, slid.cells, np.full(len(whole), np.sqrt(4.0 * np.pi / whole.sum())))
    place = on_sphere(directions)
    if _upright(ideal, place):
        return place.points
    solve = smoother(slid.cells, len(directions))
    found = descend(place.points, on_sphere, ideal, solve, SIZE, STEPS)[0]
    if _upright(ideal, found):
        return found.points
    # Anew, turned to where the vertices should be.
    sphere = sphere_map(slid.points, slid.cells)
    return product(sphere, turn(sphere, place.points, whole, slid.cells).T)


def _upright(ideal: Ideal, place: Place) -> bool:
    return bool(np.isfinite(ideal.measure(*place, 0.0)[0]))
