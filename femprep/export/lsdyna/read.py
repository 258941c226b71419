"""An LS-DYNA keyword file (``.k``, fixed columns) in, its solid elements out: parts, segments, sets, fibres."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from femprep.errors import FileError, InputError
from femprep.export.deck.fibres import segment_of
from femprep.export.deck.includes import OpenedFile
from femprep.export.deck.parts import DeckParts, require_once, rows_of_nodes, with_mid_side_nodes
from femprep.export.deck.reals import real
from femprep.export.deck.units import units_of
from femprep.export.deck.unread import with_element_sets, with_node_sets, with_unread
from femprep.export.lsdyna.cards import card_lines, card_sections
from femprep.export.lsdyna.write import PLACES
from femprep.export.purkinje import PURKINJE
from femprep.mesh.elements import ELEMENTS
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
    text = "\n".join(card_lines(OpenedFile(path)))
    if "*KEYWORD" not in text.upper():
        raise FileError(f"{str(path)!r} is no LS-DYNA keyword file: it has no *KEYWORD")
    scale = units_of(path).per_mm
    parts = DeckParts()
    titles: dict[int, str] = {}
    ids, points, solids, segments, beams = [], [], [], [], []
    sets, node_sets, others = dict[str, list[int]](), dict[str, list[str]](), list[str]()
    for keyword, cards in card_sections(text):
        if any("," in card for card in cards[:1]) and keyword.startswith(("*NODE", "*ELEMENT", "*SET")):
            raise FileError(f"{str(path)!r}: cards with commas ({keyword}) are not read; write them in columns")
        if keyword == "*NODE":
            ids += [int(card[:8]) for card in cards]
            points += [[real(card[8 + 16 * i : 24 + 16 * i], card) for i in range(3)] for card in cards]
        elif keyword == "*PART":
            pairs = [pair for pair in zip(cards[::2], cards[1::2]) if pair[1].strip()]
            titles.update({int(card[:10]): title.strip() for title, card in pairs})
        elif keyword in ("*ELEMENT_SOLID", "*ELEMENT_SOLID_ORTHO"):
            solids += _solids(cards, keyword.endswith("ORTHO"))
        elif keyword == "*ELEMENT_BEAM":
            beams += [_integers(card, 8)[:4] for card in cards]
        elif keyword.startswith("*ELEMENT_"):
            parts.left_out.add(keyword)
        elif keyword in ("*SET_SEGMENT", "*SET_SEGMENT_TITLE"):
            first = int(keyword.endswith("TITLE"))
            name = cards[0].strip() if first else f"tag_{int(cards[0][:10])}"
            segments.append((name, [_integers(card[:40], 10) for card in cards[first + 1 :]]))
        elif keyword == "*SET_SOLID_TITLE":
            sets[cards[0].strip().lower()] = [n for card in cards[2:] for n in _integers(card, 10) if n]
        elif keyword == "*SET_NODE_LIST_TITLE":
            node_sets[cards[0].strip()] = cards[2:]
        elif keyword.startswith("*SET_") and cards:
            others.append(f"{keyword} {cards[0].strip() if keyword.endswith('TITLE') else cards[0][:10].strip()}")
    if not solids:
        raise InputError("holds no solid elements")
    titles = _names(titles)
    require_once(
        (label for label, _ in dict.fromkeys(zip(ids, map(tuple, points)))), "node"
    )  # the same again is no harm
    require_once((label for label, *_ in solids), "element")
    fibres = [beam for beam in beams if titles.get(beam[1], "").startswith(f"{PURKINJE}_")]
    if len(fibres) < len(beams):
        parts.left_out.add("*ELEMENT_BEAM")
    at, wall = dict(zip(ids, points)), {label for solid in solids for label in solid[2]}
    ids = [label for label in at if not fibres or label in wall]
    points = [at[label] for label in ids]
    place = {label: i for i, label in enumerate(ids)}
    aha = {label: n for name, rows in sets.items() if (n := segment_of(name)) is not None for label in rows}
    _add_solids(parts, solids, titles, place, aha)
    cells = {kind: nodes for kind, nodes, *_ in parts.cells}
    for name, rows in segments:
        tag = parts.numbers.of(name, facet=True)
        for count, kind in ((3, "triangle"), (4, "quad")):
            own = [row[:count] for row in rows if (row[2] == row[3]) == (count == 3)]
            if own:
                facet_kind, nodes = with_mid_side_nodes(kind, rows_of_nodes(own, place), cells)
                parts.facets.append((facet_kind, nodes, tag))
    mesh = parts.mesh(np.array(points) / scale, "*PART", "*SET_SEGMENT")
    node_sets.pop(f"{PURKINJE}_junctions", None)  # the net has them
    mesh = with_node_sets(mesh, {name: _rows(own, place) for name, own in node_sets.items()})
    regions: dict[str, list[int]] = {}
    for label, part, *_ in solids:
        regions.setdefault(titles.get(part, "").lower(), []).append(label)
    mesh = with_unread(with_element_sets(mesh, "sets of solids", sets, regions), "sets", others)
    if not re.search(r"^\*END\s*$", text, re.MULTILINE | re.IGNORECASE):
        words = "the deck has no *END, and was read to the end of the file: whether it is cut short cannot be told"
        mesh = replace(mesh, info=noted(mesh.info, Notice.of("assumed", words)))
    if not fibres:
        return mesh
    told = re.search(r"Purkinje fibres; conduction (\S+) m/s", text)
    speed = {"speed": float(told[1])} if told else {}
    return replace(mesh, purkinje=_net(fibres, titles, at, {k: place[k] for k in wall}, parts, scale, speed))


def _net(
    beams: list[list[int]],
    titles: dict[int, str],
    at: dict[int, list[float]],
    place: dict[int, int],
    parts: DeckParts,
    scale: float,
    speed: dict[str, float],
) -> PurkinjeNet:
    """Purkinje fibres from beams: number, part and two nodes each."""
    labels, edges = np.unique(np.array([beam[2:4] for beam in beams], dtype=np.int64), return_inverse=True)
    points = np.array([at[label] for label in labels.tolist()]) / scale
    names = [titles[beam[1]].removeprefix(f"{PURKINJE}_") for beam in beams]
    tag = np.array([parts.numbers.of(name, facet=True) for name in names], dtype=np.int32)
    ends = np.array([place.get(label, -1) for label in labels.tolist()], dtype=np.int64)
    return PurkinjeNet.numbered(points, edges.reshape(-1, 2), tag, ends, **speed)


def _names(titles: dict[int, str]) -> dict[int, str]:
    """Names of parts by their titles, of ours without the type of their elements; parts of one title stay apart."""
    times, found = Counter(titles.values()), {}
    for part, title in titles.items():
        words = title.split()
        name = " ".join(words[:-1] if len(words) > 1 and words[-1] in ELEMENTS else words) or "tag"
        found[part] = name if title and times[title] == 1 else f"{name}_{part}"
    return found


def _integers(card: str, width: int) -> list[int]:
    return [int(card[i : i + width]) for i in range(0, len(card.rstrip()), width)]


def _rows(cards: list[str], place: dict[int, int]) -> IntArray | None:
    """Places of the nodes that cards list; None where they list something else."""
    try:
        return np.array([place[n] for card in cards for n in _integers(card, 10) if n], dtype=np.int64)
    except (ValueError, KeyError):
        return None


def _solids(cards: list[str], ortho: bool) -> list[tuple[int, int, list[int], list[float]]]:
    """Number, part, nodes and axes of each element; ten nodes stand on a card of their own."""
    found, row = [], 0
    while row < len(cards):
        head = _integers(cards[row], 8)
        row += 1
        nodes = head[2:]
        if not nodes:
            nodes = _integers(cards[row], 8)
            row += 1
        axes = []
        if ortho:
            axes = [real(card[16 * i : 16 * i + 16], card) for card in cards[row : row + 2] for i in range(3)]
            row += 2
        found.append((head[0], head[1], nodes, axes))
    return found


def _kind(nodes: list[int]) -> str:
    if len(nodes) == 10:
        return "tetra10"
    return next(kind for kind, pairs in _REPEATED.items() if all(nodes[a] == nodes[b] for a, b in pairs))


def _add_solids(
    parts: DeckParts,
    solids: list[tuple[int, int, list[int], list[float]]],
    titles: dict[int, str],
    place: dict[int, int],
    aha: dict[int, int],
) -> None:
    kinds = [_kind(nodes) for _, _, nodes, _ in solids]
    for kind in dict.fromkeys(kinds):
        own = [solid for solid, of in zip(solids, kinds) if of == kind]
        order = [PLACES[kind].index(i) for i in range(len(set(PLACES[kind])))]
        nodes = rows_of_nodes([[solid[2][i] for i in order] for solid in own], place)
        names = [titles.get(part, f"tag_{part}") for _, part, _, _ in own]
        region = np.array([parts.numbers.of(name) for name in names])
        data = {}
        if all(len(axes) == 6 for *_, axes in own):
            axes = np.array([solid[3] for solid in own])
            data = {"fiber": axes[:, :3], "sheet": axes[:, 3:]}
        if aha:
            data["aha"] = np.array([aha.get(label, 0) for label, *_ in own], dtype=np.int32)
        parts.cells.append((kind, nodes, region, data))
