"""Tetrahedra in a wall in, ten-node tetrahedra out whose boundary lies on the smooth surfaces the wall was made of.

The wall's triangles are flat, the surfaces they were fitted to are not. Each endo- or epicardial sheet becomes a
smooth surface through its vertices; corners on the sheet move onto it, by little, and the middles of its edges lie on
it. Rims stay in their planes, planes flat, creases where two sheets meet straight.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from femprep.mesh.quadratic import add_middles, number_edges
from femprep.model import FloatArray, Notice, VolumeMesh, Wall, noted
from femprep.volume.refine.boundary import moved_onto
from femprep.volume.refine.sheets import Membership, Sheets, find_sheets, membership, placed


def quadratic_tetrahedra(mesh: VolumeMesh, wall: Wall) -> VolumeMesh:
    """Make the tetrahedra of a wall quadratic.

    Parameters
    ----------
    mesh : VolumeMesh
        One block ``"tetra"`` with tagged triangles, whatever their tags.
    wall : Wall
        What it fills.

    Returns
    -------
    VolumeMesh
        One block ``"tetra10"``. ``info["quadratic"]`` tells how far corners moved and how many edges are curved and
        how many were made straight because an element would be inverted.

    Raises
    ------
    StageError
        An element is inverted also when straight.
    """
    sheets = find_sheets(mesh, wall)
    on = membership(mesh.facets, sheets.of_facet, sheets)
    moved = moved_onto(mesh.points, on.nodes, _on_sheets(mesh.points[on.nodes], on, sheets), mesh.cells)[0]
    linear = replace(mesh, points=moved)
    edges = number_edges(linear)
    middle = 0.5 * (moved[edges.ends[:, 0]] + moved[edges.ends[:, 1]])
    corners = mesh.facets["triangle"]
    sides = {"triangle": edges.find(corners, np.roll(corners, -1, axis=1))}
    on = membership(sides, sheets.of_facet, sheets)
    curved = middle.copy()
    curved[on.nodes] = _on_sheets(middle[on.nodes], on, sheets)
    result, straight = add_middles(linear, edges, curved)
    bent = np.linalg.norm(curved - middle, axis=1) > 0.0
    record: dict[str, Any] = {
        "corners_moved_mm": float(np.linalg.norm(moved - mesh.points, axis=1).max()),
        "curved_edges": int(bent.sum()) - len(straight),
        "straightened_edges": len(straight),
    }
    info = {**mesh.info, "quadratic": record}
    if len(straight):
        words = (
            f"{{amount}} of {int(bent.sum())} curved ones of quadratic elements were made straight, so that no element "
            "is inverted or poor"
        )
        info = noted(info, Notice.of("repaired", words, amount=len(straight), unit="edges"))
    return replace(result, info=info)


def _on_sheets(points: FloatArray, on: Membership, sheets: Sheets) -> FloatArray:
    """Points of one smooth sheet on it, those of its rims in their planes too; all others stay."""
    return placed(points, on, sheets, ~on.other & (on.smooth >= 0))
