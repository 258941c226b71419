"""The space of a heart's cavities in, its chambers out: parted where it is narrowest.

Chambers that are open to each other by a valve are one piece of space. It is cut in two by the sweep over the second
eigenvector of its graph Laplacian (the spectral approximation of the cut that is least for the smaller part [1]_), as
long as the cut is small for what it cuts off.

References
----------
.. [1] Shi & Malik, Normalized cuts and image segmentation, IEEE TPAMI 22(8), 2000. doi:10.1109/34.868688
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.ndimage import label
from scipy.sparse import coo_array, csc_array, identity
from scipy.sparse.linalg import eigsh

from femprep.annotation.space import Space
from femprep.mesh.blas import one_blas_thread
from femprep.model import IntArray

#: Space narrower than twice this is no part of a chamber's core, mm; cores smaller than this are none, mL.
_CORE, _LEAST = 4.5, 6.0
#: Steps of the grid on which space is parted, mm, at least.
_STEP: Final = 2.5
#: A cut's area over the smaller part's volume to the power 2/3: 1.9 halves a ball; a valve is less than this.
_NARROW: Final = 0.65
#: Chambers, and vessels that are closed, at most.
_PARTS: Final = 7


@one_blas_thread()
def part_cavities(space: Space) -> IntArray:
    """Number from 1 of the chamber that each voxel of a core belongs to, 0 elsewhere."""
    core = ~space.tissue & ~space.outside & (space.width >= _CORE)
    skip = max(1, round(_STEP / space.step))
    coarse = core[::skip, ::skip, ::skip]
    size = (space.step * skip) ** 3 / 1e3
    pieces, count = label(coarse)
    sizes = np.bincount(pieces.ravel(), minlength=count + 1)[1:] * size
    todo = [np.argwhere(pieces == k + 1) for k in np.argsort(-sizes) if sizes[k] >= _LEAST]
    done: list[np.ndarray] = []
    while todo:
        own = todo.pop(0)
        halves, ratio = _halve(own, space.step * skip)
        if halves is not None and ratio < _NARROW and len(todo) + len(done) + 2 <= _PARTS:
            todo = sorted([*todo, *halves], key=len, reverse=True)
        else:
            done.append(own)
    done.sort(key=len, reverse=True)
    number = np.zeros(coarse.shape, dtype=np.int64)
    for k, own in enumerate(done):
        number[tuple(own.T)] = k + 1
    fine = number.repeat(skip, 0).repeat(skip, 1).repeat(skip, 2)[tuple(slice(0, n) for n in core.shape)]
    return np.where(core, fine, 0)


def _halve(index: np.ndarray, step: float) -> tuple[list[np.ndarray] | None, float]:
    """Two parts of some voxels, by the cut that is least for the smaller one, and its ratio."""
    least = int(_LEAST * 1e3 / step**3)
    count = len(index)
    if count < 2 * least or count < 20:
        return None, np.inf
    shape = index.max(axis=0) + 2
    number = np.full(shape, -1)
    number[tuple(index.T)] = np.arange(count)
    ends = []
    for axis in range(3):
        beyond = index.copy()
        beyond[:, axis] += 1
        other = number[tuple(beyond.T)]
        ends.append(np.column_stack([np.arange(count), other])[other >= 0])
    a, b = np.concatenate(ends).T
    ones = np.ones(2 * len(a))
    graph = csc_array(coo_array((ones, (np.r_[a, b], np.r_[b, a])), shape=(count, count)))
    laplacian = csc_array(coo_array((graph.sum(axis=0), (np.arange(count),) * 2), shape=(count, count)) - graph)
    start = index[:, int(np.argmax(np.ptp(index, axis=0)))].astype(np.float64)
    vector = eigsh(laplacian + 1e-6 * identity(count), k=2, sigma=0.0, which="LM", v0=start - start.mean())[1]
    by = vector[:, 1] if np.ptp(vector[:, 0]) < np.ptp(vector[:, 1]) else vector[:, 0]
    order = np.argsort(by, kind="stable")
    place = np.empty(count, dtype=np.int64)
    place[order] = np.arange(count)
    low, high = np.minimum(place[a], place[b]), np.maximum(place[a], place[b])
    crossing = np.cumsum(np.bincount(low, minlength=count) - np.bincount(high, minlength=count))
    taken = np.arange(1, count + 1)
    smaller = np.minimum(taken, count - taken).astype(np.float64)
    # Faces of voxels count about half as much again as the plane they follow.
    ratio = crossing / 1.5 / np.maximum(smaller, 1.0) ** (2.0 / 3.0)
    ratio[(taken < least) | (count - taken < least)] = np.inf
    at = int(np.argmin(ratio))
    if not np.isfinite(ratio[at]):
        return None, np.inf
    return [index[order[: at + 1]], index[order[at + 1 :]]], float(ratio[at])
