"""A swept mesh of linear elements in, the same of quadratic ones out: mid-side nodes on the smooth surfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femprep.elements import ELEMENTS
from femprep.errors import StageError
from femprep.model import FloatArray, IntArray, VolumeMesh
from femprep.template.matched import MatchedSurfaces
from femprep.volume.measures import element_measures

_QUADRATIC = {"tetra": "tetra10", "wedge": "wedge15", "hexahedron": "hexahedron20"}
_FACETS = {"triangle": "triangle6", "quad": "quad8"}
#: Rounds of straightening: an element that was sound may not be with a neighbour's edge straight.
_ROUNDS = 8


def quadratic(mesh: VolumeMesh, matched: MatchedSurfaces, depth: FloatArray) -> VolumeMesh:
    """Add mid-side nodes to a swept mesh.

    The middle of an edge on the endocardium or the epicardium lies on the smooth surface, that of a rim edge also in
    its plane; inside the wall the middle lies on the straight line between those two, at the mean depth of the edge's
    ends. Where an element's Jacobian is not positive at a corner, the centre or a quadrature point, its edges
    are made straight, and counted.

    Parameters
    ----------
    mesh : VolumeMesh
        One block of linear elements, as swept.
    matched : MatchedSurfaces
        What it was swept between.
    depth : (layers + 1,) array
        Depths of the layers.

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
    ((name, cells),) = mesh.cells.items()
    kind, total, count = ELEMENTS[name], len(mesh.points), len(matched.inner)
    ends = np.sort(cells[:, np.array(kind.edges)].reshape(-1, 2), axis=1)
    key, place = np.unique(ends[:, 0] * total + ends[:, 1], return_inverse=True)
    one, two = key // total, key % total
    middle = total + place.reshape(len(cells), -1)
    full = np.concatenate([cells, middle], axis=1)

    pair = np.sort(np.stack([one % count, two % count], axis=1), axis=1)
    share = 0.5 * (depth[one // count] + depth[two // count])
    across, which = np.unique(pair[:, 0] * count + pair[:, 1], return_inverse=True)
    straight, curved = _template_middles(matched, np.stack([across // count, across % count], axis=1))
    used = np.zeros(len(across), dtype=bool)
    points = np.empty((total + len(key), 3))
    points[:total] = mesh.points
    upright = pair[:, 0] == pair[:, 1]
    for _ in range(_ROUNDS):
        ways = np.where(used[None, :, None], straight, curved)
        points[total:] = ways[0, which] + share[:, None] * (ways[1, which] - ways[0, which])
        points[total:][upright] = 0.5 * (mesh.points[one[upright]] + mesh.points[two[upright]])
        _flatten(points, total, pair, matched)
        bad = element_measures(points, full, _QUADRATIC[name])["relative_jacobian"] <= 0.0
        if not bad.any():
            break
        used[which[place.reshape(len(cells), -1)[bad].ravel()]] = True
    else:
        raise StageError(f"{int(bad.sum())} quadratic elements stay inverted after their edges were made straight")
    facets = {
        _FACETS[facet]: np.concatenate([nodes, _facet_middles(nodes, key, total)], axis=1)
        for facet, nodes in mesh.facets.items()
    }
    added = {
        "transmural": share,
        "thickness": 0.5 * (mesh.point_data["thickness"][one] + mesh.point_data["thickness"][two]),
        "template": np.full(len(key), -1, dtype=np.int32),
    }
    return replace(
        mesh,
        points=points,
        cells={_QUADRATIC[name]: full},
        facets=facets,
        point_data={k: np.concatenate([mesh.point_data[k], v]) for k, v in added.items()},
        info={
            **mesh.info,
            "element": _QUADRATIC[name],
            "straightened": int(np.count_nonzero(used & (across // count != across % count))),
        },
    )


def _template_middles(matched: MatchedSurfaces, pairs: IntArray) -> tuple[FloatArray, FloatArray]:
    """Middles of template edges on both surfaces, ``(2, e, 3)``: straight ones, and those on the smooth surfaces."""
    kind = matched.cup.rim
    flat = np.where((kind[pairs[:, 0]] == kind[pairs[:, 1]]), kind[pairs[:, 0]], 0)
    planes = np.array([[*plane.normal, plane.offset] for plane in matched.planes.values()])
    straight, curved = [], []
    for points, surface in ((matched.inner, matched.inner_surface), (matched.outer, matched.outer_surface)):
        middle = 0.5 * (points[pairs[:, 0]] + points[pairs[:, 1]])
        straight.append(middle)
        curved.append(surface.settle(middle, None, flat, planes)[0])
    return np.array(straight), np.array(curved)


def _flatten(points: FloatArray, total: int, pair: IntArray, matched: MatchedSurfaces) -> None:
    """Take the rounding of rim edges' middles away, so that they lie in their plane to the last digit."""
    kind = matched.cup.rim
    flat = np.where(kind[pair[:, 0]] == kind[pair[:, 1]], kind[pair[:, 0]], 0)
    for number, plane in enumerate(matched.planes.values(), 1):
        rows = total + np.flatnonzero(flat == number)
        points[rows] -= plane.signed_distance(points[rows])[:, None] * plane.normal


def _facet_middles(nodes: IntArray, key: IntArray, total: int) -> IntArray:
    """Mid-side nodes of facets ``(f, p)``, that of side i between corners i and i + 1."""
    one, two = nodes, np.roll(nodes, -1, axis=1)
    wanted = np.minimum(one, two) * total + np.maximum(one, two)
    return np.asarray(total + np.searchsorted(key, wanted), dtype=np.int64)
