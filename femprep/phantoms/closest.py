"""A surface given as a map from the unit sphere, and points, in; the directions of the closest surface points out."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from femprep.mesh.tangents import tangents
from femprep.model import FloatArray
from femprep.model.products import unit_vectors

Map = Callable[[FloatArray], FloatArray]

#: Directions the search starts from; a point within half a sample step of two sheets could take the wrong one.
SAMPLES = 20000


def closest_directions(surface: Map, derivative: Map, points: FloatArray, iterations: int = 30) -> FloatArray:
    """Directions whose surface points lie closest to given points.

    The nearest of many samples, then damped Newton steps on the sphere that only ever come closer.

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
    damping = np.full(len(points), 1e-6)
    for _ in range(iterations):
        across = tangents(found)
        gradient = _gradient(surface, derivative, points, found, across, np.zeros(2))
        columns = [
            _gradient(surface, derivative, points, found, across, step)
            - _gradient(surface, derivative, points, found, across, -step)
            for step in 1e-5 * np.eye(2)
        ]
        hessian = np.stack(columns, axis=2) / 2e-5
        hessian = 0.5 * (hessian + hessian.transpose(0, 2, 1))
        # Where the distance is not convex, and where a step went too far, the Hessian is shifted towards descent.
        size = np.abs(hessian).max(axis=(1, 2))
        shift = np.maximum(0.0, 1e-3 * size - np.linalg.eigvalsh(hessian)[:, 0]) + damping * size
        matrix = hessian + shift[:, None, None] * np.eye(2)
        step = -np.linalg.solve(matrix, gradient[:, :, None])[:, :, 0]
        trial = _moved(found, across, step)
        distance = np.linalg.norm(surface(trial) - points, axis=1)
        closer = distance < best
        found[closer] = trial[closer]
        best[closer] = distance[closer]
        damping = np.where(closer, np.maximum(damping * 0.1, 1e-12), np.minimum(damping * 10.0, 1e9))
        if np.abs(step).max(initial=0.0) < 1e-12:
            break
    return found


def _moved(directions: FloatArray, tangents: FloatArray, step: FloatArray) -> FloatArray:
    """Directions after a step ``(n, 2)`` along their tangents."""
    return unit_vectors(directions + np.einsum("nk,nkj->nj", step, tangents))


def _gradient(
    surface: Map, derivative: Map, points: FloatArray, directions: FloatArray, tangents: FloatArray, step: FloatArray
) -> FloatArray:
    """Gradient ``(n, 2)`` of half the squared distance in tangent coordinates, at a step from each direction."""
    raw = directions + step @ tangents
    length = np.linalg.norm(raw, axis=1)
    moved = raw / length[:, None]
    ambient = np.einsum("nij,ni->nj", derivative(moved), surface(moved) - points)
    # Derivative of the normalisation: what points along the direction does not move it.
    ambient -= np.einsum("nj,nj->n", ambient, moved)[:, None] * moved
    return np.asarray(np.einsum("nkj,nj->nk", tangents, ambient) / length[:, None])


def fibonacci_sphere(count: int) -> FloatArray:
    """Evenly spread unit vectors ``(count, 3)``."""
    number = np.arange(count) + 0.5
    z = 1.0 - 2.0 * number / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * number
    ring = np.sqrt(1.0 - z * z)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1)
