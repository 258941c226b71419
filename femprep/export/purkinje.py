"""Purkinje fibres in, lines of VTK and what decks hold of them out."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from femprep.export.deck.names import facet_names
from femprep.export.vtk.xml import add_arrays, vtk_cells, vtk_points
from femprep.model import FloatArray, IntArray, PurkinjeNet, VolumeMesh

#: Formats that hold Purkinje fibres.
HOLDS: Final = ("vtu", "opencarp", "opencarp-binary", "ls-dyna")
#: What sets, parts and files of them begin with.
PURKINJE: Final = "purkinje"
#: How field data of a ``.vtu`` are called that hold them.
_FIELDS: Final = ("points", "edges", "edge_tag", "mesh_point")


def purkinje_polydata(net: PurkinjeNet) -> Any:
    """Lines, the facet tag of each; at each point its time of activation and which point of the mesh it is, from 1."""
    from vtkmodules.vtkCommonDataModel import vtkPolyData

    out = vtkPolyData()
    out.SetPoints(vtk_points(net.points))
    out.SetLines(vtk_cells([net.edges]))
    add_arrays(out.GetCellData(), {"facet_tag": net.edge_tag}, "cell data")
    number = {"GlobalNodeID": (net.mesh_point + 1).astype(np.int32)}  # 0 where it is none
    add_arrays(out.GetPointData(), {"activation": net.arrival, **number}, "point data")
    return out


def purkinje_fields(net: PurkinjeNet) -> tuple[dict[str, Any], dict[str, Any]]:
    """Field data and record that a ``.vtu`` keeps a net in."""
    fields = {f"{PURKINJE}_{name}": getattr(net, name) for name in _FIELDS}
    return fields, {PURKINJE: {"speed": net.speed, "info": dict(net.info)}}


def purkinje_from(fields: dict[str, Any], record: dict[str, Any]) -> PurkinjeNet | None:
    """The net of such field data and record; ``None`` where there is none."""
    if PURKINJE not in record:
        return None
    arrays = {name: fields[f"{PURKINJE}_{name}"] for name in _FIELDS}
    return PurkinjeNet(
        arrays["points"].reshape(-1, 3),
        arrays["edges"].reshape(-1, 2),
        arrays["edge_tag"],
        arrays["mesh_point"],
        **record[PURKINJE],
    )


def trees(mesh: VolumeMesh, net: PurkinjeNet) -> dict[str, tuple[int, IntArray]]:
    """Name of each tree, the tag of its endocardium and the rows of its edges."""
    names = {tag: name for name, tag in facet_names(mesh).items()}
    tags = dict.fromkeys(net.edge_tag.tolist())
    return {f"{PURKINJE}_{names.get(tag, tag)}": (tag, np.flatnonzero(net.edge_tag == tag)) for tag in tags}


def directions_of(net: PurkinjeNet) -> FloatArray:
    """Unit vector along each edge."""
    ends = net.points[net.edges]
    along = ends[:, 1] - ends[:, 0]
    return np.asarray(along / np.maximum(np.linalg.norm(along, axis=1), 1e-300)[:, None])
