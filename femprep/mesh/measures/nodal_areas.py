"""Facets in, the share of their area that each node has and the normal there, out.

The shares of a facet are in proportion to the integrals of the squares of its shape functions, so that they are
positive for quadratic facets too and add up to its area.

References
----------
Hinton, Rock and Zienkiewicz 1976, doi 10.1002/eqe.4290040305
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Final

import numpy as np

from femprep.mesh.elements import FACET_CORNERS
from femprep.mesh.measures.sample_points import monomial_slopes, monomials
from femprep.model import FloatArray, IntArray

#: Powers of the two coordinates in the polynomials of each facet type.
_POWERS: Final = {
    "triangle": ((0, 0), (1, 0), (0, 1)),
    "quad": ((0, 0), (1, 0), (0, 1), (1, 1)),
    "triangle6": ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)),
    "quad8": ((0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (2, 1), (1, 2)),
}
_CORNERS: Final = {
    3: np.array([(0, 0), (1, 0), (0, 1)], dtype=float),
    4: np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float),
}


def nodal_areas(points: FloatArray, facets: Mapping[str, IntArray]) -> tuple[FloatArray, FloatArray]:
    """Area and normal that belong to each point.

    Parameters
    ----------
    points : (n, 3) array
    facets : mapping of str to (f, q) array
        Blocks of facets by type.

    Returns
    -------
    area : (n,) array
        Their sum is the area of the facets; 0 for points on none of them.
    normal : (n, 3) array
        Unit vectors, the mean of the normals of the facets around a point by the areas they give it; 0 off them.
    """
    area, normal = np.zeros(len(points)), np.zeros((len(points), 3))
    for kind, block in facets.items():
        corner = points[block]
        weight, value, slope, nodal = _rule(kind)
        own = np.linalg.norm(_crossed(corner, slope), axis=2) * weight
        share = np.einsum("fq,qn->fn", own, value**2)
        share *= (own.sum(axis=1) / np.maximum(share.sum(axis=1), 1e-300))[:, None]
        across = _crossed(corner, nodal)
        across *= (share / np.maximum(np.linalg.norm(across, axis=2), 1e-300))[:, :, None]
        np.add.at(area, block, share)
        np.add.at(normal, block, across)
    return area, normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]


def _crossed(corner: FloatArray, slope: FloatArray) -> FloatArray:
    """Product of the two tangents of each facet at each place, ``(f, q, 3)``."""
    tangent = np.einsum("fnx,qnd->fqdx", corner, slope)
    return np.asarray(np.cross(tangent[:, :, 0], tangent[:, :, 1]))


@cache
def _rule(kind: str) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Weights of a quadrature of degree 5, shape functions and their slopes at its points, slopes at the nodes."""
    one, along = np.polynomial.legendre.leggauss(3)
    x, y = (grid.ravel() for grid in np.meshgrid(one, one, indexing="ij"))
    weight = np.outer(along, along).ravel()
    if FACET_CORNERS[kind] == 3:  # the square laid onto the triangle, an edge of it onto a corner
        x, y, weight = (1 + x) / 2, (1 + y) / 2 * (1 - x) / 2, weight * (1 - x) / 8
    places = np.column_stack([x, y])
    return weight, *facet_shapes(kind, places), facet_shapes(kind, _nodes(kind))[1]


def facet_shapes(kind: str, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Shape functions of a facet type at places ``(q, 2)`` of the reference facet, and their slopes.

    Returns
    -------
    values : (q, n) array
    slopes : (q, n, 2) array
    """
    powers = np.array(_POWERS[kind])
    coefficients: FloatArray = np.asarray(np.linalg.inv(monomials(powers, _nodes(kind))), dtype=np.float64)
    return monomials(powers, places) @ coefficients, _slopes(powers, places, coefficients)


def _nodes(kind: str) -> FloatArray:
    corners = _CORNERS[FACET_CORNERS[kind]]
    if len(_POWERS[kind]) == len(corners):
        return corners
    return np.concatenate([corners, (corners + np.roll(corners, -1, axis=0)) / 2])


def _slopes(powers: IntArray, places: FloatArray, coefficients: FloatArray) -> FloatArray:
    """Derivatives ``(q, n, 2)`` of the shape functions along the two reference coordinates."""
    return np.swapaxes(np.swapaxes(monomial_slopes(powers, places), 1, 2) @ coefficients, 1, 2)
