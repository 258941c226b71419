"""A volume mesh to Gmsh's ``.msh``, version 2.2 or 4.1, as text: a named physical group for every tag."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from femprep.export.deck.data import over_all
from femprep.export.deck.fields import user_fields
from femprep.export.deck.names import facet_names, region_names
from femprep.export.deck.text import lines
from femprep.export.deck.units import UNITS
from femprep.export.verdict import verdict_lines
from femprep.model import IntArray, VolumeMesh
from femprep.model.blocks import block_rows
from femprep.options import ExportOptions

#: Gmsh's element numbers, and the place in our node order of each of its mid-side nodes (Gmsh reference manual,
#: "Node ordering": the edges of a second-order element come in another order than VTK's).
GMSH_TYPES: Final[Mapping[str, tuple[int, tuple[int, ...]]]] = {
    "triangle": (2, (0, 1, 2)),
    "quad": (3, (0, 1, 2, 3)),
    "triangle6": (9, (0, 1, 2, 3, 4, 5)),
    "quad8": (16, (0, 1, 2, 3, 4, 5, 6, 7)),
    "tetra": (4, (0, 1, 2, 3)),
    "wedge": (6, (0, 1, 2, 3, 4, 5)),
    "hexahedron": (5, (0, 1, 2, 3, 4, 5, 6, 7)),
    "tetra10": (11, (0, 1, 2, 3, 4, 5, 6, 7, 9, 8)),
    "wedge15": (18, (0, 1, 2, 3, 4, 5, 6, 8, 12, 7, 13, 14, 9, 11, 10)),
    "hexahedron20": (17, (*range(8), 8, 11, 16, 9, 17, 10, 18, 19, 12, 15, 13, 14)),
}


@dataclass(frozen=True)
class _Part:
    """Elements of one type and (in version 4.1) one tag: rows of the mesh, tags, node numbers from 1."""

    dim: int
    kind: str
    row: IntArray
    tags: Any
    nodes: IntArray


def write(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write ``stem.msh``, version 2.2, which every reader knows; elements in our order, facets after them.

    meshio, through which scikit-fem and others read, stops at ``$ElementData`` of version 2.2. So fields that the user
    gave the elements are ``$ElementNodeData``, which it passes over: the same value at each node of an element. What
    femprep makes for elements stays out.
    """
    parts = _parts(mesh)
    _write(
        folder / f"{stem}.msh",
        _head("2.2", mesh, options),
        _nodes_22(mesh, options),
        _elements_22(parts),
        _node_data(mesh),
        _element_node_data(mesh),
    )


def write_41(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write ``stem.msh``, version 4.1: each tag is an entity with its physical group, elements sorted by it."""
    parts = [
        _Part(
            part.dim, part.kind, part.row[part.tags == tag], part.tags[part.tags == tag], part.nodes[part.tags == tag]
        )
        for part in _parts(mesh)
        for tag in np.unique(part.tags)
    ]
    text = _entities(mesh, parts, options), _nodes_41(mesh, parts, options), _elements_41(parts), _data(mesh, parts)
    _write(folder / f"{stem}.msh", _head("4.1", mesh, options), *text)


def _write(path: Path, *parts: Iterator[str]) -> None:
    with path.open("w", encoding="utf-8", newline="\n") as file:
        for part in parts:
            file.writelines(part)


def _head(version: str, mesh: VolumeMesh, options: ExportOptions) -> Iterator[str]:
    yield f"$MeshFormat\n{version} 0 8\n$EndMeshFormat\n"
    lines = [f"femprep volume mesh; {UNITS[options.length_unit].line}", *verdict_lines(mesh)]
    yield "$Comments\n" + "\n".join(lines) + "\n$EndComments\n"
    names = [(2, tag, name) for name, tag in facet_names(mesh).items() if tag > 0]
    names += [(3, tag, name) for name, tag in region_names(mesh).items() if tag > 0]
    yield f"$PhysicalNames\n{len(names)}\n"
    yield "".join(f'{dim} {tag} "{name}"\n' for dim, tag, name in names) + "$EndPhysicalNames\n"


def _parts(mesh: VolumeMesh) -> list[_Part]:
    parts, first = [], 0
    for dim, blocks, tags in ((3, mesh.cells, mesh.region), (2, mesh.facets, mesh.facet_tag)):
        number = first + np.arange(len(tags))
        for kind, block, own in block_rows(blocks):
            parts.append(_Part(dim, kind, number[own], tags[own], block[:, list(GMSH_TYPES[kind][1])] + 1))
        first += len(tags)
    return parts


def _entity(tag: int) -> int:
    """Number of the entity of a tag: the tag itself, which Gmsh wants positive."""
    return tag if tag > 0 else 1_000_000 - tag


def _nodes_22(mesh: VolumeMesh, options: ExportOptions) -> Iterator[str]:
    points = mesh.points * UNITS[options.length_unit].per_mm
    yield f"$Nodes\n{len(points)}\n"
    yield from lines(np.arange(1, len(points) + 1), points, separator=" ", width=None)
    yield "$EndNodes\n"


def _elements_22(parts: list[_Part]) -> Iterator[str]:
    yield f"$Elements\n{sum(len(part.row) for part in parts)}\n"
    for part in parts:
        head = np.tile([GMSH_TYPES[part.kind][0], 2], (len(part.row), 1))
        entity = np.where(part.tags > 0, part.tags, 1_000_000 - part.tags)
        yield from lines(part.row + 1, head, np.maximum(part.tags, 0), entity, part.nodes, separator=" ")
    yield "$EndElements\n"


def _entities(mesh: VolumeMesh, parts: list[_Part], options: ExportOptions) -> Iterator[str]:
    corners: dict[tuple[int, int], list[Any]] = {}
    points = mesh.points * UNITS[options.length_unit].per_mm
    for part in parts:
        used = points[np.unique(part.nodes) - 1]
        corners.setdefault((part.dim, int(part.tags[0])), []).extend([used.min(axis=0), used.max(axis=0)])
    surfaces = sum(dim == 2 for dim, _ in corners)
    yield f"$Entities\n0 0 {surfaces} {len(corners) - surfaces}\n"
    for (_, tag), found in sorted(corners.items()):
        box = " ".join(map(repr, [*np.min(found, axis=0).tolist(), *np.max(found, axis=0).tolist()]))
        yield f"{_entity(tag)} {box} {f'1 {tag}' if tag > 0 else 0} 0\n"
    yield "$EndEntities\n"


def _nodes_41(mesh: VolumeMesh, parts: list[_Part], options: ExportOptions) -> Iterator[str]:
    # One block keeps the numbering; Gmsh takes the groups of a node from its elements.
    points = mesh.points * UNITS[options.length_unit].per_mm
    volume = next((_entity(int(part.tags[0])) for part in parts if part.dim == 3), 1)
    yield f"$Nodes\n1 {len(points)} 1 {len(points)}\n3 {volume} 0 {len(points)}\n"
    yield from lines(np.arange(1, len(points) + 1))
    yield from lines(points, separator=" ", width=None)
    yield "$EndNodes\n"


def _elements_41(parts: list[_Part]) -> Iterator[str]:
    total, first = sum(len(part.row) for part in parts), 1
    yield f"$Elements\n{len(parts)} {total} 1 {total}\n"
    for part in parts:
        yield f"{part.dim} {_entity(int(part.tags[0]))} {GMSH_TYPES[part.kind][0]} {len(part.row)}\n"
        yield from lines(np.arange(first, first + len(part.row)), part.nodes, separator=" ")
        first += len(part.row)
    yield "$EndElements\n"


def _data(mesh: VolumeMesh, parts: list[_Part]) -> Iterator[str]:
    """Cell, facet and point data as views; where an array has no value (cells, or facets) it is zero."""
    order = np.concatenate([np.empty(0, dtype=np.int64), *(part.row for part in parts)])
    for name, values in over_all(mesh).items():
        yield from _view("ElementData", name, values[order])
    yield from _node_data(mesh)


def _node_data(mesh: VolumeMesh) -> Iterator[str]:
    for name, values in mesh.point_data.items():
        yield from _view("NodeData", name, np.asarray(values))


def _element_node_data(mesh: VolumeMesh) -> Iterator[str]:
    nodes = [(own, block.shape[1]) for _, block, own in block_rows(mesh.cells)]
    for field in user_fields(mesh)[0]:
        yield from _view("ElementNodeData", field.own, field.values, nodes)


def _view(section: str, name: str, values: Any, nodes: Iterable[Any] = ((slice(None), 0),)) -> Iterator[str]:
    """A row for each value; of elements in rows that are given with a number of nodes, the value at each node."""
    table = values.reshape(len(values), -1).astype(np.float64)
    # Gmsh knows scalars, vectors and tensors: anything between is filled up with zeros.
    width = next((n for n in (1, 3, 9) if n >= table.shape[1]), table.shape[1])
    table = np.pad(table, ((0, 0), (0, width - table.shape[1])))
    yield f'${section}\n1\n"{name}"\n1\n0.0\n3\n0\n{width}\n{len(table)}\n'
    for own, count in nodes:
        numbers, rows = np.arange(1, len(table) + 1)[own], np.tile(table[own], (1, max(count, 1)))
        yield from lines(numbers, *([np.full(len(rows), count)] if count else []), rows, separator=" ", width=None)
    yield f"$End{section}\n"
