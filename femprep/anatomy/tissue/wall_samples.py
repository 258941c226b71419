"""Parts of a wall in, points spread evenly through their elements out, each standing for a share of the volume."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from femprep.anatomy.wall_parts import WallPart
from femprep.model import FloatArray, IntArray

#: Points along an edge, at most.
_MOST: Final = 3


@dataclass(frozen=True, eq=False)
class WallSamples:
    """Points of a part of a wall.

    Attributes
    ----------
    nodes : (q, 4) array
        Nodes of the tetrahedron each lies in.
    weights : (q, 4) array
        Their shares.
    element : (q,) array
        The element of the part it belongs to.
    volume : (q,) array
        What it stands for, mm3.
    """

    nodes: IntArray
    weights: FloatArray
    element: IntArray
    volume: FloatArray


def sample_part(part: WallPart, step: float) -> WallSamples:
    """Points at about a distance ``step``, mm, three along an edge at most."""
    tets, element = part.tets
    x = part.mesh.points[tets]
    volume = np.abs(np.linalg.det(x[:, 1:] - x[:, :1])) / 6.0
    edge = float(np.cbrt(np.sqrt(2.0) * 6.0 * np.median(volume)))
    rule = _lattice(int(np.clip(np.ceil(edge / step), 1, _MOST)))
    count = len(rule)
    return WallSamples(
        np.repeat(tets, count, axis=0),
        np.tile(rule, (len(tets), 1)),
        np.repeat(element, count),
        np.repeat(volume / count, count),
    )


@cache
def _lattice(cuts: int) -> FloatArray:
    """Centres of the ``cuts`` ** 3 equal parts of a tetrahedron cut along planes parallel to its faces, ``(p, 4)``."""
    found = []
    for total, offsets in (
        (cuts - 1, (0.25, 0.25, 0.25, 0.25)),  # upright tetrahedra
        (cuts - 3, (0.75, 0.75, 0.75, 0.75)),  # turned ones
    ):
        found += [np.add(part, offsets) for part in _compositions(total)]
    # An octahedron has its corners at the middles of the edges of a tetrahedron of twice its size: four tetrahedra
    # round the diagonal from (0, 1) to (2, 3), over the ring of the other four.
    ring = [(0, 2), (1, 2), (1, 3), (0, 3)]
    for part in _compositions(cuts - 2):
        for k in range(4):
            corners = np.zeros((4, 4))
            for row, pair in enumerate(((0, 1), (2, 3), ring[k], ring[(k + 1) % 4])):
                corners[row, list(pair)] = 1.0
            found.append(np.add(part, corners.mean(axis=0)))
    return np.array(found) / cuts


def _compositions(total: int) -> list[tuple[int, int, int, int]]:
    """All ways to write a number as the sum of four that are not negative."""
    if total < 0:
        return []
    return [
        (a, b, c, total - a - b - c)
        for a in range(total + 1)
        for b in range(total + 1 - a)
        for c in range(total + 1 - a - b)
    ]
