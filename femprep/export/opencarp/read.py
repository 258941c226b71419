"""openCARP's ``.pts .elem .lon`` (and our ``.surf``, tags and segments beside them) in; a volume mesh out."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from femprep.errors import FileError
from femprep.export.deck.parts import DeckParts
from femprep.export.opencarp.binary import read_directions, read_elements, read_points
from femprep.export.opencarp.write import CARP_FACETS, CARP_TYPES, INWARD, MICROMETRES, NO_FIBRE
from femprep.export.purkinje import PURKINJE
from femprep.model import IntArray, PurkinjeNet, VolumeMesh, is_blood

log = logging.getLogger(__name__)

_KINDS: Final = {word: (kind, np.argsort(order)) for kind, (word, order) in CARP_TYPES.items()}
#: Directions in blood, where none mean anything: other solvers want unit vectors at right angles in every element.
_BLOOD: Final = {"fiber": (1.0, 0.0, 0.0), "sheet": (0.0, 1.0, 0.0)}
#: Endings of the binary files.
_BINARY: Final = (".bpts", ".belem")
_FACETS: Final = {word: {3: "triangle", 4: "quad"}[corners] for corners, word in CARP_FACETS.items()}


def read(path: Path) -> VolumeMesh:
    """Read the mesh to which a ``.pts`` or ``.elem`` file belongs, or a ``.bpts`` or ``.belem`` one.

    Points become mm. Region tags stand in ``.elem``, fibre and sheet in ``.lon`` (none where that does not exist, or
    holds nothing but zeros and the ``1 0 0`` of tissue without fibres; in blood those that ``on_wall`` gives it);
    facets in ``stem.<name>.surf``. Names of tags are those of ``stem.tags.txt``, where femprep wrote it.

    Raises
    ------
    FileError
        A file is missing, or damaged.
    InputError
        There are no volume elements.
    """
    stem = path.with_suffix("")
    binary = path.suffix.lower() in _BINARY
    points = read_points(Path(f"{stem}.bpts")) if binary else _table(Path(f"{stem}.pts"), "points")
    blocks = _binary_elements(stem) if binary else _text_elements(stem)
    names = _names(Path(f"{stem}.tags.txt"))
    parts = DeckParts()
    data = _data(stem, sum(len(rows) for _, rows, _ in blocks), binary)
    for word, rows, numbers in blocks:
        if word not in _KINDS:
            parts.left_out.add(word)
            continue
        kind, order = _KINDS[word]
        tag = numbers[:, -1] if numbers.shape[1] > len(order) else np.zeros(len(rows), dtype=np.int64)
        region = parts.numbers.of_tags(tag, names)
        own_data = {name: _filled(name, values[rows], region) for name, values in data.items()}
        parts.cells.append((kind, numbers[:, : len(order)][:, order], region, own_data))
    own_tags = {name: tag for tag, name in names.items()}
    for file in sorted(path.parent.glob(f"{stem.name}.*.surf")):
        name = file.name[len(stem.name) + 1 : -len(".surf")]
        number = parts.numbers.of(name, own_tags.get(name), facet=True)
        parts.facets += [(kind, nodes, number) for kind, nodes in _surface(file)]
    mesh = parts.mesh(points / MICROMETRES, ".elem", ".surf")
    own = Path(f"{stem}.{PURKINJE}.elem")
    if not own.is_file():
        return mesh
    net = _net(own)
    ends, at = net.junctions, net.mesh_point[net.junctions]
    if (
        at.max(initial=-1) >= len(points) or np.abs(net.points[ends] - mesh.points[at]).max(initial=0) > 1e-5
    ):  # single precision
        log.warning("%s does not end in points of this mesh: Purkinje fibres of another one, left out", own.name)
        return mesh
    return replace(mesh, purkinje=net)


def _text_elements(stem: Path) -> list[tuple[str, IntArray, IntArray]]:
    """Types of elements, which rows they are, and their nodes with the tag, where there is one."""
    lines = _lines(Path(f"{stem}.elem"), "elements")
    words = np.array([line.split(None, 1)[0] for line in lines])
    found = []
    for word in dict.fromkeys(words.tolist()):
        rows = np.flatnonzero(words == word)
        numbers = [lines[row].split()[1:] for row in rows]
        found.append((word, rows, np.array(numbers if word in _KINDS else [()] * len(rows), dtype=np.int64)))
    return found


def _binary_elements(stem: Path) -> list[tuple[str, IntArray, IntArray]]:
    """The same of a binary file, each type once."""
    found: dict[str, list[tuple[IntArray, IntArray]]] = {}
    first = 0
    for word, nodes, tag in read_elements(Path(f"{stem}.belem")):
        found.setdefault(word, []).append((np.arange(first, first + len(nodes)), np.column_stack([nodes, tag])))
        first += len(nodes)
    return [
        (word, np.concatenate([rows for rows, _ in blocks]), np.concatenate([numbers for _, numbers in blocks]))
        for word, blocks in found.items()
    ]


def _net(path: Path) -> PurkinjeNet:
    """Purkinje fibres from their own mesh of lines."""
    stem = path.with_suffix("")
    lines = np.array([line.split()[1:] for line in _lines(path, "edges")], dtype=np.int64).reshape(-1, 3)
    head, *numbers = stem.with_suffix(f".{PURKINJE}.dat").read_text(encoding="ascii").splitlines()
    points = _table(stem.with_suffix(f".{PURKINJE}.pts"), "points") / MICROMETRES
    tag: Any = lines[:, 2]  # the net sees to it that they are tags
    return PurkinjeNet(points, lines[:, :2], tag, np.array(numbers, np.int64), speed=float(head.split()[1]))


def _lines(path: Path, what: str) -> list[str]:
    """The lines of a file behind its first, which counts them."""
    if not path.is_file():
        raise FileError(f"{str(path)!r} does not exist; the {what} of an openCARP mesh stand in it")
    head, *lines = path.read_text(encoding="ascii").splitlines() or [""]
    lines = [line for line in lines if line.strip()]
    if not head.split() or int(head.split()[0]) != len(lines):
        raise FileError(f"{str(path)!r} says {head.strip()!r} {what} and holds {len(lines)}")
    return lines


def _table(path: Path, what: str) -> np.ndarray:
    rows = [line.split() for line in _lines(path, what)]
    if wrong := [row for row in rows if len(row) != 3]:
        raise FileError(f"{str(path)!r} has a line {' '.join(wrong[0])[:60]!r}, expected three numbers")
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def _names(path: Path) -> dict[int, str]:
    if not path.is_file():
        return {}
    pairs = (line.split(None, 1) for line in path.read_text(encoding="utf-8").splitlines())
    return {int(tag): name.strip() for tag, name in pairs}


def _data(stem: Path, count: int, binary: bool) -> dict[str, np.ndarray]:
    found: dict[str, np.ndarray] = {}
    lon, aha = Path(f"{stem}{'.blon' if binary else '.lon'}"), Path(f"{stem}.aha.dat")
    if lon.is_file():
        axes = read_directions(lon) if binary else _directions(lon)
        if len(axes) != count:
            raise FileError(f"{str(lon)!r} holds an array of shape {axes.shape} for {count} elements")
        if not np.isin(axes[:, 3:], 0.0).all() or (axes[axes.any(axis=1), :3] != NO_FIBRE).any():
            names = ("fiber", "sheet")[: axes.shape[1] // 3]
            found = {name: axes[:, 3 * i : 3 * i + 3] for i, name in enumerate(names)}
    if aha.is_file():
        values = np.array(aha.read_text(encoding="ascii").split(), dtype=np.int32)
        if len(values) != count:
            raise FileError(f"{str(aha)!r} holds {len(values)} segments for {count} elements")
        found["aha"] = values
    return found


def _directions(path: Path) -> np.ndarray:
    head, *lines = path.read_text(encoding="ascii").splitlines()
    axes = np.array([line.split() for line in lines if line.strip()], dtype=np.float64)
    if axes.ndim != 2 or axes.shape[1] != 3 * int(head):
        raise FileError(f"{str(path)!r} holds an array of shape {axes.shape}, not {head} axes for each element")
    return axes


def _filled(name: str, values: np.ndarray, region: IntArray) -> np.ndarray:
    """Data of elements, with directions in blood, where the file has none."""
    if name in _BLOOD:
        values[is_blood(region) & ~values.any(axis=1)] = _BLOOD[name]
    return values


def _surface(path: Path) -> list[tuple[str, IntArray]]:
    rows: dict[str, list[list[str]]] = {}
    for line in _lines(path, "facets"):
        word, *nodes = line.split()
        if word in _FACETS:
            rows.setdefault(_FACETS[word], []).append([nodes[i] for i in INWARD[3 if word == "Tr" else 4]])
    return [(kind, np.array(nodes, dtype=np.int64)) for kind, nodes in rows.items()]
