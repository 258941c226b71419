"""VolumeMesh in, thickness of its wall at every element out.

At a point of the wall the thickness is its distance from the nearest surface plus that from the second nearest one, of
the chambers' endocardia and the epicardium: across a free wall from endocardium to epicardium, across the
septum from one endocardium to the other. At the rim of the base and beyond the end of the cavity the nearest points do
not lie straight across the wall, and the figure is larger than the wall is thick.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.mesh.elements import ELEMENTS
from femprep.mesh.length_unit import require_unit
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import FloatArray, VolumeMesh
from femprep.model.facets import facet_triangles

#: Surfaces that a wall lies between.
SURFACES: Final = ("endo", "endo_lv", "endo_rv", "endo_la", "endo_ra", "epi")


def wall_thickness(mesh: VolumeMesh) -> FloatArray:
    """Thickness of the wall at each element: the mean of that at its corners.

    Parameters
    ----------
    mesh : VolumeMesh
        With facets tagged ``endo`` (or ``endo_lv`` and ``endo_rv``) and ``epi``.

    Returns
    -------
    (n_cells,) array
        mm.

    Raises
    ------
    InputError
        Fewer than two of these surfaces are there, or the unit of the mesh's file is not known.

    Examples
    --------
    >>> fp.wall_thickness(mesh).shape == (mesh.n_cells,)
    True
    """
    require_unit(mesh)
    surfaces = [facet_triangles(mesh, name) for name in SURFACES]
    surfaces = [triangles for triangles in surfaces if len(triangles)]
    if len(surfaces) < 2:
        have = ", ".join(mesh.facet_names) or "none"
        raise InputError(f"thickness needs facets tagged endo (or endo_lv, endo_rv) and epi; the mesh has {have}")
    corners = [block[:, : ELEMENTS[kind].corners] for kind, block in mesh.cells.items()]
    used = np.unique(np.concatenate([block.ravel() for block in corners]))
    finders = (ClosestFinder(mesh.points, triangles) for triangles in surfaces)
    distance = np.sort([finder(mesh.points[used]).distance for finder in finders], axis=0)
    at_points = np.full(len(mesh.points), np.nan)
    at_points[used] = distance[0] + distance[1]
    return np.concatenate([at_points[block].mean(axis=1) for block in corners])
