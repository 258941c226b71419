"""Our XDMF, or dolfinx's, in; a volume mesh out."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from femprep.errors import FileError
from femprep.export.deck.names import Numbers
from femprep.export.deck.units import UNITS
from femprep.export.xdmf.grids import attributes_of, tags_of, topology_of, values_of
from femprep.export.xdmf.tagged import read_tagged
from femprep.export.xdmf.write import CELL_TAGS, FACET_TAGS, MESH
from femprep.mesh.length_unit import UNIT
from femprep.model import VolumeMesh
from femprep.model.tags import foreign_names
from femprep.model.verdict import VERDICT


def read_own(path: Path) -> VolumeMesh | None:
    """A mesh from our ``.xdmf``, or from one of several grids, as dolfinx writes it; ``None`` for any other.

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
    listed = [grid for domain in root.iter("Domain") for grid in domain.findall("Grid")]
    grids = {grid.get("Name"): grid for grid in listed}
    if MESH not in grids:
        steps = listed[0].findall("Grid") if len(listed) == 1 and listed[0].get("CollectionType") == "Temporal" else []
        if steps:
            return read_tagged(steps[:1], path, len(steps))
        return read_tagged(listed, path) if len(listed) > 1 else None
    whole = grids[MESH]
    numbers = Numbers()
    kind, cells = topology_of(whole, path)
    info = _read_json(path, "info")
    scale = UNITS[info.get("length_unit", "mm")].per_mm
    points = values_of(whole.find("Geometry"), path) / scale
    stated = {UNIT: {"unit": info["length_unit"], "by": "statement"}} if "length_unit" in info else {}
    written = _read_json(path, "markers")
    markers = [(foreign_names(info).get(tag, name), tag, dim) for name, (tag, dim) in written.items()]
    region = _tags(grids.get(CELL_TAGS), path, markers, 3, numbers)
    facet_tag = _tags(grids.get(FACET_TAGS), path, markers, 2, numbers)
    facets = dict([topology_of(grids[FACET_TAGS], path)]) if FACET_TAGS in grids else {}
    return VolumeMesh(
        points=points,
        cells={kind: cells},
        region=region if region.size else np.zeros(len(cells), dtype=np.int32),
        facets=facets,
        facet_tag=facet_tag,
        cell_data=attributes_of(whole, "Cell", path),
        point_data=attributes_of(whole, "Node", path),
        info={**numbers.info, **stated, **({VERDICT: info[VERDICT]} if VERDICT in info else {})},
    )


def _read_json(path: Path, name: str) -> dict[str, Any]:
    """What the mesh's own file of that name tells, or that of its folder."""
    for file in (path.with_name(f"{name}_{path.stem}.json"), path.with_name(f"{name}.json")):
        if file.is_file():
            found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
            return found
    return {}


def _tags(
    grid: ElementTree.Element | None, path: Path, markers: Sequence[tuple[str, int, int]], dim: int, numbers: Numbers
) -> np.ndarray:
    """Tags of elements or facets, by the names of their dimension."""
    if grid is None:
        return np.empty(0, dtype=np.int32)
    names = {int(tag): name for name, tag, own in markers if int(own) == dim}
    return numbers.of_tags(tags_of(grid.find("Attribute"), path), names, facet=dim == 2)
