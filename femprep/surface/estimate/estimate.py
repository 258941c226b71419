"""A LabelObject and a rough mesh of it in, the smooth surface its labels most likely come from out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np

from femprep.mesh.banded import Banded
from femprep.mesh.curvature import Curvature
from femprep.mesh.measures.triangles import vertex_sums
from femprep.mesh.operations.midpoint_subdivision import midpoint_subdivision
from femprep.mesh.operations.step_back import step_uncrossed
from femprep.mesh.operations.tangential_smoothing import smooth_tangentially
from femprep.mesh.patches import PatchSurface
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.search.intersection import self_intersections
from femprep.model import FloatArray, IntArray
from femprep.model.functions import exponential, logarithm
from femprep.model.products import inner, unit_vectors
from femprep.surface.estimate.observations import Observations, ViewObservations

#: Old vertices, new ones and triangles to where the vertices go.
Step = Callable[[FloatArray, FloatArray, IntArray], FloatArray]

#: Weight of the change of curvature against the labels, mm^4, in the first rounds on the mesh given: stiff at first.
_STIFF: Final = (30000.0, 10000.0, 3000.0)
#: The same in the first of the rounds that spare edges; from then on the data choose it.
_FIRST: Final = 1000.0
#: Rounds that spare edges, on the mesh given and then on one with four times as many triangles.
_ROUNDS: Final = (3, 2)
#: Neighbouring faces err alike, so that labels tell less than their number says: the chosen weight is this many times
#: the one that would be most likely if they did not. It lies between these, mm^4.
_ALIKE: Final = 4.0
_SOFTEST, _STIFFEST = 300.0, 100000.0
#: Random signs from which the number of parameters that the labels determine is estimated.
_PROBES: Final = 6
#: Curvature may change by this, 1/mm2, before an edge is taken for one, and the least weight of triangles there.
_USUAL: Final = 0.005
_LEAST: Final = 0.005
#: On the mesh given no more faces are looked at than this many for each vertex.
_FACES: Final = 3
#: A vertex moves no farther than this in one round, mm.
_STEP: Final = 2.0
#: Rings of vertices that are held back with one that would, each by this power of the share of the one before.
_RINGS: Final = 8
_SOFT: Final = 0.8
#: A voxel centre on the wrong side of the surface counts by its distance over this, mm.
_WRONG: Final = 0.4
#: Weight of faces between slices, which interpolation puts closer than to half a voxel, and of those at the ends, of
#: which nothing more is known.
_BETWEEN: Final = (3.0, 0.1)
#: Least squared cosine between a face's axis and the surface's normal: what the surface bends within half a voxel is
#: not known.
_OBLIQUE: Final = 0.02
#: Weight of outlines in views, which cross all slices; standard deviation of a view's place, mm, and across its plane
#: in shares of its thickness.
_SEEN: Final = 4.0
_PLACED, _SLAB = 0.2, 0.1
#: Principal curvatures are not followed beyond this, 1/mm.
_SHARPEST: Final = 0.2
#: Nor across a view, for what its thickness hides: a narrower bend is none any more within the slice.
_NARROW: Final = 0.07
#: Passes of spreading vertices along the surface after each round.
_SPREAD: Final = 5


def estimate_surface(
    points: FloatArray, triangles: IntArray, observations: Observations, rounds: int = _ROUNDS[1]
) -> PatchSurface:
    """Bend a rough mesh to the surface the labels most likely come from.

    Sought is the surface whose mean curvature varies least (the integral of its squared gradient) and that passes the
    voxel faces at the boundary within what they leave open; where curvature changes sharply, as at the rim of a valve,
    change counts less. A face tells the surface's place along its own axis only, to half a voxel; across the surface
    that is less the more oblique it is, so that a step in a slice's outline is known much better than a straight run
    along the pixels; a face between slices lies where interpolation between the outlines puts it. Voxel centres must
    lie on their own side. The surface bends to a minimum by Gauss and Newton: in each round the vertices move along
    their normals by what solves a sparse linear system.

    How much change of curvature counts against the labels is chosen from the data: the weight under which these
    labels are most likely [1]_ [2]_, so that a smooth body stays smooth and a heart with rims and stubs keeps them.

    Parameters
    ----------
    points : (n, 3) array
        Vertices of a closed mesh near the object's surface, in the coordinates of the observations, mm.
    triangles : (m, 3) array
        Wound outward.
    observations : Observations
        What the labels say.
    rounds : int
        Rounds in the end, on a mesh with four times as many triangles. Narrow horns take more than usual.

    Returns
    -------
    PatchSurface
        The surface, in the coordinates of the observations.

    References
    ----------
    .. [1] Wahba, A comparison of GCV and GML for choosing the smoothing parameter in the generalized spline smoothing
       problem, Annals of Statistics 13(4), 1985. doi:10.1214/aos/1176349743
    .. [2] MacKay, Bayesian interpolation, Neural Computation 4(3), 1992. doi:10.1162/neco.1992.4.3.415
    """
    points = np.array(points, dtype=np.float64)
    part = observations.thinned(_FACES * len(points))

    def first(step: Step) -> Bent:
        return _coarse(points, triangles, part, step)

    coarse = _free_or_uncrossed(first)

    def second(step: Step) -> Bent:
        return _fine(coarse, observations, step, rounds)

    fine = _free_or_uncrossed(second)
    return PatchSurface(fine.points, fine.triangles)


class Bent(NamedTuple):
    """Vertices and triangles of a bent mesh, and the stiffness the data ask for."""

    points: FloatArray
    triangles: IntArray
    stiffness: float


def _free_or_uncrossed(bend: Callable[[Step], Bent]) -> Bent:
    """Bend with steps as they come, which is quicker; where triangles cross in the end, with steps that let none."""
    bent = bend(lambda old, new, cells: new)
    return bend(step_uncrossed) if len(self_intersections(bent.points, bent.triangles)) else bent


def _coarse(points: FloatArray, triangles: IntArray, observations: Observations, step: Step) -> Bent:
    """The rounds on the mesh given; each way from old to new vertices goes by ``step``."""
    for stiffness in _STIFF:
        points = step(points, smooth_tangentially(points, triangles, _SPREAD), triangles)
        move = _bend(points, triangles, observations, stiffness, False)[0]
        points = step(points, points + move, triangles)
    return _sparing(Bent(points, triangles, _FIRST), observations, step, _ROUNDS[0])


def _fine(bent: Bent, observations: Observations, step: Step, rounds: int) -> Bent:
    """The rounds on a mesh with four times as many triangles."""
    straight, curved, triangles = midpoint_subdivision(bent.points, bent.triangles)
    points = step(straight, curved, triangles)
    return _sparing(Bent(points, triangles, bent.stiffness), observations, step, rounds)


def _sparing(bent: Bent, observations: Observations, step: Step, rounds: int) -> Bent:
    """Rounds that spare sharp edges."""
    points, triangles, stiffness = bent
    for _ in range(rounds):
        points = step(points, smooth_tangentially(points, triangles, _SPREAD), triangles)
        move, likely = _bend(points, triangles, observations, stiffness, True)
        points = step(points, points + move, triangles)
        stiffness = float(np.clip(likely, _SOFTEST, _STIFFEST))
    return Bent(points, triangles, stiffness)


def _bend(
    points: FloatArray, triangles: IntArray, observations: Observations, stiffness: float, edges: bool
) -> tuple[FloatArray, float]:
    """One round: moves ``(n, 3)`` of the vertices along their normals, mm, and the stiffness that the data ask for.

    Sharp edges are spared or not; where not, the stiffness is the one given.
    """
    shape = Curvature.of(points, triangles, _SHARPEST)
    finder = ClosestFinder(points, triangles)
    faces = _Feet.of(observations.faces, finder, shape.normals)
    centres = _Feet.of(observations.centres, finder, shape.normals)
    along = faces.normal[np.arange(len(faces.normal)), observations.axis] ** 2
    share = np.where(observations.end, _BETWEEN[1], np.where(observations.between, _BETWEEN[0], 1.0))
    # Even over the voxel: variance of a twelfth.
    weight = observations.count * share * 12.0 / (observations.spacing**2 * (along + _OBLIQUE))
    wrong = np.where((centres.height < 0.0) == observations.outside, observations.count / _WRONG**2, 0.0)
    matrix, right = faces.normal_equations(weight, len(points))
    more, also = centres.normal_equations(wrong, len(points))
    labels = matrix + more
    if observations.seen is not None:
        seen, pull = _seen(observations.seen, finder, shape, points, triangles)
        labels, right = labels + seen, right + pull
    bent = shape.lenient(_USUAL, _LEAST) if edges else shape.stiffness
    energy = shape.change.T @ bent @ shape.change
    slope = shape.change.T @ (bent @ shape.mean)
    solver = Banded(labels + stiffness * energy)
    move = solver.solve(right + also - stiffness * slope)
    moves = np.asarray((move * held_back(move, triangles))[:, None] * shape.normals)
    if not edges:
        return moves, stiffness
    mean = shape.mean + shape.change @ move
    chosen = _ALIKE * _determined(solver, labels) / inner(mean, bent @ mean)
    return moves, chosen


def _seen(
    seen: ViewObservations, finder: ClosestFinder, shape: Curvature, points: FloatArray, triangles: IntArray
) -> tuple[Any, FloatArray]:
    """Matrix and right side of the least squares fit of vertex moves to what views show.

    A view tells the surface's place to a pixel across its own outline. Where it cuts the surface aslant, its place
    across its own plane and what the surface bends within its thickness count as well. Where it cuts a surface of
    curvature k across the plane (1/mm) straight, its outline is moved outward by k t^2 / 32, t being the thickness.
    """
    feet = _Feet.of(seen.faces, finder, shape.normals)
    along = np.einsum("qk,qk->q", feet.normal, seen.across)
    aslant = np.einsum("qk,qk->q", feet.normal, seen.plane)
    # A pixel shows what fills half of the slice's thickness. The outline of a convex surface therefore lies inside of
    # where the middle plane cuts it, unless the plane is so oblique that the surface is highest outside of that half.
    corner = np.einsum("qcij,qi,qj->qc", PatchSurface(points, triangles).bend()[feet.corners], seen.plane, seen.plane)
    bend = np.clip((feet.weights * corner).sum(axis=1), -_NARROW, _NARROW)
    highest = aslant / np.where(np.abs(bend * along) > 1e-6, bend * along, 1e-6)
    lift = 0.5 * bend * np.maximum(seen.thickness**2 / 16.0 - highest**2, 0.0)
    feet = replace(feet, height=feet.height + lift)
    variance = seen.spacing**2 * (along**2 + _OBLIQUE) / 12.0 + _PLACED**2 + (_SLAB * seen.thickness * aslant) ** 2
    # An outline that faces the other way belongs to another part of the surface, as across a thin crescent.
    return feet.normal_equations(np.where(along > 0.0, _SEEN * seen.count / variance, 0.0), len(points))


def _determined(solver: Banded, labels: Any) -> float:
    """How many of the vertices' moves the labels determine rather than the stiffness: the trace of (whole)^-1 labels.

    Estimated from random signs [1]_, the same ones every time.

    References
    ----------
    .. [1] Hutchinson, A stochastic estimator of the trace of the influence matrix for Laplacian smoothing splines,
       Communications in Statistics 19(2), 1990. doi:10.1080/03610919008812866
    """
    signs = np.random.default_rng(0).choice([-1.0, 1.0], size=(labels.shape[0], _PROBES))
    return inner(signs, solver.solve(labels @ signs)) / _PROBES


def held_back(move: FloatArray, triangles: IntArray) -> FloatArray:
    """Share ``(n,)`` of their moves that vertices make so that none goes too far; it changes little between neighbours.

    Moves cut off one by one would dent the surface.
    """
    share = np.minimum(1.0, _STEP / np.maximum(np.abs(move), _STEP))
    for _ in range(_RINGS):
        least = share[triangles].min(axis=1)
        np.minimum.at(
            share, triangles, np.broadcast_to(exponential(_SOFT * logarithm(least))[:, None], triangles.shape)
        )
    return share


@dataclass(frozen=True, eq=False)
class _Feet:
    """Points and the closest ones of a mesh: corners and weights of these, unit normals, heights over the mesh."""

    corners: IntArray
    weights: FloatArray
    normal: FloatArray
    height: FloatArray

    @classmethod
    def of(cls, queries: FloatArray, finder: ClosestFinder, normals: FloatArray) -> _Feet:
        found = finder(queries)
        normal = unit_vectors(found.at(normals))
        return cls(found.nodes, found.weights, normal, np.einsum("qk,qk->q", queries - found.points, normal))

    def normal_equations(self, weight: FloatArray, count: int) -> tuple[Any, FloatArray]:
        """Matrix and right side of the weighted least squares fit of vertex moves to the heights."""
        from scipy.sparse import coo_matrix

        value = weight[:, None, None] * self.weights[:, :, None] * self.weights[:, None, :]
        row, column = (
            np.broadcast_to(c, value.shape).ravel() for c in (self.corners[:, :, None], self.corners[:, None])
        )
        matrix = coo_matrix((value.ravel(), (row, column)), shape=(count, count)).tocsr()
        pull = (weight * self.height)[:, None] * self.weights
        return matrix, vertex_sums(pull, self.corners, count)
