"""Element type in, its sample points out: where Jacobians are judged, their edge frames, ideal shape and weights.

Reference elements and shape functions are the usual ones in VTK's node order: tetrahedra on the unit simplex, wedges
on triangle x [-1, 1], hexahedra on [-1, 1]^3, quadratic ones serendipity.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.mesh.elements import ELEMENTS
from femprep.model import FloatArray, IntArray

_TET = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float)
_WEDGE = np.array([(0, 0, -1), (1, 0, -1), (0, 1, -1), (0, 0, 1), (1, 0, 1), (0, 1, 1)], dtype=float)
_HEX = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float)
_HEX = np.concatenate([np.column_stack([_HEX, np.full(4, z)]) for z in (-1.0, 1.0)])

#: The three corners next to each corner, so ordered that the edges to them are right-handed in a positive element.
CORNER_EDGES: Final = {
    "tetra": ((1, 2, 3), (2, 0, 3), (0, 1, 3), (0, 2, 1)),
    "wedge": ((1, 2, 3), (2, 0, 4), (0, 1, 5), (5, 4, 0), (3, 5, 1), (4, 3, 2)),
    "hexahedron": ((1, 3, 4), (2, 0, 5), (3, 1, 6), (0, 2, 7), (7, 5, 0), (4, 6, 1), (5, 7, 2), (6, 4, 3)),
}

#: Edges of the ideal element at a corner, as columns of unit length: regular tetrahedron, right prism on an
#: equilateral triangle with square sides, cube.
IDEAL: Final = {
    "tetra": np.array([[1.0, 0.5, 0.5], [0.0, np.sqrt(3) / 2, np.sqrt(3) / 6], [0.0, 0.0, np.sqrt(2.0 / 3.0)]]),
    "wedge": np.array([[1.0, 0.5, 0.0], [0.0, np.sqrt(3) / 2, 0.0], [0.0, 0.0, 1.0]]),
    "hexahedron": np.eye(3),
}

_REFERENCE: Final = {"tetra": (_TET, 1.0 / 6.0), "wedge": (_WEDGE, 1.0), "hexahedron": (_HEX, 8.0)}


@dataclass(frozen=True)
class ElementSamples:
    """Where an element type is judged.

    Attributes
    ----------
    frames : (s, nodes, 3) array
        Contracted with an element's points they give the three edge vectors of the parallelepiped it looks like at
        sample s: ``A[s] = einsum("nk,nj->kj", x, frames[s])``. The first ones belong to the corners, in their order.
    corners : int
        Number of corners.
    scale : (s,) array
        ``det A[s] * scale[s]`` is the Jacobian as volume per reference volume: on a straight-sided tetrahedron its
        volume.
    ideal : (3, 3) array
        The edges of the ideal element.
    gradients : (q, nodes, 3) array
        Derivatives of the shape functions at the points of a quadrature that integrates the Jacobian exactly.
    weights : (q,) array
        Its weights.
    """

    frames: FloatArray
    corners: int
    scale: FloatArray
    ideal: FloatArray
    gradients: FloatArray
    weights: FloatArray


def family(name: str) -> str:
    """The linear element of the same shape: ``"tetra"`` for ``"tetra10"``."""
    return {4: "tetra", 6: "wedge", 8: "hexahedron"}[ELEMENTS[name].corners]


@cache
def element_samples(name: str) -> ElementSamples:
    """Sample points of an element type of ``femprep.mesh.elements.ELEMENTS``: its corners and its quadrature points."""
    kind, shape = ELEMENTS[name], family(name)
    nodes, reference_volume = _REFERENCE[shape]
    corner_frames = [
        (nodes[c], np.column_stack([nodes[n] - nodes[c] for n in near])) for c, near in enumerate(CORNER_EDGES[shape])
    ]
    places = list(corner_frames)
    points, weights = _volume_rule(shape)
    if name != "tetra":
        # At a corner only the frame of that corner makes sense. Inside the element any of them does; those of the
        # other corners of a wedge or hexahedron repeat the first three (one) of them.
        inner = {"tetra": corner_frames, "wedge": corner_frames[:3], "hexahedron": corner_frames[:1]}[shape]
        solver = [*_solver_rule(name), nodes.mean(axis=0)]
        places += [(point, frame) for point in solver for _, frame in inner]
    frames = np.array([shape_gradients(name, point) @ frame for point, frame in places])
    scale = np.array([reference_volume / np.linalg.det(frame) for _, frame in places])
    gradients = np.array([shape_gradients(name, point) for point in points])
    for array in (frames, scale, gradients, weights):
        array.setflags(write=False)
    return ElementSamples(frames, kind.corners, scale, IDEAL[shape], gradients, weights)


def reference_nodes(name: str) -> FloatArray:
    """All nodes of the reference element, ``(nodes, 3)``, mid-side nodes at the middle of their edges."""
    kind = ELEMENTS[name]
    corners = _REFERENCE[family(name)][0]
    if not kind.quadratic:
        return corners
    return np.concatenate([corners, [(corners[a] + corners[b]) / 2 for a, b in kind.edges]])


def shape_values(name: str, point: npt.ArrayLike) -> FloatArray:
    """The shape functions at one point of the reference element, ``(nodes,)``."""
    return np.asarray(_coefficients(name).T @ monomials(_exponents(name), np.asarray(point, dtype=float)[None])[0])


def shape_gradients(name: str, point: npt.ArrayLike) -> FloatArray:
    """Derivatives of the shape functions by the reference coordinates at one point, ``(nodes, 3)``.

    The functions are the polynomials of the element's space that are 1 at their own node and 0 at the others.
    """
    slopes = monomial_slopes(_exponents(name), np.asarray(point, dtype=float)[None])[0]
    return np.asarray(_coefficients(name).T @ np.ascontiguousarray(slopes))


def monomials(powers: IntArray, places: FloatArray) -> FloatArray:
    """Products of powers ``(n, d)`` of coordinates at places ``(q, d)``, ``(q, n)``."""
    return np.asarray(np.prod(places[:, None, :] ** powers[None], axis=2))


def monomial_slopes(powers: IntArray, places: FloatArray) -> FloatArray:
    """Their derivatives along each coordinate, ``(q, n, d)``."""
    lower = np.maximum(powers[:, None] - np.eye(powers.shape[1], dtype=np.int64), 0)
    return np.stack([powers[:, k] * monomials(lower[:, k], places) for k in range(powers.shape[1])], axis=2)


@cache
def _coefficients(name: str) -> FloatArray:
    """Column i holds the monomial coefficients of shape function i."""
    return np.asarray(np.linalg.inv(monomials(_exponents(name), reference_nodes(name))))


@cache
def _exponents(name: str) -> IntArray:
    """Exponents of the monomials that span the element's space, ``(nodes, 3)``."""
    grid = [(i, j, k) for i in range(4) for j in range(4) for k in range(4)]

    def superlinear(powers: tuple[int, ...]) -> int:
        return sum(p for p in powers if p > 1)

    def belongs(p: tuple[int, int, int]) -> bool:
        plane = p[0] + p[1]
        if name == "tetra":
            return sum(p) <= 1
        if name == "tetra10":
            return sum(p) <= 2
        if name == "wedge":
            return plane <= 1 and p[2] <= 1
        if name == "wedge15":
            return (plane <= 2 and p[2] <= 1) or (plane <= 1 and p[2] == 2)
        if name == "hexahedron":
            return max(p) <= 1
        return superlinear(p) <= 2 and max(p) <= 2

    return np.array([p for p in grid if belongs(p)], dtype=np.int64)


def _line(count: int) -> tuple[FloatArray, FloatArray]:
    points, weights = np.polynomial.legendre.leggauss(count)
    return np.asarray(points), np.asarray(weights)


def _box_rule(count: int) -> tuple[FloatArray, FloatArray]:
    """Gauss points of [-1, 1]^3."""
    x, w = _line(count)
    points = np.stack(np.meshgrid(x, x, x, indexing="ij"), axis=-1).reshape(-1, 3)
    return points, np.einsum("i,j,k->ijk", w, w, w).ravel()


def _simplex_rule(dimension: int) -> tuple[FloatArray, FloatArray]:
    """Gauss points of the square or cube collapsed onto the triangle or tetrahedron, exact to degree 6 - d."""
    x, w = _line(3)
    t, w = (x + 1) / 2, w / 2
    if dimension == 2:
        u, v = (a.ravel() for a in np.meshgrid(t, t, indexing="ij"))
        weights = np.einsum("i,j->ij", w, w).ravel() * (1 - u)
        return np.column_stack([u, v * (1 - u)]), weights
    u, v, s = (a.ravel() for a in np.meshgrid(t, t, t, indexing="ij"))
    weights = np.einsum("i,j,k->ijk", w, w, w).ravel() * (1 - u) ** 2 * (1 - v)
    return np.column_stack([u, v * (1 - u), s * (1 - u) * (1 - v)]), weights


def _volume_rule(shape: str) -> tuple[FloatArray, FloatArray]:
    """Points and weights that integrate the Jacobian of the quadratic element exactly."""
    if shape == "hexahedron":
        return _box_rule(3)
    if shape == "tetra":
        return _simplex_rule(3)
    triangle, a = _simplex_rule(2)
    x, b = _line(3)
    points = np.concatenate([np.column_stack([triangle, np.full(len(triangle), t)]) for t in x])
    return points, np.einsum("i,j->ij", b, a).ravel()


def _solver_rule(name: str) -> FloatArray:
    """The quadrature points solvers usually use for the element."""
    shape = family(name)
    if shape == "hexahedron":
        return _box_rule(3 if ELEMENTS[name].quadratic else 2)[0]
    if shape == "tetra":
        a, b = (5 - np.sqrt(5)) / 20, (5 + 3 * np.sqrt(5)) / 20
        return np.array([(a, a, a), (b, a, a), (a, b, a), (a, a, b)])
    triangle = np.array([(1, 1), (4, 1), (1, 4)]) / 6.0
    x, _ = _line(3 if ELEMENTS[name].quadratic else 2)
    return np.concatenate([np.column_stack([triangle, np.full(3, t)]) for t in x])
