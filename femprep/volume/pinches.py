"""Tetrahedra of a wall in, the same out without the few that hang on the others by an edge alone.

In a groove of the wall that is sharper than elements, the mesher now and then keeps an element too many between its
sides: four boundary facets then meet in an edge, and the boundary is no 2-manifold there.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.mesh.elements import boundary_faces
from femprep.mesh.measures.volume_elements import element_volumes
from femprep.mesh.topology import edge_table, pinched_vertices
from femprep.model import FloatArray, IntArray, Notice
from femprep.volume.pits import groups_around

#: Edges that are mended at most: with more of them the mesh is another one than the wall's.
_MOST: Final = 5


def without_pinches(points: FloatArray, cells: IntArray) -> tuple[IntArray, FloatArray]:
    """Take elements away at each edge where the boundary touches itself: the least volume that does.

    Two groups of elements meet in such an edge, or more of them in one of its ends. Where none that is taken away
    leaves fewer such edges and vertices, the mesh stays as it is.

    Parameters
    ----------
    points : (n, 3) array
        mm.
    cells : (m, 4) array
        Positive tetrahedra.

    Returns
    -------
    cells : (m - k, 4) array
    places : (j, 3) array
        Middles of the edges, mm.
    """
    places: list[FloatArray] = []
    edges, faults = _faults(cells)
    while len(edges) > 0 and faults <= _MOST:
        better: list[tuple[float, int, IntArray, IntArray, FloatArray]] = []
        for edge in edges:
            for rows in _groups(cells, edge):
                fewer = np.delete(cells, rows, axis=0)
                left, count = _faults(fewer)
                if count < faults:
                    volume = float(element_volumes(points, cells[rows], "tetra").sum())
                    better.append((volume, count, left, fewer, points[edge].mean(axis=0)))
        if not better:
            break
        _, faults, edges, cells, place = min(better, key=lambda one: one[0])
        places.append(place)
    return cells, np.array(places).reshape(-1, 3)


def pinch_notice(places: FloatArray) -> Notice:
    """What is said of elements that were taken away."""
    where = "an edge" if len(places) == 1 else f"{len(places)} edges"
    words = f"the boundary of the mesh touched itself in {where}; elements that hung there by no face were left out"
    return Notice.of("left out", words, place=places[0])


def _faults(cells: IntArray) -> tuple[IntArray, int]:
    """Edges of the boundary with more than two facets ``(e, 2)``, and their number with that of pinched vertices."""
    facets = boundary_faces({"tetra": cells})["triangle"].nodes
    table = edge_table(facets)
    edges = table.nodes[table.count > 2]
    return edges, len(edges) + len(pinched_vertices(facets, table))


def _groups(cells: IntArray, edge: IntArray) -> list[IntArray]:
    """Rows of the groups of elements that meet in an edge, or in an end of it, by no face."""
    found = []
    for centre in ({*edge.tolist()}, {int(edge[0])}, {int(edge[1])}):
        rows = np.flatnonzero(np.isin(cells, list(centre)).sum(axis=1) == len(centre))
        groups = groups_around(cells[rows], centre, 3 - len(centre))
        found += [rows[group] for group in groups if len(groups) > 1]
    return found
