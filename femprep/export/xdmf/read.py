"""Our XDMF, or dolfinx's with the same grid names, in; a volume mesh out."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from femprep.errors import FileError
from femprep.export.deck.names import Numbers
from femprep.export.deck.units import UNITS
from femprep.export.xdmf.write import CELL_TAGS, FACET_TAGS, MESH, TOPOLOGY
from femprep.model import VolumeMesh
from femprep.model.verdict import VERDICT


def read_own(path: Path) -> VolumeMesh | None:
    """A mesh from our ``.xdmf`` (or dolfinx's, with grids of these names); ``None`` for any other.

    Raises
    ------
    FileError
        The file, or the HDF5 file beside it, is damaged or missing.
    """
    try:
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError as error:
        raise FileError(f"{str(path)!r} is damaged: {error}") from error
    if any(entry.get("BaseOffset", "0") != "0" or "Order" in entry.attrib for entry in root.iter("Topology")):
        raise FileError(
            f"{str(path)!r} counts points from another number than 0, or in another order; write it plainly"
        )
    grids = {grid.get("Name"): grid for grid in root.iter("Grid")}
    if MESH not in grids:
        return None
    whole = grids[MESH]
    numbers = Numbers()
    kind, cells = _topology(whole, path)
    info = _read_json(path.parent / "info.json")
    scale = UNITS[info.get("length_unit", "mm")].per_mm
    points = _values(whole.find("Geometry"), path) / scale
    markers = _read_json(path.parent / "markers.json")
    region = _tags(grids.get(CELL_TAGS), path, markers, 3, numbers)
    facet_tag = _tags(grids.get(FACET_TAGS), path, markers, 2, numbers)
    facets = dict([_topology(grids[FACET_TAGS], path)]) if FACET_TAGS in grids else {}
    return VolumeMesh(
        points=points,
        cells={kind: cells},
        region=region if region.size else np.zeros(len(cells), dtype=np.int32),
        facets=facets,
        facet_tag=facet_tag,
        cell_data=_attributes(whole, "Cell", path),
        point_data=_attributes(whole, "Node", path),
        info={**numbers.info, **({VERDICT: info[VERDICT]} if VERDICT in info else {})},
    )


def _read_json(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    return found


def _tags(
    grid: ElementTree.Element | None, path: Path, markers: Mapping[str, tuple[int, int]], dim: int, numbers: Numbers
) -> np.ndarray:
    """Tags of elements or facets, by the names of their dimension."""
    if grid is None:
        return np.empty(0, dtype=np.int32)
    names = {int(tag): name for name, (tag, own) in markers.items() if int(own) == dim}
    tags = _values(grid.find("Attribute"), path).ravel().astype(np.int64)
    return numbers.of_tags(tags, names, facet=dim == 2).astype(np.int32)


def _topology(grid: ElementTree.Element, path: Path) -> tuple[str, np.ndarray]:
    topology = grid.find("Topology")
    name = (topology.get("TopologyType") or "").lower() if topology is not None else ""
    kind = next((kind for kind, known in TOPOLOGY.items() if known.lower() == name), None)
    if kind is None:
        raise FileError(f"{str(path)!r} holds cells of type {name!r}; femprep reads {', '.join(TOPOLOGY.values())}")
    return kind, _values(topology, path).astype(np.int64)


def _attributes(grid: ElementTree.Element, center: str, path: Path) -> dict[str, np.ndarray]:
    found = (entry for entry in grid.findall("Attribute") if entry.get("Center") == center)
    return {entry.get("Name") or "data": _values(entry, path) for entry in found}


def _values(element: ElementTree.Element | None, path: Path) -> np.ndarray:
    import h5py

    entry = element.find("DataItem") if element is not None else None
    if entry is None or entry.get("Format", "").strip().lower() != "hdf" or ":" not in (entry.text or ""):
        raise FileError(f"{str(path)!r} names no HDF5 data where its grids need them")
    name, where = (entry.text or "").strip().split(":", 1)
    with h5py.File(path.parent / name, "r") as store:
        return np.asarray(store[where])
