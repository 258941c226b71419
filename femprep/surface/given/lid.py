"""A closed surface in, the same without the flat lid that closes it at its base, and the lid's plane, out."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from femprep.mesh.measures.triangles import area_vectors
from femprep.mesh.topology import border_loops, components, edge_table, fold_angles, is_closed, pieces
from femprep.model import FloatArray, IntArray

#: Neighbours whose normals differ by less than this, degrees, are of one flat piece, unless the whole is not flat.
_FLAT: Final = 3.0
#: Farthest a lid's corners lie from its plane, by its width; least share of the surface's area that it has; least angle
#: in which it meets the rest, degrees, in the middle over its rim.
_OFF: Final = 0.01
_SHARE: Final = 0.02
_SHARP: Final = 30.0


class Lidless(NamedTuple):
    """A surface without its lid.

    Attributes
    ----------
    cells : (m, 3) array
        What is left, on the same points.
    middle, normal : (3,) arrays
        Of the lid, mm; the normal leads outward.
    area : float
        Of the lid, mm2.
    """

    cells: IntArray
    middle: FloatArray
    normal: FloatArray
    area: float


def without_lid(points: FloatArray, cells: IntArray) -> Lidless | None:
    """Take the largest flat lid with a sharp rim off a closed surface; None where it has none.

    Parameters
    ----------
    points : (n, 3) array
        mm.
    cells : (m, 3) array
        Closed, wound outward.
    """
    if not is_closed(cells):
        return None
    pairs, angle = fold_angles(points, cells)
    flat = pairs[angle < _FLAT]
    patch = components(flat[:, 0], flat[:, 1], len(cells))
    vectors = area_vectors(points, cells)
    area = np.linalg.norm(vectors, axis=1)
    share = np.bincount(patch, area) / area.sum()
    for number in np.argsort(-share, kind="stable"):
        if share[number] < _SHARE:
            return None
        own = patch == number
        normal = vectors[own].sum(axis=0)
        normal /= np.linalg.norm(normal)
        corners = points[np.unique(cells[own])]
        middle = np.average(points[cells[own]].mean(axis=1), axis=0, weights=area[own])
        width = float(np.sqrt(share[number] * area.sum()))
        if np.abs((corners - middle) @ normal).max() > _OFF * width:
            continue
        rim = own[pairs[:, 0]] != own[pairs[:, 1]]
        if not rim.any() or np.median(angle[rim]) < _SHARP or not len(cells[~own]):
            continue
        if len(border_loops(cells[own])) == 1 and _one_piece(cells[~own]):
            return Lidless(cells[~own], middle, normal, float(share[number] * area.sum()))
    return None


def _one_piece(cells: IntArray) -> bool:
    return int(pieces(cells).max()) == 0 and bool((edge_table(cells).count <= 2).all())
