"""A closed mesh of a ball's surface in, its map to the unit sphere out: conformal first, then levelled.

Conformalised mean curvature flow [1]_ carries the mesh to a sphere in a few linear solves; it keeps angles, so that
nothing folds, but makes small what is long and thin. Then the vertices slide on the sphere until neither angles nor
areas are distorted much.

References
----------
.. [1] Kazhdan, Solomon & Ben-Chen, Can mean-curvature flow be modified to be non-singular?, Comput. Graph. Forum
   31(5), 2012. doi:10.1111/j.1467-8659.2012.03179.x
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from femprep.mesh.banded import Banded
from femprep.mesh.curvature import stiffness
from femprep.mesh.energies.distortion import Ideal
from femprep.mesh.energies.lbfgs import descend, on_sphere, smoother
from femprep.mesh.measures.triangles import areas, corners, vertex_sums
from femprep.model import FloatArray, IntArray
from femprep.model.products import inner, length, solve_definite, unit_vectors, weighted

#: Steps of the flow, and their length by the area of the surface.
_FLOWS: Final = 30
_PACE: Final = 0.5
#: It ends when the distances from the middle differ by less than this share.
_ROUND: Final = 0.02
#: What areas count beside angles, and steps of levelling.
_SIZE: Final = 1.0
_LEVELLING: Final = 100


def sphere_map(points: FloatArray, cells: IntArray, density: FloatArray | None = None) -> FloatArray:
    """Unit vectors ``(n, 3)`` for the vertices of a closed mesh: a map to the sphere with little distortion.

    Parameters
    ----------
    points : (n, 3) array
    cells : (m, 3) array
        Triangles of a closed surface without handles, wound outward, none without area.
    density : (n,) array, optional
        By what areas are to be multiplied on the sphere, all alike by default.
    """
    factor = np.ones(len(cells)) if density is None else density[cells].mean(axis=1)
    weight = areas(points, cells) * factor
    flat = centred(conformal(points, cells), weight, cells)
    ideal = Ideal.of(points, cells, np.sqrt(4.0 * np.pi / weight.sum() * factor))
    return descend(flat, on_sphere, ideal, smoother(cells, len(points)), _SIZE, _LEVELLING)[0].points


def conformal(points: FloatArray, cells: IntArray) -> FloatArray:
    """Unit vectors ``(n, 3)`` from conformalised mean curvature flow: the first stiffness, the mass as it changes."""
    from scipy.sparse import diags_array

    stiff = cotangent(points, cells)
    first = areas(points, cells)
    x = _normed(points, first, cells)
    for _ in range(_FLOWS):
        # Never nothing, so that what shrinks to a needle stays solvable.
        mass = np.maximum(vertex_sums(areas(x, cells) / 3.0, cells, len(x)), 1e-9)
        solver = Banded(diags_array(mass) + _PACE * stiff)
        x = _normed(solver.solve(mass[:, None] * x), areas(x, cells), cells)
        radius = np.linalg.norm(x, axis=1)
        if radius.std() < _ROUND * radius.mean():
            break
    return unit_vectors(x)


def cotangent(points: FloatArray, cells: IntArray) -> Any:
    """Stiffness matrix of linear elements ``(n, n)``, with cotangents of obtuse corners as they are."""
    p = corners(points, cells)
    found = []
    for k in range(3):
        a, b = p[:, (k + 1) % 3] - p[:, k], p[:, (k + 2) % 3] - p[:, k]
        found.append(np.einsum("ij,ij->i", a, b) / np.maximum(np.linalg.norm(np.cross(a, b), axis=1), 1e-300))
    return stiffness(np.stack(found, axis=1), cells, len(points))


def centred(directions: FloatArray, weight: FloatArray, cells: IntArray) -> FloatArray:
    """The Moebius map of the sphere that puts the middle of weighted triangles at its centre.

    References
    ----------
    Baden, Crane & Kazhdan, Moebius registration, Comput. Graph. Forum 37(5), 2018. doi:10.1111/cgf.13503
    """
    share = vertex_sums(weight / weight.sum() / 3.0, cells, len(directions))
    x = directions
    for _ in range(100):
        middle = weighted(share, x)
        off = length(middle)
        if off < 1e-6:
            break
        jacobian = 2.0 * (np.eye(3) - weighted(x, share[:, None] * x))
        c = -solve_definite(jacobian, middle[:, None])[:, 0]
        c *= min(1.0, 0.5 / length(c))
        shifted = x + c
        x = unit_vectors((1.0 - inner(c, c)) * shifted / np.einsum("ij,ij->i", shifted, shifted)[:, None] + c)
    return x


def _normed(points: FloatArray, weight: FloatArray, cells: IntArray) -> FloatArray:
    """Moved and scaled to middle 0 and area 4 pi."""
    middle = weighted(weight, corners(points, cells).mean(axis=1)) / weight.sum()
    return np.asarray((points - middle) * np.sqrt(4.0 * np.pi / areas(points, cells).sum()))
