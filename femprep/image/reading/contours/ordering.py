"""Points of an outline in pieces, in, and in order along one line, out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from femprep.model import FloatArray

#: Neighbours that lie farther apart than so many usual steps are no neighbours on the outline.
_JUMP: Final = 3.0
#: A turn has to shorten the line by so much, mm: rounding must not turn it back and forth.
_GAIN: Final = 1e-6


def in_order(pieces: Sequence[FloatArray]) -> tuple[FloatArray, bool]:
    """Join pieces of an outline, each of one or several stretches in order, to one line.

    Stretches are joined at their nearest ends; then parts of the line are turned round as long as that shortens it
    (2-opt), so that it does not cross itself.

    Parameters
    ----------
    pieces : sequence of (n, 3) arrays
        Points, mm. Where a piece jumps, it is cut.

    Returns
    -------
    points : (N, 3) array
        In order; the widest gap lies between the last one and the first.
    closed : bool
        Whether these are as near to each other as neighbours are.
    """
    every = np.concatenate(pieces)
    if len(every) < 3:
        return every, False
    apart = np.linalg.norm(every[:, None] - every, axis=2)
    np.fill_diagonal(apart, np.inf)
    limit = _JUMP * float(np.median(apart.min(axis=0)))
    runs: list[FloatArray] = []
    for piece in pieces:
        jumps = np.flatnonzero(np.linalg.norm(np.diff(piece, axis=0), axis=1) > limit)
        runs += [run for run in np.split(piece, jumps + 1) if len(run)]
    while len(runs) > 1:
        ends = np.array([end for run in runs for end in (run[0], run[-1])])
        away = np.linalg.norm(ends[:, None] - ends, axis=2)
        own = np.arange(len(ends)) // 2
        away[own[:, None] == own] = np.inf
        one, other = sorted(int(i) for i in np.unravel_index(away.argmin(), away.shape))
        second = runs.pop(other // 2)
        first = runs.pop(one // 2)
        runs.append(np.concatenate([first[:: 1 if one % 2 else -1], second[:: -1 if other % 2 else 1]]))
    line = _uncrossed(runs[0])
    gaps = np.linalg.norm(np.roll(line, -1, axis=0) - line, axis=1)
    widest = int(gaps.argmax())
    return np.roll(line, -widest - 1, axis=0), bool(gaps[widest] <= limit)


def _uncrossed(line: FloatArray) -> FloatArray:
    """The closed line, shortened by turning parts of it round."""
    above = np.triu(np.ones((len(line), len(line)), dtype=bool), 1)
    while True:
        following = np.roll(line, -1, axis=0)
        away = np.linalg.norm(line[:, None] - line, axis=2)
        step = np.linalg.norm(following - line, axis=1)
        gain = step[:, None] + step - away - np.roll(away, (-1, -1), axis=(0, 1))
        i, j = (int(k) for k in np.unravel_index(np.where(above, gain, 0.0).argmax(), gain.shape))
        if gain[i, j] <= _GAIN or i >= j:
            return line
        line = np.concatenate([line[: i + 1], line[j:i:-1], line[j + 1 :]])
