"""A swept mesh of linear elements in, the same of quadratic ones out: mid-side nodes on the smooth surfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femprep.mesh.patches import PatchSurface, plane_table
from femprep.mesh.quadratic import add_middles, number_edges
from femprep.model import FloatArray, IntArray, Notice, VolumeMesh, noted
from femprep.sweeping.cup.matched import MatchedSurfaces


def quadratic(mesh: VolumeMesh, matched: MatchedSurfaces, depth: FloatArray) -> VolumeMesh:
    """Add mid-side nodes to a swept mesh.

    The middle of an edge on the endocardium or the epicardium lies on the smooth surface, that of a rim edge also in
    its plane; inside the wall the middle bulges by what those two do, weighed by the mean depth of the edge's ends.
    Where an element would be inverted, the edges over its template edges are made straight in all layers, and counted.

    Parameters
    ----------
    mesh : VolumeMesh
        One block of linear elements, as swept.
    matched : MatchedSurfaces
        What it was swept between.
    depth : ((layers + 1) V,) array
        Depth of each point, from 0 to 1.

    Returns
    -------
    VolumeMesh
        Mid-side nodes follow the corners, in the order of their ends' numbers. ``info["straightened"]`` tells how many
        edges of the template were made straight.

    Raises
    ------
    StageError
        An element stays inverted also when straight.
    """
    count = len(matched.inner)
    edges = number_edges(mesh)
    one, two = edges.ends.T
    pair = np.sort(edges.ends % count, axis=1)
    share = 0.5 * (depth[one] + depth[two])
    rim = matched.cup.rim[pair]
    flat = np.where(rim[:, 0] == rim[:, 1], rim[:, 0], 0)
    across, first, which = np.unique(pair[:, 0] * count + pair[:, 1], return_index=True, return_inverse=True)
    which = which.ravel()
    pairs, planes = np.stack([across // count, across % count], axis=1), plane_table(matched.planes.values())
    inner = _bulges(mesh.points[:count], matched.inner_surface, pairs, flat[first], planes)
    outer = _bulges(mesh.points[-count:], matched.outer_surface, pairs, flat[first], planes)
    curved = 0.5 * (mesh.points[one] + mesh.points[two])
    curved += (1.0 - share)[:, None] * inner[which] + share[:, None] * outer[which]
    # So that the middles of rim edges lie in their plane to the last digit.
    for number, plane in enumerate(matched.planes.values(), 1):
        curved[flat == number] = plane.feet(curved[flat == number])
    added = {
        "transmural": share,
        "thickness": 0.5 * (mesh.point_data["thickness"][one] + mesh.point_data["thickness"][two]),
        "template": np.full(len(pair), -1),
    }
    result, straight = add_middles(mesh, edges, curved, together=which, point_data=added)
    ((name, _),) = result.cells.items()
    straightened = len(np.unique(which[straight]))
    info = {**mesh.info, "element": name, "straightened": straightened}
    if straightened:
        words = (
            "{amount} of the template were made straight in all layers of quadratic elements, so that no element is "
            "inverted or poor"
        )
        info = noted(info, Notice.of("repaired", words, amount=straightened, unit="edges"))
    return replace(result, info=info)


def _bulges(
    points: FloatArray, surface: PatchSurface, pairs: IntArray, flat: IntArray, planes: FloatArray
) -> FloatArray:
    """How far the middles of template edges on a smooth surface lie from the straight ones, mm."""
    straight = 0.5 * (points[pairs[:, 0]] + points[pairs[:, 1]])
    bulge = surface.settle(straight, None, flat, planes)[0] - straight
    bulge[pairs[:, 0] == pairs[:, 1]] = 0.0
    return bulge
