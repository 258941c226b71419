"""A resolution in, a meshed cup or tube out: the connectivity a ventricle's wall is swept from, rim rows included.

A ventricle that ends in a plane is a disk, not a sphere. A cup is meshed in rows from the apex to the base, so that
its last row is the rim: no cell is cut, at any resolution, and one cup serves every phase and every heart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femprep.errors import OptionError
from femprep.model import FloatArray, Immutable, IntArray, readonly
from femprep.model.functions import arctan2, sine_cosine

#: Triangles around the apex of a triangle cup. A hemisphere of equilateral triangles has five corners of valence five
#: around its pole, as half an icosahedron.
SECTORS = 5
#: Radius of the hole of a tube in the plane it is drawn in.
HOLE = 0.4
_NONE = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Cup(Immutable):
    """A meshed disk, or a ring where the apex is clipped.

    Attributes
    ----------
    disk : (V, 2) array
        Vertices in the plane: the apex at the origin, the base on the unit circle, distance from the origin the share
        of the way from apex to base. Numbered row by row from the apex, each row counter-clockwise.
    cells : (T, 3) or (T, 4) array
        Triangles or quadrilaterals, counter-clockwise.
    base : (c,) array
        Vertices of the base rim, counter-clockwise.
    apex : (c,) array
        Vertices of the apex rim, counter-clockwise; empty where the apex is closed.
    columns, rows : int
        Vertices of the base rim; rows of cells of constant width that end there.
    """

    disk: FloatArray
    cells: IntArray
    base: IntArray
    apex: IntArray
    columns: int
    rows: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "disk", readonly(self.disk, np.float64, (None, 2), "disk"))
        object.__setattr__(self, "cells", readonly(self.cells, np.int64, (None, None), "cells"))
        for name in ("base", "apex"):
            object.__setattr__(self, name, readonly(getattr(self, name), np.int64, (None,), f"{name} rim"))

    @property
    def rim(self) -> IntArray:
        """Which plane each vertex has to lie in ``(V,)``: 0 none, 1 base, 2 apex."""
        kind = np.zeros(len(self.disk), dtype=np.int64)
        kind[self.base] = 1
        kind[self.apex] = 2
        return kind


def triangle_cup(columns: int, rows: int) -> Cup:
    """Cup of triangles: five sectors around the apex, then rows of constant width up to the base.

    Parameters
    ----------
    columns : int
        Vertices of the base rim, a multiple of 5, at least 5.
    rows : int
        Rows of triangles between the sectors and the base, at least 1. Sectors have ``columns / 5`` rows.

    Raises
    ------
    OptionError
        A number is out of range.
    """
    _require(columns, rows, SECTORS)
    cap = columns // SECTORS
    total = cap + rows
    disk = [np.zeros((1, 2))]
    cells: list[IntArray] = []
    start = np.zeros(total + 1, dtype=np.int64)
    for row in range(1, total + 1):
        width = SECTORS * min(row, cap)
        start[row] = sum(len(block) for block in disk)
        turn = 0.5 * ((row - cap) % 2) if row > cap else 0.0
        disk.append(_ring(row / total, (np.arange(width) + turn) / width))
    for row in range(cap):
        inner, outer = SECTORS * row, SECTORS * (row + 1)
        for sector in range(SECTORS):
            j = np.arange(row + 1)
            a = start[row] + (sector * row + j) % max(inner, 1)
            b = start[row + 1] + (sector * (row + 1) + j) % outer
            c = start[row + 1] + (sector * (row + 1) + j + 1) % outer
            cells.append(np.stack([a, b, c], axis=1))
            if row:
                cells.append(np.stack([a[:-1], c[:-1], a[1:]], axis=1))
    cells.extend(
        _staggered(start[row], start[row + 1], columns, outward=(row - cap) % 2 == 0) for row in range(cap, total)
    )
    base = start[total] + np.arange(columns)
    return Cup(np.concatenate(disk), np.concatenate(cells), base, _NONE, columns, rows)


def quad_cup(columns: int, rows: int) -> Cup:
    """Cup of quadrilaterals: a square at the apex, then rows of constant width up to the base.

    Five faces of a cube: the apex lies in the middle of one, the base is the edge of the open one.

    Parameters
    ----------
    columns : int
        Vertices of the base rim, a multiple of 4, at least 4. The square has ``columns / 4`` cells along each side.
    rows : int
        Rows of cells between the square and the base, at least 1.

    Raises
    ------
    OptionError
        A number is out of range.
    """
    _require(columns, rows, 4)
    side = columns // 4
    total = 0.5 * side + rows
    grid = np.arange(side + 1) - 0.5 * side
    x, y = (a.ravel() for a in np.meshgrid(grid, grid, indexing="ij"))
    shell = np.maximum(np.abs(x), np.abs(y))
    angle = np.mod(arctan2(y, x) + 0.25 * np.pi, 2.0 * np.pi)
    order = np.lexsort((angle, shell))
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.arange(len(order))
    lattice = number.reshape(side + 1, side + 1)
    square = np.stack(
        [lattice[:-1, :-1].ravel(), lattice[1:, :-1].ravel(), lattice[1:, 1:].ravel(), lattice[:-1, 1:].ravel()], axis=1
    )
    # Corners drawn in, so that the angles there are half-way between the square's and the circle's.
    u, v = (2.0 * a[order] / side for a in (x, y))
    face = (0.5 * side / total) * np.stack([u * (1.0 - 0.15 * v * v), v * (1.0 - 0.15 * u * u)], axis=1)
    ring = len(face) - columns + np.arange(columns)
    radius = np.linalg.norm(face[ring], axis=1)
    turn = np.unwrap(arctan2(face[ring, 1], face[ring, 0]))
    even = turn[0] + 2.0 * np.pi * np.arange(columns) / columns
    blocks, cells, below = [face], [square], ring
    for row in range(1, rows + 1):
        share = row / rows
        at = turn + (even - turn) * share
        r = radius + (1.0 - radius) * share
        sine, cosine = sine_cosine(at)
        blocks.append(np.stack([r * cosine, r * sine], axis=1))
        above = below[-1] + 1 + np.arange(columns)
        cells.append(_straight(below, above))
        below = above
    return Cup(np.concatenate(blocks), np.concatenate(cells), below, _NONE, columns, rows)


def triangle_tube(columns: int, rows: int) -> Cup:
    """Ring of triangles in ``rows`` staggered rows of ``columns`` vertices: a wall clipped at the apex as well."""
    _require(columns, rows, 1)
    disk = [
        _ring(HOLE + (1.0 - HOLE) * row / rows, (np.arange(columns) + 0.5 * (row % 2)) / columns)
        for row in range(rows + 1)
    ]
    cells = [_staggered(row * columns, (row + 1) * columns, columns, outward=row % 2 == 0) for row in range(rows)]
    first = np.arange(columns)
    return Cup(np.concatenate(disk), np.concatenate(cells), rows * columns + first, first, columns, rows)


def quad_tube(columns: int, rows: int) -> Cup:
    """Ring of quadrilaterals in ``rows`` rows of ``columns``: a wall clipped at the apex as well."""
    _require(columns, rows, 1)
    first = np.arange(columns)
    disk = [_ring(HOLE + (1.0 - HOLE) * row / rows, first / columns) for row in range(rows + 1)]
    cells = [_straight(first + row * columns, first + (row + 1) * columns) for row in range(rows)]
    return Cup(np.concatenate(disk), np.concatenate(cells), rows * columns + first, first, columns, rows)


def _require(columns: int, rows: int, multiple: int) -> None:
    least = max(3, multiple)
    if columns < least or columns % multiple:
        raise OptionError(f"a rim of {columns} vertices asked for, expected a multiple of {multiple} from {least} on")
    if rows < 1:
        raise OptionError(f"{rows} rows of cells asked for, expected at least 1")


def _ring(radius: float, turns: FloatArray) -> FloatArray:
    sine, cosine = sine_cosine(2.0 * np.pi * turns)
    return radius * np.stack([cosine, sine], axis=1)


def _staggered(inner: int, outer: int, columns: int, outward: bool) -> IntArray:
    """Triangles between two rows; ``outward``: the outer row is the one turned by half a step."""
    i = np.arange(columns)
    j = (i + 1) % columns
    if outward:
        pair = [(inner + i, outer + i, inner + j), (outer + i, outer + j, inner + j)]
    else:
        pair = [(inner + i, outer + i, outer + j), (inner + i, outer + j, inner + j)]
    return np.stack([np.stack(corners, axis=1) for corners in pair], axis=1).reshape(-1, 3)


def _straight(inner: IntArray, outer: IntArray) -> IntArray:
    """Quadrilaterals between two rows of the same width."""
    return np.stack([inner, outer, np.roll(outer, -1), np.roll(inner, -1)], axis=1)
