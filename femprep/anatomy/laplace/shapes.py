"""Element type and reference points in; linear shape functions, their gradients and quadrature rules out."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.mesh.elements import ELEMENTS
from femprep.mesh.measures.sample_points import family, shape_gradients, shape_values
from femprep.model import FloatArray

_G: Final = 1.0 / np.sqrt(3.0)


def shape_functions(name: str, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Values ``(q, p)`` and reference gradients ``(q, p, 3)`` of the linear shape functions of an element type.

    Those of the element with the same corners, on the reference elements of
    :mod:`femprep.mesh.measures.sample_points`.
    """
    linear, at = family(name), np.asarray(points, dtype=float)
    return (
        np.array([shape_values(linear, point) for point in at]),
        np.array([shape_gradients(linear, point) for point in at]),
    )


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
