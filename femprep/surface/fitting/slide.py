"""Cells on a smooth surface in, the same slid along it, and flipped by choice, until they are even, out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from femprep.mesh.energies.distortion import Ideal
from femprep.mesh.energies.lbfgs import OnPatches, Place, descend, smoother
from femprep.mesh.measures.triangles import areas, triangle_quality, vertex_sums
from femprep.mesh.operations.flips import flip_edges
from femprep.mesh.patches import PatchSurface
from femprep.mesh.topology import volume
from femprep.model import FloatArray, IntArray
from femprep.model.functions import exponential, logarithm
from femprep.model.products import inner
from femprep.surface.fitting.ways import ACCEPTANCE

Connectivity = Literal["template", "auto", "free"]

#: What a cell's area counts beside its shape: where cells are the template's; where edges are flipped, first much, so
#: that vertices spread, then as there.
SIZE: Final = 0.1
_SIZES: Final = (1.0, 0.3, 0.1)
#: Steps of a descent at most, without flips and between them, and rounds of flips and descents for each of the above.
STEPS: Final = 100
_STEPS_FREE: Final = 20
_ROUNDS: Final = 8
#: Rounds more in which, where edges are flipped, the worst triangles are cared for.
_ROUNDS_WORST: Final = 3


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

    @property
    def least(self) -> float:
        """Least Q of the cells."""
        return float(triangle_quality(self.points, self.cells).min())


class Goal:
    """A smooth surface and how large cells on it should be.

    Parameters
    ----------
    surface : PatchSurface
        Closed, wound outward.
    count : int
        Number of cells.
    curvature : float
        How the size follows the curvature, see :func:`~femprep.surface.fitting.place.place_evenly`.
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
        As for :func:`~femprep.surface.fitting.place.place_evenly`.
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
    place, steps = descend(points, domain, goal.cells(cells, domain.near), solve, SIZE, STEPS)
    if np.ptp(goal.area) > 0.0:
        place, more = descend(place.points, domain, goal.cells(cells, domain.near), solve, SIZE, STEPS)
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
    return slid if slid.least >= ACCEPTANCE.flipped else _worst_first(slid, domain, goal)


def _worst_first(slid: Slid, domain: OnPatches, goal: Goal) -> Slid:
    """More rounds in which triangles count by their distortion, if they make the worst one better."""
    best, place, cells = slid, domain(slid.points), slid.cells
    for _ in range(_ROUNDS_WORST):
        ideal = goal.cells(cells, domain.near)
        weight = ideal.each(place.points, place.normals, SIZE)
        upright = np.isfinite(weight)
        weight = np.where(upright, weight, 10.0 * weight[upright].max(initial=1.0))
        ideal, solve = replace(ideal, weight=weight / weight.sum()), smoother(cells, len(place.points))
        place, steps = descend(place.points, domain, ideal, solve, SIZE, _STEPS_FREE)
        cells, flipped = flip_edges(place.points, place.normals, cells, goal.area[domain.near], SIZE)
        now = _slid(place, cells, best.steps + steps, best.flips + flipped)
        if now.folded <= best.folded and now.least > best.least:
            best = now
    return best


def _slid(place: Place, cells: IntArray, steps: int, flips: int) -> Slid:
    folded = Ideal.even(cells, np.ones(len(cells))).folded(place.points, place.normals)
    return Slid(place.points, place.normals, cells, steps, flips, int(np.count_nonzero(folded)))


def _enough(slid: Slid, goal: Goal) -> bool:
    """Whether triangles are as even as they usually are in the template's order."""
    quality = triangle_quality(slid.points, slid.cells)
    whole = volume(goal.surface.points, goal.surface.triangles)
    return (
        slid.folded == 0
        and float(quality.mean()) >= ACCEPTANCE.kept_mean
        and float(quality.min()) >= ACCEPTANCE.kept_least
        and volume(slid.points, slid.cells) >= (1.0 - ACCEPTANCE.cut) * whole
    )
