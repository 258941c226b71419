"""A swept mesh in, the closed Wall that is its boundary out."""

from __future__ import annotations

import numpy as np

from femprep.mesh.elements import FACET_CORNERS
from femprep.model import VolumeMesh, Wall


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

    Examples
    --------
    >>> fp.boundary_wall(swept)
    Wall(... points, ... triangles: endo, epi, base)
    """
    triangles, tags = [], []
    start = 0
    for kind, nodes in mesh.facets.items():
        corner = nodes[:, : FACET_CORNERS[kind]]
        tag = np.asarray(mesh.facet_tag[start : start + len(nodes)])
        start += len(nodes)
        for pick in [[0, 1, 2]] if corner.shape[1] == 3 else [[0, 1, 2], [0, 2, 3]]:
            triangles.append(corner[:, pick])
            tags.append(tag)
    every = np.concatenate(triangles)
    used, number = np.unique(every, return_inverse=True)
    depth = np.asarray(mesh.point_data["transmural"])[used]
    template = np.where((depth == 0.0) | (depth == 1.0), np.asarray(mesh.point_data["template"])[used], -1)
    info = {"source": "boundary of the swept mesh", **{k: v for k, v in mesh.info.items() if k == "matching"}}
    return Wall(mesh.points[used], number.reshape(every.shape), np.concatenate(tags), template, mesh.planes, info)
