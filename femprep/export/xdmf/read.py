"""Our XDMF, or dolfinx's, in; a volume mesh out."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from femprep.errors import FileError
from femprep.export.deck.names import Numbers
from femprep.export.deck.units import UNITS
from femprep.export.foreign import Block, ForeignMesh, from_meshio
from femprep.export.turned import turned_tetrahedra
from femprep.export.xdmf.grids import attributes_of, kind_of, markers_of, read_json, tags_of, topology_of, values_of
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
        if len(listed) > 1:
            return read_tagged(listed, path)
        return _of_one_grid(listed[0], path) if listed and _is_plain(listed[0]) else None
    whole = grids[MESH]
    numbers = Numbers()
    kind, cells = topology_of(whole, path)
    info = read_json(path, "info")
    scale = UNITS[info.get("length_unit", "mm")].per_mm
    points = values_of(whole.find("Geometry"), path) / scale
    stated = {UNIT: {"unit": info["length_unit"], "by": "statement"}} if "length_unit" in info else {}
    markers = [(foreign_names(info).get(tag, name), tag, dim) for name, tag, dim in markers_of(path)]
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


def _is_plain(grid: ElementTree.Element) -> bool:
    """Whether a grid is of elements of one type that are known, and says nothing that :func:`_of_one_grid` leaves."""
    parts = {part.tag for part in grid} <= {"Geometry", "Topology", "Attribute"} and kind_of(grid) is not None
    items = [item for part in grid for item in part]
    return parts and all(
        not len(item) and "Reference" not in item.attrib and item.get("Format", "XML").lower() in ("xml", "hdf")
        for item in items
    )


def _of_one_grid(grid: ElementTree.Element, path: Path) -> VolumeMesh:
    kind, cells = topology_of(grid, path)
    data = attributes_of(grid, "Cell", path)
    points = values_of(grid.find("Geometry"), path)
    found = ForeignMesh(
        points, [Block(kind, cells)], attributes_of(grid, "Node", path), {name: [own] for name, own in data.items()}
    )
    return turned_tetrahedra(from_meshio(found))


def _tags(
    grid: ElementTree.Element | None, path: Path, markers: Sequence[tuple[str, int, int]], dim: int, numbers: Numbers
) -> np.ndarray:
    """Tags of elements or facets, by the names of their dimension."""
    if grid is None:
        return np.empty(0, dtype=np.int32)
    names = {int(tag): name for name, tag, own in markers if int(own) == dim}
    return numbers.of_tags(tags_of(grid.find("Attribute"), path), names, facet=dim == 2)
