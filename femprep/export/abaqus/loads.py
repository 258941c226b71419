"""Facets and a pressure in, the forces it puts on their nodes out: minus the integral of p N n over the facets."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

import numpy as np

from femprep.model import FloatArray, IntArray


class _Point(NamedTuple):
    """A point of a rule: its weight, the shape functions ``(n,)`` there and their slopes ``(n, 2)``."""

    weight: float
    values: FloatArray
    slopes: FloatArray


def pressure_loads(points: FloatArray, facets: Mapping[str, IntArray], pressure: float) -> FloatArray:
    """Forces on all nodes that a pressure on facets gives.

    Parameters
    ----------
    points : (n, 3) array
        mm; moved ones where the pressure follows the wall.
    facets : mapping of str to (m, k) array
        Facets by type, wound out of the wall.
    pressure : float
        MPa, positive against the wall.

    Returns
    -------
    (n, 3) array
        N.
    """
    loads = np.zeros((len(points), 3))
    for kind, block in facets.items():
        for point in _RULES[kind]:
            tangents = np.einsum("fnx,nd->fdx", points[block], point.slopes)
            normal = np.cross(tangents[:, 0], tangents[:, 1])
            force = -pressure * point.weight * normal[:, None, :] * point.values[None, :, None]
            np.add.at(loads, block.ravel(), force.reshape(-1, 3))
    return loads


def _triangle(x: float, y: float) -> tuple[list[float], list[list[float]]]:
    return [1 - x - y, x, y], [[-1, -1], [1, 0], [0, 1]]


def _triangle6(x: float, y: float) -> tuple[list[float], list[list[float]]]:
    z = 1 - x - y
    values = [z * (2 * z - 1), x * (2 * x - 1), y * (2 * y - 1), 4 * z * x, 4 * x * y, 4 * y * z]
    slopes = [
        [1 - 4 * z, 1 - 4 * z],
        [4 * x - 1, 0],
        [0, 4 * y - 1],
        [4 * (z - x), -4 * x],
        [4 * y, 4 * x],
        [-4 * y, 4 * (z - y)],
    ]
    return values, slopes


_CORNERS: Final = ((-1, -1), (1, -1), (1, 1), (-1, 1))


def _quad(x: float, y: float) -> tuple[list[float], list[list[float]]]:
    values = [(1 + i * x) * (1 + j * y) / 4 for i, j in _CORNERS]
    return values, [[i * (1 + j * y) / 4, j * (1 + i * x) / 4] for i, j in _CORNERS]


def _quad8(x: float, y: float) -> tuple[list[float], list[list[float]]]:
    values = [(1 + i * x) * (1 + j * y) * (i * x + j * y - 1) / 4 for i, j in _CORNERS]
    slopes: list[list[float]] = [
        [i * (1 + j * y) * (2 * i * x + j * y) / 4, j * (1 + i * x) * (i * x + 2 * j * y) / 4] for i, j in _CORNERS
    ]
    for i, j in ((0, -1), (1, 0), (0, 1), (-1, 0)):  # the middles of the sides, in their order
        if i == 0:
            values.append((1 - x**2) * (1 + j * y) / 2)
            slopes.append([-x * (1 + j * y), j * (1 - x**2) / 2])
        else:
            values.append((1 - y**2) * (1 + i * x) / 2)
            slopes.append([i * (1 - y**2) / 2, -y * (1 + i * x)])
    return values, slopes


def _rule(
    shape: Callable[[float, float], tuple[list[float], list[list[float]]]], spots: list[tuple[float, float, float]]
) -> tuple[_Point, ...]:
    found = ((weight, *shape(x, y)) for weight, x, y in spots)
    return tuple(_Point(weight, np.array(values), np.array(slopes, dtype=float)) for weight, values, slopes in found)


#: Degree 2, as CalculiX has on facets of three and six nodes; three points each way on the others.
_THREE: Final = [(1 / 6, x, y) for x, y in ((1 / 6, 1 / 6), (2 / 3, 1 / 6), (1 / 6, 2 / 3))]
_GAUSS: Final = list(zip(*(array.tolist() for array in np.polynomial.legendre.leggauss(3)), strict=True))
_NINE: Final = [(wx * wy, x, y) for x, wx in _GAUSS for y, wy in _GAUSS]
_RULES: Final[Mapping[str, tuple[_Point, ...]]] = {
    "triangle": _rule(_triangle, _THREE),
    "triangle6": _rule(_triangle6, _THREE),
    "quad": _rule(_quad, _NINE),
    "quad8": _rule(_quad8, _NINE),
}
