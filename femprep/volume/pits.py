"""Tetrahedra of a wall in, the same out with pits filled that reach through it to its other surface in a single point.

Where a wall is thinner than edges are long, the mesher may draw a vertex of one surface through it onto a vertex of the
other: the wall has no thickness in that point, and its boundary is no 2-manifold. The pit is as deep as the wall is
thick, and its bottom one fan of triangles: a vertex put back onto the surface, and a tetrahedron on each, fill it.
"""

from __future__ import annotations

import numpy as np

from femprep.mesh.elements import boundary_faces
from femprep.mesh.measures.volume_elements import element_volumes
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import edge_table, pinched_vertices
from femprep.model import FloatArray, IntArray, Notice, Wall


def without_pits(points: FloatArray, cells: IntArray, wall: Wall) -> tuple[FloatArray, IntArray, int]:
    """Fill each pit whose bottom is a single vertex of the surface opposite; others are left.

    Parameters
    ----------
    points : (n, 3) array
        mm.
    cells : (m, 4) array
        Positive tetrahedra.
    wall : Wall
        What they fill.

    Returns
    -------
    points : (n + k, 3) array
    cells : (m + j, 4) array
    count : int
        Pits filled, k.
    """
    facets = boundary_faces({"tetra": cells})["triangle"].nodes
    bottoms = pinched_vertices(facets, edge_table(facets)).tolist()
    added: list[FloatArray] = []
    blocks = [cells]
    for bottom in bottoms:
        top = len(points) + len(added)
        fan = _pit(points, cells, facets[(facets == bottom).any(axis=1)], bottom, wall)
        if fan is None:
            continue
        place, triangles = fan
        filling = np.column_stack([triangles, np.full(len(triangles), top)])
        if (element_volumes(np.concatenate([points, *added, place[None]]), filling, "tetra") > 0.0).all():
            added.append(place[None])
            blocks.append(filling)
    if not added:
        return points, cells, 0
    return np.concatenate([points, *added]), np.concatenate(blocks), len(added)


def pit_notice(points: FloatArray, count: int) -> Notice:
    """What is said of pits that were filled, whose vertices are the last ones of some points."""
    what = "1 pit" if count == 1 else f"{count} pits"
    words = f"{what} of the mesh reached through the wall to its other surface in a point, and was filled"
    return Notice.of("repaired", words, place=points[-1])


def _pit(
    points: FloatArray, cells: IntArray, around: IntArray, bottom: int, wall: Wall
) -> tuple[FloatArray, IntArray] | None:
    """Of the triangles at a vertex, those of the surface that it does not lie on, and its place on that one."""
    star = cells[(cells == bottom).any(axis=1)]
    fans = groups_around(around, {bottom}, 1)
    if len(fans) != 2 or len(groups_around(star, {bottom}, 2)) != 1:
        return None
    near = ClosestFinder(wall.points, wall.triangles)
    found = []
    for rows in fans:
        outer = points[np.setdiff1d(around[rows], bottom)]
        names, count = np.unique(wall.facet_tag[near(outer).triangle], return_counts=True)
        own = wall.facet_tag == names[np.argmax(count)]
        foot = ClosestFinder(wall.points, wall.triangles[own])(points[bottom][None])
        found.append((float(foot.distance[0]), foot.points[0], around[rows]))
    deep, place, triangles = max(found, key=lambda one: one[0])
    return (place, triangles) if deep > 0.0 else None


def groups_around(cells: IntArray, centre: set[int], shared: int) -> list[list[int]]:
    """Rows of cells that hang together by so many nodes besides those of a centre they all have, one to the next."""
    others = [set(row) - centre for row in cells.tolist()]
    left, groups = set(range(len(cells))), []
    while left:
        group, open_rows = [], [min(left)]
        left.discard(open_rows[0])
        while open_rows:
            row = open_rows.pop()
            group.append(row)
            beside = {other for other in left if len(others[row] & others[other]) >= shared}
            left -= beside
            open_rows += sorted(beside)
        groups.append(sorted(group))
    return groups
