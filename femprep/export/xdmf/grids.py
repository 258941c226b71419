"""A grid of XDMF in; its type of elements, their nodes, and its attributes, from text or HDF5, out."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from femprep.errors import FileError
from femprep.export.xdmf.write import TOPOLOGY
from femprep.model.arrays import integers


def kind_of(grid: ElementTree.Element) -> str | None:
    """Our type of the elements of a grid; None where there is none."""
    topology = grid.find("Topology")
    name = (topology.get("TopologyType") or "").lower() if topology is not None else ""
    return next((kind for kind, known in TOPOLOGY.items() if known.lower() == name), None)


def topology_of(grid: ElementTree.Element, path: Path) -> tuple[str, np.ndarray]:
    """Type and nodes ``(n, p)`` of the elements of a grid.

    Raises
    ------
    FileError
        The type is not known, or the nodes are not where they should be.
    """
    kind, topology = kind_of(grid), grid.find("Topology")
    if kind is None:
        name = topology.get("TopologyType") if topology is not None else None
        raise FileError(f"{str(path)!r} holds cells of type {name!r}; femprep reads {', '.join(TOPOLOGY.values())}")
    return kind, integers(values_of(topology, path), "its list of elements")


def attributes_of(grid: ElementTree.Element, center: str, path: Path) -> dict[str, np.ndarray]:
    """Arrays of a grid by name, of its elements (``Cell``) or points (``Node``)."""
    found = (entry for entry in grid.findall("Attribute") if entry.get("Center") == center)
    return {entry.get("Name") or "data": values_of(entry, path) for entry in found}


def tags_of(attribute: ElementTree.Element | None, path: Path) -> np.ndarray:
    """Tags of the elements or facets of a grid.

    Raises
    ------
    InputError
        They are no whole numbers.
    """
    return integers(values_of(attribute, path).ravel(), "its list of tags")


def values_of(element: ElementTree.Element | None, path: Path) -> np.ndarray:
    """The numbers that something of a grid names.

    Raises
    ------
    FileError
        There are none, or the HDF5 file that is named is damaged or missing.
    """
    import h5py

    entry = element.find("DataItem") if element is not None else None
    form, text = ("", "") if entry is None else (entry.get("Format", "XML").strip().lower(), entry.text or "")
    if entry is not None and form == "xml" and not len(entry) and "Reference" not in entry.attrib:
        whole = entry.get("DataType", entry.get("NumberType", "Float")).lower() in ("int", "uint")
        try:
            values = np.array(text.split(), dtype=np.int64 if whole else np.float64)
            return values.reshape([int(count) for count in entry.get("Dimensions", "-1").split()])
        except ValueError as error:
            raise FileError(f"{str(path)!r} has no numbers, or not as many as it says: {error}") from None
    if form != "hdf" or ":" not in text:
        raise FileError(f"{str(path)!r} has no numbers in text or HDF5 where its grids need them")
    name, where = text.strip().split(":", 1)
    with h5py.File(path.parent / name, "r") as store:
        return np.asarray(store[where])


def markers_of(path: Path) -> list[tuple[str, int, int]]:
    """Name, tag and dimension of what ``markers.json``, or the mesh's own file of that name, lists beside a mesh."""
    return [(name, int(tag), int(dim)) for name, (tag, dim) in read_json(path, "markers").items()]


def read_json(path: Path, name: str) -> dict[str, Any]:
    """What the mesh's own file of that name tells, or that of its folder."""
    for file in (path.with_name(f"{name}_{path.stem}.json"), path.with_name(f"{name}.json")):
        if file.is_file():
            found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
            return found
    return {}
