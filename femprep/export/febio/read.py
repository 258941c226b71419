"""An FEBio model (``.feb``, version 3 or 4) in, its volume mesh out: parts, surfaces, sets, material axes."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

import numpy as np

from femprep.errors import FileError, InputError
from femprep.export.deck.fibres import segment_of
from femprep.export.deck.includes import OpenedFile
from femprep.export.deck.parts import DeckParts, require_once, rows_of_nodes
from femprep.export.deck.reals import reals
from femprep.export.deck.units import units_of
from femprep.export.deck.unread import with_element_sets, with_node_sets, with_unread
from femprep.export.febio.step import INWARD
from femprep.export.febio.write import FEBIO_FACETS, FEBIO_TYPES
from femprep.model import FloatArray, IntArray, VolumeMesh
from femprep.model.notice import Notice, noted

_KINDS: Final = {name: kind for kind, name in FEBIO_TYPES.items()}
#: What else a section may have, and what it is called.
_OTHERS: Final = {"Edge": "sets of edges", "DiscreteSet": "sets of springs"}
_FACETS: Final = {name: kind for kind, name in FEBIO_FACETS.items()}


def read(path: Path) -> VolumeMesh:
    """Read the mesh of a model.

    Parts (``Elements``) become regions by their names, surfaces tagged facets, element sets ``aha_1``, ``aha_2``... the
    AHA segments; fibres come from the ``ElementData`` of types ``mat_axis`` and ``fiber``.

    Raises
    ------
    FileError
        The file is damaged.
    InputError
        It has no nodes or volume elements, or a node that is not defined is used.
    """
    root = _root(OpenedFile(path))
    found, *more = [*root.iterfind("Mesh"), None]
    if found is None:
        raise InputError("holds no section Mesh; femprep reads FEBio's versions 3 and 4")
    if len(more) > 1:
        raise InputError("holds several sections Mesh; put them into one")
    nodes = [node for block in found.iterfind("Nodes") for node in block]
    if not nodes:
        raise InputError("holds no nodes")
    place = {int(node.get("id", "0")): i for i, node in enumerate(nodes)}
    require_once((int(node.get("id", "0")) for node in nodes), "node")
    points = reals([(node.text or "").split(",") for node in nodes], fortran=False)
    parts, numbers, regions = DeckParts(), [], dict[str, list[int]]()
    axes = _axes(root)
    for block in found.iterfind("Elements"):
        kind, name = (block.get("type") or "").lower(), block.get("name") or ""
        if kind not in _KINDS:
            parts.left_out.add(kind)
            continue
        rows = _nodes(block, place)
        own = re.sub(f"_{kind}$", "", name)
        region = parts.numbers.of(own)
        parts.cells.append((_KINDS[kind], rows, np.full(len(rows), region), axes.pop(name, {})))
        numbers.append((_KINDS[kind], [int(element.get("id", "0")) for element in block]))
        regions.setdefault(own.lower(), []).extend(numbers[-1][1])
    require_once((label for _, own in numbers for label in own), "element")
    for surface in found.iterfind("Surface"):
        if surface.get("name") == INWARD:
            continue
        by_type: dict[str, list[ElementTree.Element]] = {}
        for facet in surface:
            by_type.setdefault(facet.tag, []).append(facet)
        tag = parts.numbers.of(surface.get("name") or "", facet=True)
        parts.left_out.update(set(by_type) - set(_FACETS))
        parts.facets += [(_FACETS[t], _nodes(rows, place), tag) for t, rows in by_type.items() if t in _FACETS]
    mesh = parts.mesh(points / units_of(path).per_mm, "Elements", "Surface")
    if axes:
        words = f"directions of {', '.join(map(repr, sorted(axes)))} are left out: there are no Elements of that name"
        mesh = replace(mesh, info=noted(mesh.info, Notice.of("left out", words)))
    return _with_sets(_with_segments(mesh, found, numbers), found, place, regions)


def _with_sets(
    mesh: VolumeMesh, found: ElementTree.Element, place: dict[int, int], regions: dict[str, list[int]]
) -> VolumeMesh:
    """The mesh with words on sets of its section that are neither regions nor facets."""
    nodes = {entry.get("name") or "": _listed(entry) for entry in found.iterfind("NodeSet")}
    rows = {
        name: None if own is None or any(n not in place for n in own) else np.array([place[n] for n in own], np.int64)
        for name, own in nodes.items()
    }
    elements = {entry.get("name") or "": _listed(entry) or [-1] for entry in found.iterfind("ElementSet")}
    mesh = with_element_sets(with_node_sets(mesh, rows), "sets of elements", elements, regions)
    for tag, what in _OTHERS.items():
        mesh = with_unread(mesh, what, (entry.get("name") or "" for entry in found.iterfind(tag)))
    return mesh


def _listed(entry: ElementTree.Element) -> list[int] | None:
    """Numbers of nodes or elements of a set, of version 4 or 3; None where it has others."""
    try:
        if len(entry):
            return [int(one.get("id", "")) for one in entry]
        return [int(text) for text in (entry.text or "").split(",") if text.strip()]
    except ValueError:
        return None


def _root(opened: OpenedFile) -> ElementTree.Element:
    """A model, the sections that it takes from other files (``from=``) in their places.

    Raises
    ------
    FileError
        A file is damaged, or not there.
    """
    path = opened.path
    try:
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError as error:
        raise FileError(f"{str(path)!r} is damaged: {error}") from error
    for place, section in enumerate(root):
        if name := section.get("from"):
            found = _root(opened.take_in(name)).find(section.tag)
            if found is None:
                raise FileError(f"{str(path)!r} takes its {section.tag} from {name!r}, which has none")
            root[place] = found
    return root


def _nodes(rows: ElementTree.Element | list[ElementTree.Element], place: dict[int, int]) -> IntArray:
    """Node positions of elements or facets."""
    return rows_of_nodes((map(int, (row.text or "").split(",")) for row in rows), place)


def _axes(root: ElementTree.Element) -> dict[str, dict[str, FloatArray]]:
    """Fibre and sheet of each element set that has a vector for all its elements, in their order (``lid``)."""
    found: dict[str, dict[str, FloatArray]] = {}
    for data in root.iterfind("MeshData/ElementData"):
        name, kind = data.get("elem_set") or "", data.get("type")
        if kind not in ("mat_axis", "fiber"):
            continue
        own, rows = found.setdefault(name, {}), {int(row.get("lid", i)): row for i, row in enumerate(data, 1)}
        if len(rows) < len(data) or set(rows) != set(range(1, len(rows) + 1)):
            raise InputError(f"{kind} of {name!r} has other elements than 1 to {len(data)}, each once (lid)")
        ordered = [rows[i] for i in sorted(rows)]
        if kind == "mat_axis":
            for direction, axis in (("fiber", "a"), ("sheet", "d")):
                own[direction] = reals([(row.findtext(axis) or "").split(",") for row in ordered], fortran=False)
        else:
            own["fiber"] = reals([(row.text or "").split(",") for row in ordered], fortran=False)
    return found


def _with_segments(mesh: VolumeMesh, found: ElementTree.Element, numbers: list[tuple[str, list[int]]]) -> VolumeMesh:
    """The mesh with AHA segments, where there are such sets. Elements stand by type, as in the mesh."""
    kinds = dict.fromkeys(kind for kind, _ in numbers)
    labels = [label for kind in kinds for own, rows in numbers if own == kind for label in rows]
    place = {label: row for row, label in enumerate(labels)}
    aha = np.zeros(mesh.n_cells, dtype=np.int32)
    for entry in found.iterfind("ElementSet"):
        if segment := segment_of(entry.get("name") or ""):
            aha[[place[int(n)] for n in (entry.text or "").split(",")]] = segment
    return replace(mesh, cell_data={**mesh.cell_data, "aha": aha}) if aha.any() else mesh
