"""A volume mesh to an LS-DYNA keyword file (``.k``): nodes, elements with fibres, parts, sets and segments."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.export.content import Content
from femprep.export.deck.fibres import directions, segments
from femprep.export.deck.fields import user_fields
from femprep.export.deck.names import facet_names, facet_nodes, region_names
from femprep.export.deck.springs import RING, ring_nodes
from femprep.export.deck.text import number
from femprep.export.deck.units import UNITS
from femprep.export.lsdyna.springs import NUMBER, springs
from femprep.export.purkinje import PURKINJE, trees
from femprep.export.verdict import verdict_comments
from femprep.mesh.elements import ELEMENTS
from femprep.model import IntArray, PurkinjeNet, VolumeMesh
from femprep.model.blocks import block_rows, chosen_rows
from femprep.options import ExportOptions

#: Which of our nodes fill the eight places of a linear solid: a wedge is a hexahedron with two edges drawn together,
#: a tetrahedron repeats its last node (Keyword User's Manual I, *ELEMENT_SOLID).
PLACES: Final = {
    "tetra": (0, 1, 2, 3, 3, 3, 3, 3),
    "wedge": (1, 0, 3, 4, 2, 2, 5, 5),
    "hexahedron": (0, 1, 2, 3, 4, 5, 6, 7),
    "tetra10": (0, 1, 2, 3, 4, 5, 6, 7, 8, 9),
}
#: Element formulations: one-point nodal-pressure tetrahedron, ten-node tetrahedron, pentahedron, fully integrated
#: hexahedron.
FORMULATIONS: Final = {"tetra": 13, "tetra10": 16, "wedge": 15, "hexahedron": 2}
#: Their integration points.
_POINTS: Final = {"tetra": 1, "tetra10": 4, "wedge": 2, "hexahedron": 8}

#: Element formulation of beams that only pull, their cross-section, mm2, and the number of the set of their junctions.
TRUSS: Final = 3
BEAM_AREA: Final = 0.01
JUNCTIONS: Final = 200


def require(content: Content, options: ExportOptions) -> None:
    """Refuse elements that LS-DYNA does not know.

    Raises
    ------
    InputError
        There are elements of 15 or 20 nodes.
    """
    unknown = [kind for kind in content.elements if kind not in PLACES]
    if unknown:
        raise InputError(
            f"the LS-DYNA file holds no elements of type {', '.join(unknown)}; write linear elements or tetra10"
        )


def write(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write ``stem.k``, to be included in a deck that adds materials and loads.

    A part for each region and element type; its material number is the region tag. ``*SET_NODE_LIST`` and
    ``*SET_SEGMENT`` for each facet tag, numbered by it; ``*SET_SOLID`` for each region (numbered by its tag) and AHA
    segment (1000 + segment). Fibre and sheet stand with each element (``*ELEMENT_SOLID_ORTHO``: a and d). Segments
    of quadratic facets have their corners, as LS-DYNA wants.

    Purkinje fibres are beams (trusses) of one part for each endocardium, whose material number is the facet tag; they
    end in nodes of the wall, which ``*SET_NODE_LIST`` 200 names. Springs of the pericardium are a part with a material,
    ``*SET_NODE_LIST`` 201 is the basal ring. Fields that the user gave the elements are initial history variables
    (``*INITIAL_FIELD_SOLID``), in the order that a comment names; there is no such card for nodes.

    The mesh has no elements of 15 or 20 nodes, see :func:`require`.
    """
    with (folder / f"{stem}.k").open("w", encoding="ascii", errors="replace", newline="\n") as file:
        file.writelines(_deck(mesh, options))


def _deck(mesh: VolumeMesh, options: ExportOptions) -> Iterator[str]:
    units = UNITS[options.length_unit]
    yield f"*KEYWORD\n$ femprep volume mesh; {units.line}\n" + verdict_comments(mesh, "$")
    yield "*TITLE\nfemprep volume mesh\n"
    points = mesh.points * units.per_mm
    yield "*NODE\n$#   nid               x               y               z\n"
    yield "".join(f"{i:8d}{_wide(x)}{_wide(y)}{_wide(z)}\n" for i, (x, y, z) in enumerate(points.tolist(), start=1))
    part = np.empty(mesh.n_cells, dtype=np.int64)
    count = 0
    for section, (kind, _, own) in enumerate(block_rows(mesh.cells), start=1):
        yield f"*SECTION_SOLID\n{section:10d}{FORMULATIONS[kind]:10d}\n"
        for name, tag in region_names(mesh).items():
            if np.any(mesh.region[own] == tag):
                count += 1
                part[own][mesh.region[own] == tag] = count
                title = name if len(mesh.cells) == 1 else f"{name} {kind}"
                yield f"*PART\n{title}\n{count:10d}{section:10d}{tag:10d}\n"
    yield from _elements(mesh, part)
    if mesh.purkinje is not None:
        yield from _beams(mesh, mesh.purkinje, count, units.per_mm)
        count += len(trees(mesh, mesh.purkinje))
    yield from springs(mesh, options, count + 1, len(mesh.cells) + 2)
    yield from _initial_fields(mesh)
    sets = {tag: (name, np.flatnonzero(mesh.region == tag)) for name, tag in region_names(mesh).items()}
    sets |= {1000 + int(name[4:]): (name, rows) for name, rows in segments(mesh).items()}
    for number_, (name, rows) in sets.items():
        yield f"*SET_SOLID_TITLE\n{name}\n{number_:10d}\n{_eights(rows + 1)}"
    for name, tag in facet_names(mesh).items():
        yield f"*SET_NODE_LIST_TITLE\n{name}\n{tag:10d}\n{_eights(facet_nodes(mesh, tag) + 1)}"
        yield f"*SET_SEGMENT_TITLE\n{name}\n{tag:10d}\n{_segments(mesh, tag)}"
    if (ring := ring_nodes(mesh)).size:
        yield f"*SET_NODE_LIST_TITLE\n{RING}\n{NUMBER:10d}\n{_eights(ring + 1)}"
    yield "*END\n"


def _elements(mesh: VolumeMesh, part: IntArray) -> Iterator[str]:
    found = directions(mesh)
    for kind, block, own in block_rows(mesh.cells):
        yield f"*ELEMENT_SOLID{'_ORTHO' if found else ''}\n"
        nodes = block[:, list(PLACES[kind])] + 1
        # Ten nodes need a card of their own; up to eight stand behind the element's and the part's number.
        two = ELEMENTS[kind].quadratic
        lines = [
            f"{e:8d}{p:8d}{chr(10) if two else ''}{''.join(f'{n:8d}' for n in row)}\n"
            for e, p, row in zip(range(own.start + 1, own.stop + 1), part[own].tolist(), nodes.tolist())
        ]
        if found is not None:
            fiber, sheet = (v[own].tolist() for v in found)
            lines = [
                f"{line}{''.join(map(_wide, a))}\n{''.join(map(_wide, d))}\n" for line, a, d in zip(lines, fiber, sheet)
            ]
        yield "".join(lines)


def _initial_fields(mesh: VolumeMesh) -> Iterator[str]:
    """Components of the user's fields at each integration point, eight in a line."""
    columns = [column for field in user_fields(mesh)[0] for column in field.columns()]
    if not columns:
        return
    yield f"$ femprep fields of elements: {', '.join(name for name, _ in columns)}\n*INITIAL_FIELD_SOLID\n"
    table = np.column_stack([values for _, values in columns]).astype(np.float64)
    for kind, _, own in block_rows(mesh.cells):
        for element, row in enumerate(table[own].tolist(), start=own.start + 1):
            texts = [f"{number(value, 10):>10}" for value in row]
            cards = "".join("".join(texts[i : i + 8]) + "\n" for i in range(0, len(texts), 8))
            yield f"{element:10d}{_POINTS[kind]:10d}{len(row):10d}\n{cards * _POINTS[kind]}"


def _beams(mesh: VolumeMesh, net: PurkinjeNet, parts: int, per_mm: float) -> Iterator[str]:
    """Purkinje fibres: nodes of their own behind those of the wall, their junctions being nodes of the wall."""
    label = np.where(net.mesh_point >= 0, net.mesh_point + 1, 0)
    own = np.flatnonzero(net.mesh_point < 0)
    label[own] = len(mesh.points) + 1 + np.arange(len(own))
    section = len(mesh.cells) + 1
    yield f"$ femprep Purkinje fibres; conduction {net.speed!r} m/s\n*NODE\n"
    places = (net.points[own] * per_mm).tolist()
    yield "".join(f"{i:8d}{_wide(x)}{_wide(y)}{_wide(z)}\n" for i, (x, y, z) in zip(label[own].tolist(), places))
    yield f"*SECTION_BEAM\n{section:10d}{TRUSS:10d}\n{number(BEAM_AREA * per_mm**2, 10):>10}\n"
    edges = label[net.edges]
    for part, (name, (tag, rows)) in enumerate(trees(mesh, net).items(), start=parts + 1):
        yield f"*PART\n{name}\n{part:10d}{section:10d}{tag:10d}\n*ELEMENT_BEAM\n"
        yield "".join(f"{mesh.n_cells + 1 + e:8d}{part:8d}{a:8d}{b:8d}\n" for e, (a, b) in zip(rows, edges[rows]))
    junctions = np.unique(net.mesh_point[net.junctions]) + 1
    yield f"*SET_NODE_LIST_TITLE\n{PURKINJE}_junctions\n{JUNCTIONS:10d}\n{_eights(junctions)}"


def _segments(mesh: VolumeMesh, tag: int) -> str:
    lines = []
    for kind, nodes in chosen_rows(mesh.facets, mesh.facet_tag == tag).items():
        places = [0, 1, 2, 2] if kind.startswith("triangle") else [0, 1, 2, 3]
        lines += ["".join(f"{n:10d}" for n in row) + "\n" for row in (nodes[:, places] + 1).tolist()]
    return "".join(lines)


def _eights(values: IntArray) -> str:
    texts = [f"{n:10d}" for n in values.tolist()]
    return "".join("".join(texts[i : i + 8]) + "\n" for i in range(0, len(texts), 8))


def _wide(value: float) -> str:
    """A float in a field of 16 characters."""
    return f"{number(value, 16):>16}"
