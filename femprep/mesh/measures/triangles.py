"""Points and triangles (or quadrilaterals) to values per cell: area, normal, quality Q, angles, scaled Jacobian."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from femprep.model import FloatArray, IntArray
from femprep.model.functions import arctan2
from femprep.model.products import unit_vectors


def corners(points: npt.ArrayLike, cells: npt.ArrayLike) -> FloatArray:
    """Corner points of each cell, ``(m, p, 3)``."""
    return np.asarray(np.asarray(points, dtype=np.float64)[np.asarray(cells, dtype=np.int64)])


def area_vectors(points: npt.ArrayLike, triangles: npt.ArrayLike) -> FloatArray:
    """Normal of each triangle, as long as its area, ``(m, 3)`` mm2."""
    p = corners(points, triangles)
    return np.asarray(0.5 * np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]))


def areas(points: npt.ArrayLike, triangles: npt.ArrayLike) -> FloatArray:
    """Area of each triangle, ``(m,)`` mm2."""
    return np.asarray(np.linalg.norm(area_vectors(points, triangles), axis=1))


def normals(points: npt.ArrayLike, triangles: npt.ArrayLike) -> FloatArray:
    """Unit normal of each triangle by its winding, ``(m, 3)``; zero for a triangle without area."""
    return unit_vectors(area_vectors(points, triangles))


def vertex_sums(values: FloatArray, cells: IntArray, count: int) -> FloatArray:
    """Sum at each vertex, ``(count,)``, of values of the cells around it, ``(m,)``, or of their corners there."""
    own = np.broadcast_to(values if values.ndim == 2 else values[:, None], cells.shape)
    return np.asarray(np.bincount(cells.ravel(), weights=own.ravel(), minlength=count), dtype=np.float64)


def vertex_normals(points: npt.ArrayLike, triangles: npt.ArrayLike) -> FloatArray:
    """Unit normal of each vertex, the mean of its triangles' normals weighted by their angle there, ``(n, 3)``.

    Zero for a vertex without triangles. The weighting makes the sign of a distance right at vertices [1]_.

    References
    ----------
    .. [1] Baerentzen & Aanaes, Signed distance computation using the angle weighted pseudonormal, IEEE TVCG 11(3),
       2005. doi:10.1109/TVCG.2005.49
    """
    points = np.asarray(points, dtype=np.float64)
    cells = np.asarray(triangles, dtype=np.int64)
    weighted = normals(points, cells)[:, None, :] * angles(points, cells)[:, :, None]
    total = np.stack([vertex_sums(weighted[:, :, k], cells, len(points)) for k in range(3)], axis=1)
    return unit_vectors(total)


def edge_lengths(points: npt.ArrayLike, cells: npt.ArrayLike) -> FloatArray:
    """Lengths of the sides of each cell, ``(m, p)`` mm; side i runs from corner i to corner i + 1."""
    p = corners(points, cells)
    return np.asarray(np.linalg.norm(np.roll(p, -1, axis=1) - p, axis=2))


def triangle_quality(points: npt.ArrayLike, triangles: npt.ArrayLike) -> FloatArray:
    """Quality index Q of each triangle, 1 for an equilateral one and 0 for one without area.

    ``Q = 8 (p - a)(p - b)(p - c) / (a b c)`` with the sides a, b, c and the semi-perimeter ``p = (a + b + c) / 2``:
    twice the ratio of the radii of the inscribed and the circumscribed circle. Eq. 12 of [1]_ prints
    ``p = (a + b + c) / 3``, by which an equilateral triangle would get 0.

    Parameters
    ----------
    points : (n, 3) array
        Vertices, any unit of length.
    triangles : (m, 3) array
        Corner numbers.

    Returns
    -------
    (m,) array
        Q from 0 to 1.

    References
    ----------
    .. [1] Skrinjar & Bistoquet, Generation of myocardial wall surface meshes from segmented MRI, Int. J. Biomed.
       Imaging, 2009. doi:10.1155/2009/313517
    """
    a, b, c = edge_lengths(points, triangles).T
    area = areas(points, triangles)
    # Heron's formula, 16 area^2 = 16 p (p-a)(p-b)(p-c), gives the product of the paper without its cancellation.
    below = a * b * c * (a + b + c)
    quality = np.divide(16.0 * area**2, below, out=np.zeros_like(area), where=below > 0)
    return np.asarray(np.minimum(quality, 1.0))


def quad_quality(points: npt.ArrayLike, quads: npt.ArrayLike) -> FloatArray:
    """Shape of each quadrilateral, 1 for a square and 0 where a corner is flat or folded.

    At corner i, with sides a and b and the part A of a x b along the quadrilateral's own normal, a square has
    2 A / (|a|^2 + |b|^2) = 1; the harmonic mean over the four corners is the shape measure of [1]_. Rectangles and
    rhombi both lose, unlike with the scaled Jacobian, so that it is what Q is to triangles.

    Parameters
    ----------
    points : (n, 3) array
        Vertices.
    quads : (m, 4) array
        Corner numbers in cyclic order.

    Returns
    -------
    (m,) array
        From 0 to 1.

    References
    ----------
    .. [1] Knupp, Algebraic mesh quality metrics for unstructured initial meshes, Finite Elem. Anal. Des. 39, 2003.
       doi:10.1016/S0168-874X(02)00070-7
    """
    jacobian, after, before = _corner_jacobians(points, quads)
    sides = (after**2).sum(axis=2) + (before**2).sum(axis=2)
    flat = (jacobian <= 0.0) | (sides <= 0.0)
    inverse = np.divide(sides, 2.0 * jacobian, out=np.full_like(sides, np.inf), where=~flat)
    return np.asarray(4.0 / inverse.sum(axis=1))


def angles(points: npt.ArrayLike, cells: npt.ArrayLike) -> FloatArray:
    """Interior angle at each corner of each cell, ``(m, p)`` radians; 0 next to a side without length."""
    p = corners(points, cells)
    after = np.roll(p, -1, axis=1) - p
    before = np.roll(p, 1, axis=1) - p
    sine = np.linalg.norm(np.cross(after, before), axis=2)
    cosine = np.einsum("mpk,mpk->mp", after, before)
    return arctan2(sine, cosine)


def aspect_ratio(points: npt.ArrayLike, triangles: npt.ArrayLike) -> FloatArray:
    """Longest side over the height on it, scaled to 1 for an equilateral triangle; infinite without area, ``(m,)``."""
    longest = edge_lengths(points, triangles).max(axis=1)
    area = areas(points, triangles)
    ratio = np.full(len(area), np.inf)
    return np.asarray(np.divide(np.sqrt(3.0) / 4.0 * longest**2, area, out=ratio, where=area > 0))


def _corner_jacobians(points: npt.ArrayLike, quads: npt.ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(side out x side in) along the quadrilateral's own normal at each corner, and both sides."""
    p = corners(points, quads)
    after = np.roll(p, -1, axis=1) - p
    before = np.roll(p, 1, axis=1) - p
    normal = unit_vectors(np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]))
    return np.asarray(np.einsum("mpk,mk->mp", np.cross(after, before), normal)), after, before


def scaled_jacobian(points: npt.ArrayLike, quads: npt.ArrayLike) -> FloatArray:
    """Scaled Jacobian of each quadrilateral: the least sine at its corners, negative where it is folded.

    At corner i the Jacobian is the part of (side out x side in) along the quadrilateral's own normal, divided by the
    lengths of both sides [1]_. 1 for a rectangle, 0 for a triangle, and below 1 for a warped cell.

    Parameters
    ----------
    points : (n, 3) array
        Vertices.
    quads : (m, 4) array
        Corner numbers in cyclic order.

    Returns
    -------
    (m,) array
        From -1 to 1.

    References
    ----------
    .. [1] Knupp, Achieving finite element mesh quality via optimization of the Jacobian matrix norm, Int. J. Numer.
       Meth. Eng. 48, 2000. doi:10.1002/(SICI)1097-0207(20000530)48:3<401::AID-NME880>3.0.CO;2-D
    """
    jacobian, after, before = _corner_jacobians(points, quads)
    sides = np.linalg.norm(after, axis=2) * np.linalg.norm(before, axis=2)
    return np.asarray(np.divide(jacobian, sides, out=np.zeros_like(jacobian), where=sides > 0).min(axis=1))
