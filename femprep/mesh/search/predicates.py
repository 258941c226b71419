"""Points to the exact sign of an orientation: which side of a plane or line a point lies on, without rounding error.

Floating point decides where its error bound allows it; else the determinant is summed as an exact expansion of
doubles. After Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric predicates, Discrete &
Computational Geometry 18, 1997, doi:10.1007/PL00009321.
"""

from __future__ import annotations

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.model import FloatArray

_EPSILON = 2.0**-53
_BOUND_2D = (3.0 + 16.0 * _EPSILON) * _EPSILON
_BOUND_3D = (7.0 + 56.0 * _EPSILON) * _EPSILON
_SPLITTER = 134217729.0  # 2**27 + 1, splits a double into two halves whose products are exact


@compiled(inner=True)
def _two_sum(a: float, b: float) -> tuple[float, float]:
    """a + b as rounded sum and its exact error."""
    total = a + b
    virtual = total - a
    return total, (a - (total - virtual)) + (b - virtual)


@compiled(inner=True)
def _two_product(a: float, b: float) -> tuple[float, float]:
    """a * b as rounded product and its exact error."""
    product = a * b
    c = _SPLITTER * a
    a_high = c - (c - a)
    a_low = a - a_high
    c = _SPLITTER * b
    b_high = c - (c - b)
    b_low = b - b_high
    return product, a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low)


@compiled(inner=True)
def _add(expansion: FloatArray, length: int, value: float) -> int:
    """Add a double to an expansion in place (Shewchuk's grow-expansion without zeros); returns its new length."""
    if value == 0.0:
        return length
    kept = 0
    for i in range(length):
        value, error = _two_sum(value, expansion[i])
        if error != 0.0:
            expansion[kept] = error
            kept += 1
    if value != 0.0:
        expansion[kept] = value
        kept += 1
    return kept


@compiled(inner=True)
def _sign(expansion: FloatArray, length: int) -> int:
    """Sign of an expansion: that of its last, largest part."""
    if length == 0:
        return 0
    return 1 if expansion[length - 1] > 0.0 else -1


@compiled(inner=True)
def _exact_2d(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> int:
    """Sign of (a - c) x (b - c), exactly."""
    left = (_two_sum(ax, -cx), _two_sum(ay, -cy))
    right = (_two_sum(by, -cy), _two_sum(bx, -cx))
    expansion = np.empty(18)
    length = np.int64(0)
    for term in range(2):
        for i in range(2):
            for j in range(2):
                high, low = _two_product(left[term][i], right[term][j])
                flip = 1.0 if term == 0 else -1.0
                length = _add(expansion, length, flip * low)
                length = _add(expansion, length, flip * high)
    return _sign(expansion, length)


@compiled()
def orient2d(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> int:
    """Sense of the triangle a, b, c in the plane: 1 counter-clockwise, -1 clockwise, 0 collinear; exact."""
    left = (ax - cx) * (by - cy)
    right = (ay - cy) * (bx - cx)
    det = left - right
    bound = _BOUND_2D * (abs(left) + abs(right))
    if det > bound:
        return 1
    if det < -bound:
        return -1
    if bound == 0.0:
        return 0
    return _exact_2d(ax, ay, bx, by, cx, cy)


@compiled(inner=True)
def _exact_3d(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> int:
    """Sign of the determinant of (a - d, b - d, c - d), exactly."""
    part = np.empty((3, 3, 2))
    for k in range(3):
        part[0, k, 0], part[0, k, 1] = _two_sum(a[k], -d[k])
        part[1, k, 0], part[1, k, 1] = _two_sum(b[k], -d[k])
        part[2, k, 0], part[2, k, 1] = _two_sum(c[k], -d[k])
    expansion = np.empty(194)
    length = np.int64(0)
    for term in range(6):
        # The six permutations of the columns: three cyclic ones with sign +, then three with sign -.
        first = term % 3
        second = (first + 1) % 3 if term < 3 else (first + 2) % 3
        third = (first + 2) % 3 if term < 3 else (first + 1) % 3
        flip = 1.0 if term < 3 else -1.0
        for i in range(2):
            x = flip * part[0, first, i]
            if x == 0.0:
                continue
            for j in range(2):
                high, low = _two_product(x, part[1, second, j])
                for k in range(2):
                    z = part[2, third, k]
                    if z == 0.0:
                        continue
                    product, error = _two_product(low, z)
                    length = _add(expansion, length, error)
                    length = _add(expansion, length, product)
                    product, error = _two_product(high, z)
                    length = _add(expansion, length, error)
                    length = _add(expansion, length, product)
    return _sign(expansion, length)


@compiled()
def orient3d(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> int:
    """Side of the plane a, b, c that d lies on, exact: 0 in the plane; 1 where (a - d, b - d, c - d) is right-handed.

    That is 1 where a, b, c run clockwise seen from d, below the side their normal points to.
    """
    adx, ady, adz = a[0] - d[0], a[1] - d[1], a[2] - d[2]
    bdx, bdy, bdz = b[0] - d[0], b[1] - d[1], b[2] - d[2]
    cdx, cdy, cdz = c[0] - d[0], c[1] - d[1], c[2] - d[2]
    bc, cb = bdx * cdy, cdx * bdy
    ca, ac = cdx * ady, adx * cdy
    ab, ba = adx * bdy, bdx * ady
    det = adz * (bc - cb) + bdz * (ca - ac) + cdz * (ab - ba)
    size = (abs(bc) + abs(cb)) * abs(adz) + (abs(ca) + abs(ac)) * abs(bdz) + (abs(ab) + abs(ba)) * abs(cdz)
    bound = _BOUND_3D * size
    if det > bound:
        return 1
    if det < -bound:
        return -1
    if bound == 0.0:
        return 0
    return _exact_3d(a, b, c, d)
