"""Normals in, directions across them out: of whole arrays, and of one vertex within a compiled kernel."""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.model import FloatArray
from femprep.model.products import unit_vectors


def tangents(normals: FloatArray) -> FloatArray:
    """Two unit vectors across each unit vector ``(n, 3)``, ``(n, 2, 3)``, right-handed with it; across none, none."""
    axis = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = unit_vectors(np.cross(normals, axis))
    return np.stack([first, np.cross(normals, first)], axis=1)


@compiled(part=True)
def free_directions(normal: Any, on_surface: bool, plane: Any, flat: bool, basis: Any) -> int:
    """Orthonormal directions a point may move in, into rows of ``basis``; returns how many.

    On a surface of that normal, in a plane of that normal, along the curve in which they meet, or anywhere.
    """
    if not on_surface and not flat:
        basis[:] = 0.0
        for k in range(3):
            basis[k, k] = 1.0
        return 3
    across = basis[2]
    for k in range(3):
        across[k] = normal[k] if on_surface else plane[k]
    if on_surface and flat:
        first = basis[0]
        for k in range(3):
            p = (k + 1) % 3
            q = (k + 2) % 3
            first[k] = across[p] * plane[q] - across[q] * plane[p]
        length = np.sqrt(first[0] ** 2 + first[1] ** 2 + first[2] ** 2)
        if length < 1e-9:
            return 0
        for k in range(3):
            first[k] /= length
        return 1
    axis = 0
    if abs(across[1]) < abs(across[axis]):
        axis = 1
    if abs(across[2]) < abs(across[axis]):
        axis = 2
    size = np.sqrt(across[(axis + 1) % 3] ** 2 + across[(axis + 2) % 3] ** 2)
    basis[0, axis] = 0.0
    basis[0, (axis + 1) % 3] = across[(axis + 2) % 3] / size
    basis[0, (axis + 2) % 3] = -across[(axis + 1) % 3] / size
    for k in range(3):
        p = (k + 1) % 3
        q = (k + 2) % 3
        basis[1, k] = across[p] * basis[0, q] - across[q] * basis[0, p]
    return 2
