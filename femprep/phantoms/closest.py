"""A surface given as a map from the unit sphere, and points, in; the directions of the closest surface points out."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from femprep.model import FloatArray

Map = Callable[[FloatArray], FloatArray]

#: Directions the search starts from; a point within half a sample step of two sheets could take the wrong one.
SAMPLES = 20000


def closest_directions(surface: Map, derivative: Map, points: FloatArray, iterations: int = 30) -> FloatArray:
    """Directions whose surface points lie closest to given points.

    The nearest of many samples, then damped Gauss-Newton steps on the sphere that only ever come closer.

    Parameters
    ----------
    surface : callable
        Points ``(n, 3)`` of unit vectors ``(n, 3)``.
    derivative : callable
        Derivative ``(n, 3, 3)`` of that map, extended to a neighbourhood of the sphere; only tangents are used.
    points : (n, 3) array
        mm.
    iterations : int
        Largest number of steps.

    Returns
    -------
    (n, 3) array
        Unit vectors.
    """
    from scipy.spatial import cKDTree

    samples = fibonacci_sphere(SAMPLES)
    _, nearest = cKDTree(surface(samples)).query(points)
    found = samples[nearest]
    best = np.linalg.norm(surface(found) - points, axis=1)
    damping = np.full(len(points), 1e-3)
    for _ in range(iterations):
        tangents = _tangents(found)
        slope = np.einsum("nij,nkj->nik", derivative(found), tangents)
        miss = points - surface(found)
        matrix = np.einsum("nik,nil->nkl", slope, slope)
        right = np.einsum("nik,ni->nk", slope, miss)
        scale = 0.5 * np.trace(matrix, axis1=1, axis2=2) * damping
        step = np.linalg.solve(matrix + scale[:, None, None] * np.eye(2), right[:, :, None])[:, :, 0]
        trial = found + np.einsum("nk,nkj->nj", step, tangents)
        trial /= np.linalg.norm(trial, axis=1, keepdims=True)
        distance = np.linalg.norm(surface(trial) - points, axis=1)
        closer = distance < best
        found[closer] = trial[closer]
        best[closer] = distance[closer]
        # Gauss-Newton leaves out the surface's curvature; where that makes a step too long, the next one is shorter.
        damping = np.where(closer, np.maximum(damping * 0.2, 1e-9), np.minimum(damping * 8.0, 1e9))
        if np.abs(step).max(initial=0.0) < 1e-13:
            break
    return found


def fibonacci_sphere(count: int) -> FloatArray:
    """Evenly spread unit vectors ``(count, 3)``."""
    number = np.arange(count) + 0.5
    z = 1.0 - 2.0 * number / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * number
    ring = np.sqrt(1.0 - z * z)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)


def _tangents(directions: FloatArray) -> FloatArray:
    """Two orthonormal tangents of the sphere at each direction, ``(n, 2, 3)``."""
    helper = np.eye(3)[np.argmin(np.abs(directions), axis=1)]
    first = np.cross(directions, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(directions, first)], axis=1)
