"""Scores of some classes at points, each point a volume, in; the levels at which each class has its volume, out."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.model import FloatArray, IntArray

_ROUNDS: Final = 3


def classes_of(scores: FloatArray, levels: FloatArray) -> IntArray:
    """The class of each point ``(q,)``: that whose score is most above its level; -1 where none is."""
    above = scores - levels
    best = np.argmax(above, axis=1)
    return np.where(above[np.arange(len(above)), best] > 0.0, best, -1)


def levels_for(scores: FloatArray, volume: FloatArray, wanted: FloatArray, first: float, limit: float) -> FloatArray:
    """Levels at which each class has the volume wanted, as near as ``first`` plus or minus ``limit`` allows.

    Parameters
    ----------
    scores : (q, c) array
    volume : (q,) array
        Of each point.
    wanted : (c,) array
        Of each class.
    first, limit : float
        The level without any correction, and the largest correction.
    """
    count = scores.shape[1]
    levels = np.full(count, first)
    for _ in range(_ROUNDS if count > 1 else 1):
        for k in range(count):
            others = np.delete(scores - levels, k, axis=1).max(axis=1, initial=0.0)
            needed = scores[:, k] - others  # the class has the point where its level is below this
            order = np.argsort(-needed, kind="stable")
            total = np.cumsum(volume[order])
            at = int(np.searchsorted(total, wanted[k] - 0.5 * volume[order][0])) if wanted[k] > 0 else -1
            if at < 0:
                level = first + limit
            elif at + 1 < len(order):
                level = 0.5 * (needed[order[at]] + needed[order[at + 1]])
            else:
                level = needed[order[-1]] - 1e-9
            levels[k] = float(np.clip(level, first - limit, first + limit))
    return levels
