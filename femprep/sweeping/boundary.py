"""A swept mesh in, the closed Wall that is its boundary out."""

from __future__ import annotations

import numpy as np

from femprep.errors import InputError
from femprep.mesh.elements import FACET_CORNERS
from femprep.model import VolumeMesh, Wall
from femprep.model.blocks import block_rows
from femprep.model.facets import split_facets


def boundary_wall(mesh: VolumeMesh) -> Wall:
    """The tagged boundary facets of a swept mesh as a closed surface of triangles.

    Parameters
    ----------
    mesh : VolumeMesh
        Swept; quadrilaterals are split along their first diagonal, mid-side nodes left out.

    Returns
    -------
    Wall
        ``template`` is the vertex number on the cup for points of the endocardium and the epicardium, -1 for those of
        rims between them.

    Raises
    ------
    InputError
        The mesh was not swept.

    Examples
    --------
    >>> fp.boundary_wall(swept)
    Wall(... points, ... triangles: endo, epi, base)
    """
    if missing := {"transmural", "template"} - set(mesh.point_data):
        raise InputError(f"the mesh was not swept: it has no point data {', '.join(sorted(missing))}")
    every = split_facets(mesh.facets)
    tags = [mesh.facet_tag[rows] for kind, _, rows in block_rows(mesh.facets) for _ in range(FACET_CORNERS[kind] - 2)]
    used, number = np.unique(every, return_inverse=True)
    depth = np.asarray(mesh.point_data["transmural"])[used]
    template = np.where((depth == 0.0) | (depth == 1.0), np.asarray(mesh.point_data["template"])[used], -1)
    info = {"source": "boundary of the swept mesh", **{k: v for k, v in mesh.info.items() if k == "matching"}}
    return Wall(mesh.points[used], number.reshape(every.shape), np.concatenate(tags), template, mesh.planes, info)
