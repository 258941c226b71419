"""A mesh of wall and blood in; the same mesh with data that were found on its wall alone out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

import numpy as np

from femprep.errors import InputError
from femprep.mesh.elements import match_facets
from femprep.model import IntArray, VolumeMesh, is_blood
from femprep.model.blocks import chosen_rows
from femprep.model.used_points import on_used_points

#: Directions in blood, where none mean anything: solvers want unit vectors at right angles in every element.
_FRAME: Final = {"fiber": (1.0, 0.0, 0.0), "sheet": (0.0, 1.0, 0.0), "normal": (0.0, 0.0, 1.0)}


def on_wall(mesh: VolumeMesh, add: Callable[[VolumeMesh], VolumeMesh]) -> VolumeMesh:
    """Add data to the wall of a mesh that has blood pools; a mesh without them is handed on as it is.

    Parameters
    ----------
    mesh : VolumeMesh
    add : callable
        Takes a mesh and returns it with further data: ``add_coordinates``, ``add_aha``, ``add_fibres``.

    Returns
    -------
    VolumeMesh
        With the data of ``add``. In blood they are 0, the directions of fibres and sheets those of the coordinate axes.

    Examples
    --------
    >>> axes = fp.ventricular_axes(seg)
    >>> "aha" in fp.on_wall(mesh, lambda part: fp.add_aha(part, axes=axes)).cell_data
    True
    """
    blood = is_blood(mesh.region)
    if not blood.any():
        return add(mesh)
    part, cells, nodes, facets = part_of(mesh, ~blood)
    found = add(part)
    new = {
        "cell": spread_over(found.cell_data, part.cell_data, cells, mesh.n_cells),
        "point": spread_over(found.point_data, part.point_data, nodes, len(mesh.points)),
        "facet": spread_over(found.facet_data, part.facet_data, facets, mesh.n_facets),
    }
    return replace(mesh.with_data(**new), info=found.info)


def refuse_blood(mesh: VolumeMesh) -> None:
    """Refuse a mesh with blood pools where the wall alone is meant.

    Raises
    ------
    InputError
    """
    if is_blood(mesh.region).any():
        raise InputError(
            "the mesh has blood pools, where coordinates, segments and fibres mean nothing; add them to its wall by "
            "on_wall(mesh, add_fibres)"
        )


def part_of(mesh: VolumeMesh, tissue: np.ndarray) -> tuple[VolumeMesh, IntArray, IntArray, IntArray]:
    """Some elements as a mesh of their own; and which elements, points and facets of the whole it is made of."""
    owner, _ = match_facets(mesh.cells, mesh.facets)
    face = (owner >= 0) & tissue[owner]
    cells, facets = chosen_rows(mesh.cells, tissue), chosen_rows(mesh.facets, face)
    fields, number = on_used_points(mesh, cells, facets)
    part = VolumeMesh(
        region=mesh.region[tissue],
        facet_tag=mesh.facet_tag[face],
        cell_data={name: values[tissue] for name, values in mesh.cell_data.items()},
        facet_data={name: values[face] for name, values in mesh.facet_data.items()},
        planes={name: plane for name, plane in mesh.planes.items() if not name.startswith("cap_")},
        info=mesh.info,
        **fields,
    )
    return part, np.flatnonzero(tissue), np.flatnonzero(number >= 0), np.flatnonzero(face)


def spread_over(found: Any, before: Any, rows: IntArray, count: int) -> dict[str, np.ndarray]:
    """New data of some rows, over all rows."""
    out = {}
    for name, values in found.items():
        if name in before:
            continue
        whole = np.zeros((count, *values.shape[1:]), dtype=values.dtype)
        whole[...] = _FRAME.get(name, 0)
        whole[rows] = values
        out[name] = whole
    return out
