"""Surfaces, walls and tagged facets in, VTK polygons out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from femprep.export.deck.names import facet_names
from femprep.export.vtk.xml import add_arrays, add_record, vtk_cells, vtk_points
from femprep.mesh.elements import FACET_CORNERS, match_facets
from femprep.model import Plane, Surface, VolumeMesh, Wall, tag_name
from femprep.model.blocks import nodes_of


def planes_record(planes: Mapping[str, Plane]) -> dict[str, Any]:
    """Planes as a JSON-ready mapping."""
    return {
        name: {"point": plane.point.tolist(), "normal": plane.normal.tolist(), "source": plane.source}
        for name, plane in planes.items()
    }


def planes_from(record: Mapping[str, Any]) -> dict[str, Plane]:
    """Planes of such a mapping."""
    return {name: Plane(**{k: entry[k] for k in ("point", "normal", "source")}) for name, entry in record.items()}


def polydata(points: np.ndarray, blocks: list[np.ndarray]) -> Any:
    """VTK polygons of several blocks of node numbers."""
    from vtkmodules.vtkCommonDataModel import vtkPolyData

    out = vtkPolyData()
    out.SetPoints(vtk_points(points))
    out.SetPolys(vtk_cells(blocks))
    return out


def surface_polydata(surface: Surface) -> Any:
    """A closed surface with its point data, ``direction`` and record."""
    out = polydata(surface.points, [surface.cells])
    add_arrays(out.GetPointData(), surface.point_data, "point data")
    if surface.directions is not None:
        add_arrays(out.GetPointData(), {"direction": surface.directions}, "point data")
    add_record(out, {"name": surface.name, "info": dict(surface.info)})
    return out


def wall_polydata(wall: Wall) -> Any:
    """A wall with ``facet_tag`` per triangle, ``template`` per point, tags by name and its planes."""
    out = polydata(wall.points, [wall.triangles])
    add_arrays(out.GetCellData(), {"facet_tag": wall.facet_tag}, "cell data")
    add_arrays(out.GetPointData(), {"template": wall.template}, "point data")
    names = {tag_name(int(tag)): int(tag) for tag in np.unique(wall.facet_tag)}
    add_arrays(out.GetFieldData(), {name: np.array([tag, 2], np.int32) for name, tag in names.items()}, "field data")
    add_record(out, {"planes": planes_record(wall.planes), "info": dict(wall.info)})
    return out


def facets_polydata(mesh: VolumeMesh) -> Any:
    """The tagged facets of a mesh: tag and owning element of each, and which point of the mesh each point is."""
    blocks = {kind: block[:, : FACET_CORNERS[kind]] for kind, block in mesh.facets.items()}
    used = nodes_of(blocks)
    out = polydata(mesh.points[used], [np.searchsorted(used, block) for block in blocks.values()])
    element, _ = match_facets(mesh.cells, mesh.facets)
    cell = {"facet_tag": mesh.facet_tag, "GlobalElementID": element + 1, **mesh.facet_data}
    point = {"GlobalNodeID": used + 1, **{name: np.asarray(values)[used] for name, values in mesh.point_data.items()}}
    add_arrays(out.GetCellData(), cell, "facet data")
    add_arrays(out.GetPointData(), point, "point data")
    names = facet_names(mesh)
    add_arrays(out.GetFieldData(), {name: np.array([tag, 2], np.int32) for name, tag in names.items()}, "field data")
    add_record(out, {"planes": planes_record(mesh.planes)})
    return out
