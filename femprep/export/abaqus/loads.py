"""Facets and a pressure in, the forces it puts on their nodes out: minus the integral of p N n over the facets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from femprep.mesh.elements import FACET_CORNERS
from femprep.mesh.measures.nodal_areas import facet_shapes
from femprep.model import FloatArray, IntArray

_GAUSS: Final = np.polynomial.legendre.leggauss(3)
#: Weights and places by the number of corners: of degree 2, as CalculiX has on facets of three and six nodes; three
#: points each way on the others.
_RULES: Final = {
    3: (np.full(3, 1 / 6), np.array([(1 / 6, 1 / 6), (2 / 3, 1 / 6), (1 / 6, 2 / 3)])),
    4: (np.outer(_GAUSS[1], _GAUSS[1]).ravel(), np.array([(x, y) for x in _GAUSS[0] for y in _GAUSS[0]])),
}


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
        weight, places = _RULES[FACET_CORNERS[kind]]
        values, slopes = facet_shapes(kind, places)
        tangents = np.einsum("fnx,qnd->fqdx", points[block], slopes)
        normal = np.cross(tangents[:, :, 0], tangents[:, :, 1])
        np.add.at(loads, block, -pressure * np.einsum("q,fqx,qn->fnx", weight, normal, values))
    return loads
