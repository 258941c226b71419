"""Element type and reference points in; linear shape functions, their gradients and quadrature rules out."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.mesh.elements import ELEMENTS
from femprep.model import FloatArray

_G: Final = 1.0 / np.sqrt(3.0)


def shape_functions(name: str, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values ``(q, p)`` and reference gradients ``(q, p, 3)`` of the linear shape functions of an element type.

    Reference elements: tetrahedron and wedge over the triangle r, s >= 0, r + s <= 1 (the tetrahedron with t >= 0 and
    r + s + t <= 1, the wedge with -1 <= t <= 1), hexahedron over [-1, 1]^3.
    """
    at = np.asarray(points, dtype=float)
    r, s, t = at[:, 0], at[:, 1], at[:, 2]
    corners = ELEMENTS[name].corners
    if corners == 4:
        value = np.stack([1 - r - s - t, r, s, t], axis=1)
        grad = np.broadcast_to(np.array([[-1.0, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), (len(r), 4, 3)).copy()
        return value, grad
    if corners == 6:
        triangle = np.stack([1 - r - s, r, s], axis=1)
        low, high = (1 - t)[:, None] / 2, (1 + t)[:, None] / 2
        value = np.concatenate([triangle * low, triangle * high], axis=1)
        slope = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
        grad = np.zeros((len(r), 6, 3))
        grad[:, :3, :2], grad[:, 3:, :2] = slope * low[:, :, None], slope * high[:, :, None]
        grad[:, :3, 2], grad[:, 3:, 2] = -triangle / 2, triangle / 2
        return value, grad
    ring = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    corner = np.array([[*pair, level] for level in (-1, 1) for pair in ring])
    factor = 1 + at[:, None, :] * corner  # (q, 8, 3)
    value = factor.prod(axis=2) / 8
    grad = np.stack([corner[:, i] * factor[:, :, i - 2] * factor[:, :, i - 1] for i in range(3)], axis=2) / 8
    return value, grad


def quadrature(name: str) -> tuple[FloatArray, FloatArray]:
    """Points ``(q, 3)`` and weights ``(q,)`` that integrate the stiffness of an undistorted element exactly."""
    corners = ELEMENTS[name].corners
    if corners == 4:
        return np.full((1, 3), 0.25), np.array([1 / 6])
    if corners == 6:
        triangle = np.array([[1, 1], [4, 1], [1, 4]]) / 6
        points = np.array([[r, s, t] for t in (-_G, _G) for r, s in triangle])
        return points, np.full(6, 1 / 6)
    points = np.array([[r, s, t] for t in (-_G, _G) for s in (-_G, _G) for r in (-_G, _G)])
    return points, np.ones(8)


def centre(name: str) -> FloatArray:
    """Reference point ``(1, 3)`` of an element's centre."""
    return {4: np.full((1, 3), 0.25), 6: np.array([[1 / 3, 1 / 3, 0.0]]), 8: np.zeros((1, 3))}[ELEMENTS[name].corners]
