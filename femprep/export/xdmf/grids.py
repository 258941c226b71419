"""A grid of XDMF in; its type of elements, their nodes, and its attributes, which lie in HDF5, out."""

from __future__ import annotations

from pathlib import Path
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
        It names no HDF5 file, or that is damaged or missing.
    """
    import h5py

    entry = element.find("DataItem") if element is not None else None
    if entry is None or entry.get("Format", "").strip().lower() != "hdf" or ":" not in (entry.text or ""):
        raise FileError(f"{str(path)!r} names no HDF5 data where its grids need them")
    name, where = (entry.text or "").strip().split(":", 1)
    with h5py.File(path.parent / name, "r") as store:
        return np.asarray(store[where])
