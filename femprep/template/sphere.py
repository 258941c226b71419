"""Unit vectors in, a meshed unit sphere out: the Template noun and the triangulation of points on a sphere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femprep.errors import InputError, StageError
from femprep.model import FloatArray, Immutable, IntArray, readonly
from femprep.model.functions import sine_cosine


@dataclass(frozen=True, eq=False)
class Template(Immutable):
    """A meshed unit sphere.

    Attributes
    ----------
    directions : (V, 3) array
        Vertices, unit vectors, from the north pole (+z) to the south.
    cells : (T, 3) or (T, 4) array
        Triangles or quadrilaterals, counter-clockwise seen from outside.
    """

    directions: FloatArray
    cells: IntArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "directions", readonly(self.directions, np.float64, (None, 3), "directions"))
        object.__setattr__(self, "cells", readonly(self.cells, np.int64, (None, None), "cells"))


def fibonacci(count: int) -> FloatArray:
    """Points ``(count, 3)`` on a spiral of the golden angle, which covers the unit sphere evenly."""
    if count < 1:
        raise InputError(f"{count} points asked for on a sphere, at least 1 is needed")
    index = np.arange(count)
    z = 1.0 - (2.0 * index + 1.0) / count
    sine, cosine = sine_cosine(index * (np.pi * (3.0 - np.sqrt(5.0))))
    ring = np.sqrt(1.0 - z * z)
    return np.column_stack([ring * cosine, ring * sine, z])


def triangulate(directions: FloatArray) -> IntArray:
    """Delaunay triangulation of points on the unit sphere, which is their convex hull.

    Parameters
    ----------
    directions : (V, 3) array
        Distinct unit vectors, at least 4, not all on one half of the sphere.

    Returns
    -------
    (2 V - 4, 3) array
        Triangles, outward, each starting with its smallest vertex, in lexicographic order.

    Raises
    ------
    StageError
        Points coincide or leave a half of the sphere empty, so that the hull has not 2 V - 4 triangles about the
        centre.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(directions)
    except (QhullError, ValueError) as error:
        raise StageError(f"{len(directions)} points on the sphere have no hull: {str(error).splitlines()[0]}") from None
    cells = hull.simplices.astype(np.int64)
    a, b, c = (directions[cells[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * (a + b + c)).sum(axis=1) < 0.0
    cells[inward] = cells[inward][:, [0, 2, 1]]
    # Euler: a closed triangulated sphere has 2 V - 4 triangles.
    if len(cells) != 2 * len(directions) - 4 or hull.equations[:, 3].max() >= 0.0:
        raise StageError(
            f"the hull of {len(directions)} points on the sphere has {len(cells)} triangles, expected "
            f"{2 * len(directions) - 4} about its centre; points coincide or are spread unevenly"
        )
    turn = (np.argmin(cells, axis=1)[:, None] + np.arange(3)) % 3
    cells = np.take_along_axis(cells, turn, axis=1)
    return np.ascontiguousarray(cells[np.lexsort(cells.T[::-1])])
