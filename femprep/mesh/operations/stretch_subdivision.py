"""A smooth surface and a template on it in, a finer mesh of it out: split where the map from the sphere stretches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import edge_table
from femprep.model import FloatArray, IntArray, SphereMap
from femprep.model.products import unit_vectors

#: Rounds of splitting, and the number of vertices at which it ends, in those it began with.
_ROUNDS: Final = 5
_MOST: Final = 4


@dataclass(frozen=True, eq=False)
class Resolved:
    """A mesh of a surface in which no edge is long, with the place of each vertex on the sphere.

    Attributes
    ----------
    directions : (n, 3) array
        Unit vectors.
    points : (n, 3) array
        The surface there, mm LPS. The vertices it was made from come first.
    cells : (m, 3) array
        Triangles.
    """

    directions: FloatArray
    points: FloatArray
    cells: IntArray

    @classmethod
    def of(
        cls, shape: SphereMap, directions: FloatArray, points: FloatArray, cells: IntArray, longest: float
    ) -> Resolved:
        """Split triangles on the sphere until none has a side longer than ``longest`` mm on the surface.

        Parameters
        ----------
        shape : SphereMap
            The surface.
        directions, points : (V, 3) arrays
            Template on the sphere and on the surface.
        cells : (T, 3) array
            Its triangles.
        longest : float
            mm.
        """
        most = _MOST * len(points)
        for _ in range(_ROUNDS):
            table = edge_table(cells)
            ends = table.nodes
            long = np.flatnonzero(np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1) > longest)
            if not len(long) or len(points) + len(long) > most:
                break
            middle = unit_vectors(directions[ends[long]].sum(axis=1))
            number = np.full(len(ends), -1, dtype=np.int64)
            number[long] = len(points) + np.arange(len(long))
            directions = np.concatenate([directions, middle])
            points = np.concatenate([points, shape(middle)])
            cells = _split(cells, number[table.of_cell], points)
        return cls(directions, points, cells)

    def directions_of(self, points: FloatArray) -> FloatArray:
        """Unit vectors ``(q, 3)`` for points ``(q, 3)`` near the surface: linear within each triangle."""
        return unit_vectors(ClosestFinder(self.points, self.cells)(points).at(self.directions))


def _split(cells: IntArray, middle: IntArray, points: FloatArray) -> IntArray:
    """Triangles cut at new vertices ``(m, 3)`` in the middle of their sides, -1 where a side stays whole."""
    count = (middle >= 0).sum(axis=1)
    # One split side comes first; two are the first two; then there are four patterns only.
    turn = np.where(count == 1, np.argmax(middle >= 0, axis=1), np.where(count == 2, np.argmin(middle, axis=1) + 1, 0))
    order = (turn[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(cells, order, axis=1).T
    p, q, r = np.take_along_axis(middle, order, axis=1).T
    whole, one, two, three = (count == k for k in range(4))
    # What two split sides leave is a quadrilateral: cut along its shorter diagonal.
    short = np.linalg.norm(points[a] - points[q], axis=1) < np.linalg.norm(points[p] - points[c], axis=1)
    parts = [
        (whole, a, b, c),
        *((one, a, p, c), (one, p, b, c)),
        *((two, p, b, q), (two & short, a, p, q), (two & short, a, q, c), (two & ~short, a, p, c)),
        *((two & ~short, p, q, c), (three, a, p, r), (three, p, b, q), (three, r, q, c), (three, p, q, r)),
    ]
    return np.concatenate([np.stack([x[chosen], y[chosen], z[chosen]], axis=1) for chosen, x, y, z in parts])
