"""A template and a smooth closed surface in, the template placed on it with even triangles out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from femprep.errors import StageError
from femprep.mesh.energies.distortion import Ideal
from femprep.mesh.energies.lbfgs import OnPatches, Place, descend, on_sphere, smoother
from femprep.mesh.measures.triangles import areas, triangle_quality, vertex_sums
from femprep.mesh.operations.decimation import coarser
from femprep.mesh.operations.flips import flip_edges
from femprep.mesh.patches import PatchSurface
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import euler_characteristic, is_closed, volume
from femprep.model import FloatArray, IntArray
from femprep.model.functions import exponential, logarithm
from femprep.model.products import inner, nearest_orthogonal, product, unit_vectors, weighted
from femprep.surface.fitting.parametrisation import sphere_map

Connectivity = Literal["template", "auto", "free"]

#: Vertices of the coarse mesh from which the map to the sphere is made.
_COARSE: Final = 1000
#: What a cell's area counts beside its shape: where cells are the template's; where edges are flipped, first much, so
#: that vertices spread, then as there.
_SIZE: Final = 0.1
_SIZES: Final = (1.0, 0.3, 0.1)
#: Steps of a descent at most, without flips and between them, and rounds of flips and descents for each of the above.
_STEPS: Final = 100
_STEPS_FREE: Final = 20
_ROUNDS: Final = 8
#: Least quality below which, where edges are flipped, the worst triangles are cared for in so many more rounds.
_WORST: Final = 0.65
_ROUNDS_WORST: Final = 3
#: Quality, mean and least, and share of the volume cut off by flat triangles, with which the template's are left.
_ENOUGH: Final = (0.955, 0.55)
_CUT: Final = 0.02


@dataclass(frozen=True, eq=False)
class Slid:
    """Cells on a surface, as even as sliding and flipping made them.

    Attributes
    ----------
    points, normals : (V, 3) arrays
        Vertices on the smooth surface, mm, and its unit normals there.
    cells : (T, 3) or (T, 4) array
        Those given, or the same number of others on the same vertices.
    steps : int
        Of all descents.
    flips : int
        Edges flipped.
    folded : int
        Cells turned against the surface: 0 unless it bends more sharply than they can follow.
    """

    points: FloatArray
    normals: FloatArray
    cells: IntArray
    steps: int
    flips: int
    folded: int


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


class Goal:
    """A smooth surface and how large cells on it should be.

    Parameters
    ----------
    surface : PatchSurface
        Closed, wound outward.
    count : int
        Number of cells.
    curvature : float
        How the size follows the curvature, see :func:`place_evenly`.
    """

    def __init__(self, surface: PatchSurface, count: int, curvature: float = 0.0) -> None:
        self.surface = surface
        bend = surface.bend()
        around = areas(surface.points, surface.triangles)
        share = vertex_sums(around / 3.0, surface.triangles, len(bend))
        square = np.einsum("nij,nij->n", bend, bend)
        usual = inner(share, square) / float(share.sum())
        self.density: FloatArray = np.asarray(exponential(0.5 * curvature * logarithm(1.0 + square / usual)))
        self.area: FloatArray = inner(share, self.density) / count / self.density

    def cells(self, cells: IntArray, near: IntArray) -> Ideal:
        """Ideal cells at vertices near the given ones of the surface."""
        return Ideal.even(cells, self.area[near][cells].mean(axis=1))


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
    if placed.folded or _least(placed) < least:
        placed = place_evenly(directions, cells, surface, connectivity="auto")
    return placed


@dataclass(frozen=True, eq=False)
class Chart:
    """A coarse mesh of a surface with the place of each vertex on the sphere: a map both ways, rough but not folded.

    Attributes
    ----------
    points : (n, 3) array
        mm.
    cells : (m, 3) array
        Triangles.
    sphere : (n, 3) array
        Unit vectors.
    """

    points: FloatArray
    cells: IntArray
    sphere: FloatArray

    @classmethod
    def of(cls, goal: Goal, directions: FloatArray, start: FloatArray | None = None) -> Chart:
        """The chart with little distortion of angles and areas, turned so that ``start``, mm, lies at ``directions``.

        By default each of its vertices should lie in its direction as seen from the surface's middle.
        """
        points, cells = coarser(goal.surface.points, goal.surface.triangles, _COARSE)
        density = goal.density[goal.surface.nearest(points)]
        sphere = sphere_map(points, cells, density)
        weight = areas(points, cells) * density[cells].mean(axis=1)
        return cls(points, cells, product(sphere, _turn(sphere, _wanted(points, directions, start), weight, cells).T))

    def points_at(self, directions: FloatArray) -> FloatArray:
        """Points ``(q, 3)`` of the mesh for unit vectors ``(q, 3)``."""
        return _carry(directions, self.sphere, self.points, self.cells)

    def directions_at(self, points: FloatArray) -> FloatArray:
        """Places ``(q, 3)`` on the sphere, about unit vectors, for points ``(q, 3)`` near the mesh."""
        return _carry(points, self.points, self.sphere, self.cells)


def slide_evenly(
    points: FloatArray,
    cells: IntArray,
    goal: Goal,
    connectivity: Connectivity = "template",
    near: IntArray | None = None,
) -> Slid:
    """Slide a template that lies on a smooth surface along it until its cells are even.

    Parameters
    ----------
    points : (V, 3) array
        Vertices on or near the surface, mm. Where cells are folded they are unfolded, if possible.
    cells, connectivity
        As for :func:`place_evenly`.
    goal : Goal
        The surface.
    near : (V,) array, optional
        The surface's vertex nearest to each, where sides of a thin body could be mistaken for each other.
    """
    if connectivity != "free" or cells.shape[1] != 3:
        kept = _kept(points, cells, goal, near)
        if connectivity == "template" or cells.shape[1] != 3 or _enough(kept, goal):
            return kept
        if kept.folded == 0:
            points = kept.points
    return _free(points, cells, goal, near)


def _kept(points: FloatArray, cells: IntArray, goal: Goal, near: IntArray | None) -> Slid:
    domain = OnPatches(goal.surface, near)
    domain(points)
    solve = smoother(cells, len(points))
    place, steps = descend(points, domain, goal.cells(cells, domain.near), solve, _SIZE, _STEPS)
    if np.ptp(goal.area) > 0.0:
        place, more = descend(place.points, domain, goal.cells(cells, domain.near), solve, _SIZE, _STEPS)
        steps += more
    return _slid(place, cells, steps, 0)


def _free(points: FloatArray, cells: IntArray, goal: Goal, near: IntArray | None) -> Slid:
    domain = OnPatches(goal.surface, near)
    place = domain(points)
    steps = flips = 0
    for size in _SIZES:
        for turn in range(_ROUNDS):
            cells, flipped = flip_edges(place.points, place.normals, cells, goal.area[domain.near], size)
            flips += flipped
            if turn and not flipped:
                break
            ideal, solve = goal.cells(cells, domain.near), smoother(cells, len(points))
            place, more = descend(place.points, domain, ideal, solve, size, _STEPS_FREE)
            steps += more
    slid = _slid(place, cells, steps, flips)
    return slid if _least(slid) >= _WORST else _worst_first(slid, domain, goal)


def _worst_first(slid: Slid, domain: OnPatches, goal: Goal) -> Slid:
    """More rounds in which triangles count by their distortion, if they make the worst one better."""
    best, place, cells = slid, domain(slid.points), slid.cells
    for _ in range(_ROUNDS_WORST):
        ideal = goal.cells(cells, domain.near)
        weight = ideal.each(place.points, place.normals, _SIZE)
        upright = np.isfinite(weight)
        weight = np.where(upright, weight, 10.0 * weight[upright].max(initial=1.0))
        ideal, solve = replace(ideal, weight=weight / weight.sum()), smoother(cells, len(place.points))
        place, steps = descend(place.points, domain, ideal, solve, _SIZE, _STEPS_FREE)
        cells, flipped = flip_edges(place.points, place.normals, cells, goal.area[domain.near], _SIZE)
        now = _slid(place, cells, best.steps + steps, best.flips + flipped)
        if now.folded <= best.folded and _least(now) > _least(best):
            best = now
    return best


def _least(slid: Slid) -> float:
    return float(triangle_quality(slid.points, slid.cells).min())


def _slid(place: Place, cells: IntArray, steps: int, flips: int) -> Slid:
    folded = Ideal.even(cells, np.ones(len(cells))).folded(place.points, place.normals)
    return Slid(place.points, place.normals, cells, steps, flips, int(np.count_nonzero(folded)))


def _enough(slid: Slid, goal: Goal) -> bool:
    """Whether triangles are as even as they usually are in the template's order."""
    quality = triangle_quality(slid.points, slid.cells)
    whole = volume(goal.surface.points, goal.surface.triangles)
    return (
        slid.folded == 0
        and float(quality.mean()) >= _ENOUGH[0]
        and float(quality.min()) >= _ENOUGH[1]
        and volume(slid.points, slid.cells) >= (1.0 - _CUT) * whole
    )


def sphere_turned(points: FloatArray, cells: IntArray, directions: FloatArray) -> FloatArray:
    """Places ``(n, 3)`` of a closed mesh on the sphere, turned so that each lies in its direction from the middle."""
    sphere = sphere_map(points, cells)
    return product(sphere, _turn(sphere, _wanted(points, directions, None), areas(points, cells), cells).T)


def _wanted(points: FloatArray, directions: FloatArray, start: FloatArray | None) -> FloatArray:
    """Unit vectors at which points of the surface should lie on the sphere, roughly."""
    if start is None:
        return unit_vectors(points - points.mean(axis=0))
    from scipy.spatial import cKDTree

    return np.asarray(directions[cKDTree(start).query(points)[1]])


def _turn(sphere: FloatArray, wanted: FloatArray, weight: FloatArray, cells: IntArray) -> FloatArray:
    """The rotation ``(3, 3)`` after which vectors agree best with those wanted."""
    share = vertex_sums(weight, cells, len(sphere))
    alike = weighted(wanted, share[:, None] * sphere)
    found = nearest_orthogonal(alike)
    if found is not None and np.linalg.det(found) > 0.0:
        return found
    left, _, right = np.linalg.svd(alike)
    flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return np.asarray(left @ flip @ right)


def _carry(queries: FloatArray, one: FloatArray, other: FloatArray, cells: IntArray) -> FloatArray:
    """Points near a mesh carried to the same mesh with its vertices elsewhere: linear within its triangles."""
    return ClosestFinder(one, cells)(queries).at(other)


def _unfolded(directions: FloatArray, slid: Slid) -> FloatArray:
    """Unit vectors near directions at which none of the triangles is folded on the sphere, if there are any."""
    whole = areas(slid.points, slid.cells)
    ideal = Ideal.of(slid.points, slid.cells, np.full(len(whole), np.sqrt(4.0 * np.pi / whole.sum())))
    place = on_sphere(directions)
    if _upright(ideal, place):
        return place.points
    solve = smoother(slid.cells, len(directions))
    found = descend(place.points, on_sphere, ideal, solve, _SIZE, _STEPS)[0]
    if _upright(ideal, found):
        return found.points
    # Anew, turned to where the vertices should be.
    sphere = sphere_map(slid.points, slid.cells)
    return product(sphere, _turn(sphere, place.points, whole, slid.cells).T)


def _upright(ideal: Ideal, place: Place) -> bool:
    return bool(np.isfinite(ideal.measure(*place, 0.0)[0]))
