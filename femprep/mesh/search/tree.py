"""Triangles to a tree of bounding boxes over them, for kernels that search it; the same arrays every time.

The triangles are sorted along a Morton curve and the tree is a complete binary heap over groups of them: node 1 is
the root, node i has the children 2 i and 2 i + 1, the last half of the nodes are the leaves.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.mesh.compiled import compiled
from femprep.model import FloatArray, IntArray

LEAF = 4
_BITS = 21


class BoxTree(NamedTuple):
    """A tree of boxes.

    Attributes
    ----------
    low, high : (2 L, 3) arrays
        Corners of the box of each node; row 0 is not used.
    order : (m,) array
        Triangle numbers, leaf by leaf: leaf i holds ``order[LEAF * i : LEAF * (i + 1)]``.
    """

    low: FloatArray
    high: FloatArray
    order: IntArray


def check_mesh(points: npt.ArrayLike, triangles: npt.ArrayLike) -> tuple[FloatArray, IntArray]:
    """Arrays as the kernels need them.

    Raises
    ------
    InputError
        A wrong shape, a point that is not finite, or a corner number out of range.
    """
    p = np.ascontiguousarray(points, dtype=np.float64)
    t = np.ascontiguousarray(triangles, dtype=np.int64)
    if p.ndim != 2 or p.shape[1] != 3:
        raise InputError(f"points have shape {p.shape}, expected (n, 3)")
    if t.ndim != 2 or t.shape[1] != 3:
        raise InputError(f"triangles have shape {t.shape}, expected (m, 3)")
    if not np.isfinite(p).all():
        row = int(np.argmin(np.isfinite(p).all(axis=1)))
        raise InputError(f"point {row} is {p[row].tolist()}, expected finite coordinates")
    if t.size and (t.min() < 0 or t.max() >= len(p)):
        raise InputError(f"triangles name points {t.min()} to {t.max()}, but there are {len(p)} points")
    return p, t


def build_tree(points: FloatArray, triangles: IntArray) -> BoxTree:
    """Build the tree over triangles ``(m, 3)``; m is at least 1."""
    box = points[triangles]
    order = curve_order(0.5 * (box.min(axis=1) + box.max(axis=1)))
    leaves = 1 << max(0, int(np.ceil(np.log2(-(-len(triangles) // LEAF)))))
    low = np.full((2 * leaves, 3), np.inf)
    high = np.full((2 * leaves, 3), -np.inf)
    _fit(low, high, box, order)
    return BoxTree(low, high, order)


def curve_order(places: FloatArray) -> IntArray:
    """Order of places ``(m, 3)`` along a Morton curve, on which what is near in space is mostly near."""
    start = places.min(axis=0)
    extent = float((places.max(axis=0) - start).max()) or 1.0
    cell = np.minimum((places - start) / extent * 2**_BITS, 2**_BITS - 1).astype(np.uint64)
    return np.argsort(_morton(cell), kind="stable").astype(np.int64)


def _morton(cell: npt.NDArray[np.uint64]) -> npt.NDArray[np.uint64]:
    """Interleave the bits of three 21-bit coordinates, ``(m, 3)`` to ``(m,)``."""
    code = cell.T.copy()
    for shift, mask in (
        (32, 0x001F00000000FFFF),
        (16, 0x001F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        code = (code | (code << np.uint64(shift))) & np.uint64(mask)
    return code[0] | (code[1] << np.uint64(1)) | (code[2] << np.uint64(2))


@compiled()
def _fit(low: FloatArray, high: FloatArray, box: FloatArray, order: IntArray) -> None:
    """Fill the boxes: the leaves from their triangles, then each node from its two children."""
    leaves = len(low) // 2
    for i in range(len(order)):
        node = leaves + i // LEAF
        for corner in range(3):
            for k in range(3):
                value = box[order[i], corner, k]
                low[node, k] = min(low[node, k], value)
                high[node, k] = max(high[node, k], value)
    for node in range(leaves - 1, 0, -1):
        for k in range(3):
            low[node, k] = min(low[2 * node, k], low[2 * node + 1, k])
            high[node, k] = max(high[2 * node, k], high[2 * node + 1, k])


@compiled(inner=True)
def box_distance(q: FloatArray, low: FloatArray, high: FloatArray, node: int) -> float:
    """Squared distance of a point from a box of the tree."""
    total = 0.0
    for k in range(3):
        gap = max(low[node, k] - q[k], q[k] - high[node, k], 0.0)
        total += gap * gap
    return total


@compiled(inner=True, part=True)
def next_leaf(
    q: FloatArray, low: FloatArray, high: FloatArray, best: float, stack: IntArray, bound: FloatArray, depth: int
) -> tuple[int, int]:
    """Take boxes from a stack, nearer ones first, as far as a leaf that may hold what is nearer than the best.

    ``bound`` holds how far each box on the stack is from the point. Return the leaf's number, -1 where none is left,
    and the depth of the stack.
    """
    leaves = len(low) // 2
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if bound[depth] > best:
            continue
        if node >= leaves:
            return node - leaves, depth
        left, right = 2 * node, 2 * node + 1
        left_gap, right_gap = box_distance(q, low, high, left), box_distance(q, low, high, right)
        if left_gap < right_gap:
            left, right, left_gap, right_gap = right, left, right_gap, left_gap
        if left_gap <= best:
            stack[depth], bound[depth] = left, left_gap
            depth += 1
        if right_gap <= best:
            stack[depth], bound[depth] = right, right_gap
            depth += 1
    return -1, 0
