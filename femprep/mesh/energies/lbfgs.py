"""Vertices on a smooth surface and ideal triangles in, vertices slid along it to a minimum of their distortion out.

L-BFGS [1]_ in the tangent planes, with the Laplacian of the mesh in place of the identity [2]_: what has to move far,
moves far in the first steps, whatever the number of vertices.

References
----------
.. [1] Nocedal, Updating quasi-Newton matrices with limited storage, Math. Comp. 35, 1980.
   doi:10.1090/S0025-5718-1980-0572855-7
.. [2] Kovalsky, Galun & Lipman, Accelerated quadratic proxy for geometric optimization, ACM Trans. Graph. 35(4), 2016.
   doi:10.1145/2897824.2925920
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple, Protocol

import numpy as np

from femprep.mesh.banded import Banded
from femprep.mesh.energies.distortion import Ideal
from femprep.mesh.patches import PatchSurface
from femprep.mesh.topology import adjacency
from femprep.model import FloatArray, IntArray
from femprep.model.products import inner, length, unit_vectors

#: Pairs of steps and gradients remembered.
_MEMORY: Final = 6
#: Halvings of a step that leads up.
_HALVINGS: Final = 10
#: Share of the distortion by which it has to fall in five steps to go on.
_GAIN: Final = 1e-4
#: Longest move of the first step, in sides.
_FIRST: Final = 0.3
#: Share of the diagonal added to the Laplacian.
_ANCHOR: Final = 1e-3
#: Least share of the ideal area that regularised areas keep.
_FLAT: Final = 1e-2


class Place(NamedTuple):
    """Points of a domain ``(n, 3)``, unit normals there, and how these change with the points ``(n, 3, 3)``."""

    points: FloatArray
    normals: FloatArray
    bend: FloatArray


class Domain(Protocol):
    """What vertices slide on."""

    def __call__(self, points: FloatArray) -> Place:
        """Points ``(n, 3)`` put onto it."""
        ...


def on_sphere(points: FloatArray) -> Place:
    """The unit sphere."""
    there = unit_vectors(points)
    return Place(there, there, np.broadcast_to(np.eye(3), (len(points), 3, 3)))


class OnPatches:
    """A surface of patches; remembers near which of its vertices each point lies."""

    def __init__(self, surface: PatchSurface, near: IntArray | None = None) -> None:
        self._surface = surface
        self._bend = surface.bend()
        self._near = near

    def __call__(self, points: FloatArray) -> Place:
        """Points put onto the surface."""
        there, normals, self._near = self._surface.settle(points, self._near)
        return Place(there, normals, self._bend[self._near])

    @property
    def near(self) -> IntArray:
        """The vertex of the surface nearest to each point."""
        assert self._near is not None, "no points have been put onto the surface yet"
        return self._near


def smoother(cells: IntArray, count: int) -> Callable[[FloatArray], FloatArray]:
    """Solve with the graph Laplacian of triangles or quadrilaterals for right sides ``(count, k)``."""
    from scipy.sparse import diags_array

    joined = 2.0 * adjacency(cells, count)
    degree: FloatArray = np.asarray(joined.sum(axis=1)).ravel()
    return Banded(diags_array(degree * (1.0 + _ANCHOR)) - joined).solve


def descend(
    points: FloatArray,
    domain: Domain,
    ideal: Ideal,
    solve: Callable[[FloatArray], FloatArray],
    size: float,
    steps: int,
) -> tuple[Place, int]:
    """Slide vertices until the distortion falls no more.

    Parameters
    ----------
    points : (n, 3) array
        Vertices near the domain. Folded triangles are unfolded on the way, if possible.
    domain : Domain
        What they slide on.
    ideal : Ideal
        Their triangles.
    solve : callable
        See :func:`smoother`.
    size : float
        What areas count beside shapes.
    steps : int
        At most.

    Returns
    -------
    place : Place
    steps : int
        Taken.
    """
    here = domain(points)
    delta = _delta(ideal, here)
    value, gradient = _tangent(ideal, here, size, delta)
    pairs: list[tuple[FloatArray, FloatArray, float]] = []
    record = [value]
    taken = 0
    while taken < steps:
        taken += 1
        direction = _direction(gradient, here.normals, pairs, solve)
        if inner(direction, gradient) >= 0.0:
            pairs = []
            direction = _direction(gradient, here.normals, pairs, solve)
        if not pairs:
            # No measure of a step's length yet: a part of a side.
            direction *= _FIRST * np.sqrt(ideal.area.mean()) / max(float(np.abs(direction).max()), 1e-300)
        scale = 1.0
        for _ in range(_HALVINGS):
            there = domain(here.points + scale * direction)
            following, slope = _tangent(ideal, there, size, delta)
            if following < value:
                break
            scale *= 0.5
        else:
            if not pairs:
                break
            pairs = []
            continue
        move, change = there.points - here.points, slope - gradient
        curvature = inner(move, change)
        if curvature > 1e-10 * length(move) * length(change):
            pairs = [*pairs[1 - _MEMORY :], (move, change, curvature)]
        here, value, gradient = there, following, slope
        record.append(value)
        if delta > 0.0:
            fresh = _delta(ideal, here)
            if fresh < 0.9 * delta:
                delta, pairs = fresh, []
                value, gradient = _tangent(ideal, here, size, delta)
                record = [value]
        if len(record) > 5 and record[-6] - record[-1] < _GAIN * record[-1]:
            break
    return here, taken


def _delta(ideal: Ideal, place: Place) -> float:
    """As far from the barrier as the worst triangle asks for (Escobar et al.); 0 where none is folded."""
    if np.isfinite(ideal.measure(*place, 0.0)[0]):
        return 0.0
    worst = min(ideal.least(place.points, place.normals), 0.0)
    return float(np.sqrt(_FLAT * (_FLAT - worst))) + 0.02


def _tangent(ideal: Ideal, place: Place, size: float, delta: float) -> tuple[float, FloatArray]:
    value, gradient = ideal.measure(*place, size, delta)
    return value, _project(gradient, place.normals)


def _project(vectors: FloatArray, normals: FloatArray) -> FloatArray:
    return np.asarray(vectors - np.einsum("ij,ij->i", vectors, normals)[:, None] * normals)


def _direction(
    gradient: FloatArray,
    normals: FloatArray,
    pairs: list[tuple[FloatArray, FloatArray, float]],
    solve: Callable[[FloatArray], FloatArray],
) -> FloatArray:
    """The two loops of L-BFGS about a solve with the Laplacian."""
    q = gradient.copy()
    factors = []
    for move, change, curvature in reversed(pairs):
        factor = inner(move, q) / curvature
        factors.append(factor)
        q -= factor * change
    r = solve(q)
    if pairs:
        move, change, curvature = pairs[-1]
        r *= curvature / inner(change, solve(change))
    for (move, change, curvature), factor in zip(pairs, reversed(factors)):
        r += (factor - inner(change, r) / curvature) * move
    return -_project(r, normals)
