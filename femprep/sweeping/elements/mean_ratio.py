"""A layered mesh in, the inverse mean ratio of its elements out."""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.mesh.energies.simplex import INVERTED, shape
from femprep.model import FloatArray, IntArray
from femprep.sweeping.cup.simplices import Simplices


def inverse_mean_ratio(
    points: FloatArray, cells: IntArray, judged: Simplices, layers: IntArray | None = None
) -> FloatArray:
    """Greatest inverse mean ratio in each element of some layers, infinite where it is inverted.

    Parameters
    ----------
    points : (layers + 1, V, 3) array
        Nodes, mm.
    cells : (T, 3 or 4) array
    judged : Simplices
    layers : (k,) array, optional
        Which layers are looked at; all where not given.

    Returns
    -------
    (k, T) array
    """
    chosen = np.arange(len(points) - 1) if layers is None else layers
    worst = np.empty((len(chosen), len(cells)))
    _measure(worst.size, np.ascontiguousarray(points), np.ascontiguousarray(cells), tuple(judged), chosen, worst)
    return worst


@compiled(grain=512)
def _measure(first: int, last: int, points: Any, cells: Any, judged: Any, layers: Any, worst: Any) -> None:
    nodes, kinds, weights, scale, upright = judged
    n = cells.shape[1]
    for e in range(first, last):
        row = e // len(cells)
        layer = layers[row]
        c = e % len(cells)
        x = np.empty((8, 3))
        for i in range(n):
            for k in range(3):
                x[i, k] = points[layer, cells[c, i], k]
                x[i + n, k] = points[layer + 1, cells[c, i], k]
        table = nodes[kinds[c, layer % 2]]
        most = 0.0
        for r in range(len(table)):
            most = max(most, shape(x, table[r], weights, scale, upright[c], 0.0))
        worst[row, c] = np.cbrt(most) if most < INVERTED else np.inf
