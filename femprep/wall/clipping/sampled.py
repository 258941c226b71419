"""Template samples of a surface in, a smooth map of the sphere out: cheap positions between the vertices of a template.

Sliding vertices along a surface asks for hundreds of small trial moves, each of which would send vertices through the
whole flow of the fitted surface. Between its vertices, a few millimetres apart, the surface is given by its second
order Taylor expansion to some hundredths of a millimetre: trial moves are made on that, and only the final
directions are sent through the exact map.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from femprep.mesh.tangents import tangents
from femprep.model import FloatArray, IntArray
from femprep.model.products import solve_definite, unit_vectors

#: Samples each local expansion is fitted to (two rings of a triangulation), and expansions blended at a point.
_FITTED = 18
_BLENDED = 7


class SampledMap:
    """Smooth map from the unit sphere to a surface, through samples of it.

    A quadratic is fitted at each sample in its tangent plane of the sphere and exact at the sample; between samples
    the nearest quadratics are blended by inverse distance weights that vanish at the distance of the outermost (the
    modified Shepard method of Franke & Nielson 1980, doi 10.1002/nme.1620151110). Error of third order in the sample
    distance.

    Parameters
    ----------
    directions : (n, 3) array
        Unit vectors, n >= 8.
    points : (n, 3) array
        Points of the surface there, mm.
    """

    def __init__(self, directions: npt.ArrayLike, points: npt.ArrayLike) -> None:
        self.directions = np.asarray(directions, dtype=np.float64)
        self.points = np.asarray(points, dtype=np.float64)
        self._tree = cKDTree(self.directions)
        self._frame = tangents(self.directions)
        fitted = min(_FITTED, len(self.points) - 1)
        near = self._nearest(self.directions, fitted + 1)[1][:, 1:]
        local = self._local(np.arange(len(self.points))[:, None], self.directions[near])
        terms = _quadratic_terms(local)
        rise = self.points[near] - self.points[:, None, :]
        # Weights fall with distance, so that the expansion is best where it is used; scaled for the solve.
        size = np.sqrt((local**2).sum(-1).mean(-1))[:, None]
        weight = 1.0 / (0.25 + ((local**2).sum(-1) / size**2))
        scale = np.stack([size[:, 0]] * 2 + [size[:, 0] ** 2] * 3, axis=-1)
        design = terms / scale[:, None, :]
        normal = np.einsum("nki,nk,nkj->nij", design, weight, design)
        normal += 1e-9 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(5)
        right = np.einsum("nki,nk,nkc->nic", design, weight, rise)
        self._coefficients: FloatArray = solve_definite(normal, right) / scale[:, :, None]

    def _nearest(self, directions: FloatArray, count: int) -> tuple[FloatArray, IntArray]:
        """Distances and numbers ``(n, count)`` of the nearest samples, nearest first."""
        distance, near = self._tree.query(directions, k=np.arange(1, count + 1))
        return np.asarray(distance, dtype=np.float64), np.asarray(near, dtype=np.int64)

    def _local(self, sample: IntArray, directions: FloatArray) -> FloatArray:
        """Coordinates of directions ``(..., 3)`` in the tangent plane of samples, projected from the centre."""
        centre = self.directions[sample]
        along = np.einsum("...c,...c->...", directions, centre)
        flat = directions / np.maximum(along, 0.1)[..., None]
        frame = self._frame[np.broadcast_to(sample, along.shape)]
        return np.asarray(np.einsum("...ac,...c->...a", frame, flat))

    def __call__(self, directions: npt.ArrayLike) -> FloatArray:
        """Points of the surface ``(n, 3)``, mm, for unit vectors ``(n, 3)``."""
        there = np.asarray(directions, dtype=np.float64)
        blended = min(_BLENDED, len(self.points) - 1)
        distance, near = self._nearest(there, blended + 1)
        reach = distance[:, -1:]
        distance, near = distance[:, :-1], near[:, :-1]
        # The floor keeps the weight of a sample that is hit exactly finite; it still outweighs all others.
        weight = ((reach - distance) / (reach * np.maximum(distance, 1e-9 * reach))) ** 2
        weight /= weight.sum(axis=1, keepdims=True)
        terms = _quadratic_terms(self._local(near, there[:, None, :]))
        value = self.points[near] + np.einsum("nkt,nktc->nkc", terms, self._coefficients[near])
        return np.asarray(np.einsum("nk,nkc->nc", weight, value))

    def tangents(self, directions: FloatArray) -> FloatArray:
        """Tangent vectors ``(n, 2, 3)``: derivatives by the coordinates around the nearest sample."""
        return self._tangents(directions)[0]

    def step(self, directions: FloatArray, displacement: FloatArray) -> FloatArray:
        """Directions whose points lie displaced by vectors ``(n, 3)`` mm, to first order, along the surface only."""
        tangent, near, local = self._tangents(directions)
        gram = np.einsum("nac,nbc->nab", tangent, tangent)
        gram += 1e-12 * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.eye(2)
        move = solve_definite(gram, np.einsum("nac,nc->na", tangent, displacement)[..., None])[..., 0]
        return unit_vectors(self.directions[near] + np.einsum("na,nac->nc", local + move, self._frame[near]))

    def _tangents(self, directions: FloatArray) -> tuple[FloatArray, IntArray, FloatArray]:
        near = self._nearest(directions, 1)[1][:, 0]
        local = self._local(near, directions)
        c, (x, y) = self._coefficients[near], local.T[..., None]
        along_x = c[:, 0] + 2.0 * x * c[:, 2] + y * c[:, 3]
        along_y = c[:, 1] + x * c[:, 3] + 2.0 * y * c[:, 4]
        return np.stack([along_x, along_y], axis=1), near, local


def _quadratic_terms(local: FloatArray) -> FloatArray:
    """The terms x, y, x^2, xy, y^2."""
    x, y = local[..., 0], local[..., 1]
    return np.stack([x, y, x * x, x * y, y * y], axis=-1)
