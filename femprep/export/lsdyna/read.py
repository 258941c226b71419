"""An LS-DYNA keyword file (``.k``, fixed columns) in, its solid elements out: parts, segments, sets, fibres."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.export.deck.fibres import segment_of
from femprep.export.deck.parts import DeckParts, require_once, rows_of_nodes, with_mid_side_nodes
from femprep.export.deck.units import units_of
from femprep.export.deck.unread import with_element_sets, with_node_sets, with_unread
from femprep.export.lsdyna.deck import KeywordDeck, integers_of, parse
from femprep.export.lsdyna.write import PLACES
from femprep.export.purkinje import PURKINJE
from femprep.model import IntArray, PurkinjeNet, VolumeMesh
from femprep.model.notice import Notice, noted

#: Places that repeat a node, by element type: which type an element of eight places is.
_REPEATED: Final = {"tetra": ((3, 4), (3, 5), (3, 6), (3, 7)), "wedge": ((4, 5), (6, 7)), "hexahedron": ()}


def read(path: Path) -> VolumeMesh:
    """Read the solid elements of a keyword file, as femprep writes it: no comma-separated or long cards.

    Parts become regions by their titles, segment sets tagged facets by theirs or their numbers, sets of solids
    ``aha_1``, ``aha_2``... the AHA segments; ``*ELEMENT_SOLID_ORTHO`` gives fibre (a) and sheet (d). Beams of parts
    titled ``purkinje_...`` are Purkinje fibres.

    Raises
    ------
    FileError
        The file is damaged, or not in columns.
    InputError
        It holds no solid elements.
    """
    deck, scale = parse(path), units_of(path).per_mm
    if not deck.solids:
        raise InputError("holds no solid elements")
    _require_once(deck)
    names, parts = deck.names, DeckParts(left_out=deck.left_out)
    fibres = [beam for beam in deck.beams if names.get(beam[1], "").startswith(f"{PURKINJE}_")]
    if len(fibres) < len(deck.beams):
        parts.left_out.add("*ELEMENT_BEAM")
    at, wall = dict(deck.nodes), {label for solid in deck.solids for label in solid.nodes}
    place = {label: i for i, label in enumerate(label for label in at if not fibres or label in wall)}
    _add_solids(parts, deck, names, place)
    _add_segments(parts, deck, place)
    mesh = parts.mesh(np.array([at[label] for label in place]) / scale, "*PART", "*SET_SEGMENT")
    mesh = _with_sets(mesh, deck, names, place)
    if not deck.ended:
        words = "the deck has no *END, and was read to the end of the file: whether it is cut short cannot be told"
        mesh = replace(mesh, info=noted(mesh.info, Notice.of("assumed", words)))
    if not fibres:
        return mesh
    chambers = [names[beam[1]].removeprefix(f"{PURKINJE}_") for beam in fibres]
    tag = np.array([parts.numbers.of(name, facet=True) for name in chambers], dtype=np.int32)
    labels, edges = np.unique(np.array([beam[2:4] for beam in fibres], dtype=np.int64), return_inverse=True)
    points = np.array([at[label] for label in labels.tolist()]) / scale
    ends = np.array([place[label] if label in wall else -1 for label in labels.tolist()], dtype=np.int64)
    speed = {} if deck.speed is None else {"speed": float(deck.speed)}
    return replace(mesh, purkinje=PurkinjeNet.numbered(points, edges.reshape(-1, 2), tag, ends, **speed))


def _require_once(deck: KeywordDeck) -> None:
    """Nodes and elements are defined once; a node the same again is no harm."""
    require_once((label for label, _ in dict.fromkeys((label, tuple(xyz)) for label, xyz in deck.nodes)), "node")
    require_once((solid.label for solid in deck.solids), "element")


def _with_sets(mesh: VolumeMesh, deck: KeywordDeck, names: dict[int, str], place: dict[int, int]) -> VolumeMesh:
    """The mesh with sets of nodes; sets of solids that are no parts, and others, are told."""
    # The net has its junctions.
    own = {name: _rows(cards, place) for name, cards in deck.node_sets.items() if name != f"{PURKINJE}_junctions"}
    mesh = with_node_sets(mesh, own)
    regions: dict[str, list[int]] = {}
    for solid in deck.solids:
        regions.setdefault(names.get(solid.part, "").lower(), []).append(solid.label)
    return with_unread(with_element_sets(mesh, "sets of solids", deck.solid_sets, regions), "sets", deck.other_sets)


def _rows(cards: list[str], place: dict[int, int]) -> IntArray | None:
    """Places of the nodes that cards list; None where they list something else."""
    try:
        return np.array([place[n] for card in cards for n in integers_of(card, 10) if n], dtype=np.int64)
    except (ValueError, KeyError):
        return None


def _kind(nodes: list[int]) -> str:
    if len(nodes) == 10:
        return "tetra10"
    return next(kind for kind, pairs in _REPEATED.items() if all(nodes[a] == nodes[b] for a, b in pairs))


def _add_solids(parts: DeckParts, deck: KeywordDeck, names: dict[int, str], place: dict[int, int]) -> None:
    aha = {label: n for name, rows in deck.solid_sets.items() if (n := segment_of(name)) is not None for label in rows}
    kinds = [_kind(solid.nodes) for solid in deck.solids]
    for kind in dict.fromkeys(kinds):
        own = [solid for solid, of in zip(deck.solids, kinds) if of == kind]
        order = [PLACES[kind].index(i) for i in range(len(set(PLACES[kind])))]
        nodes = rows_of_nodes([[solid.nodes[i] for i in order] for solid in own], place)
        region = np.array([parts.numbers.of(names.get(solid.part, f"tag_{solid.part}")) for solid in own])
        data = {}
        if all(len(solid.axes) == 6 for solid in own):
            axes = np.array([solid.axes for solid in own])
            data = {"fiber": axes[:, :3], "sheet": axes[:, 3:]}
        if aha:
            data["aha"] = np.array([aha.get(solid.label, 0) for solid in own], dtype=np.int32)
        parts.cells.append((kind, nodes, region, data))


def _add_segments(parts: DeckParts, deck: KeywordDeck, place: dict[int, int]) -> None:
    cells = {kind: nodes for kind, nodes, *_ in parts.cells}
    for name, rows in deck.segments:
        tag = parts.numbers.of(name, facet=True)
        for count, kind in ((3, "triangle"), (4, "quad")):
            own = [row[:count] for row in rows if (row[2] == row[3]) == (count == 3)]
            if own:
                facet_kind, nodes = with_mid_side_nodes(kind, rows_of_nodes(own, place), cells)
                parts.facets.append((facet_kind, nodes, tag))
