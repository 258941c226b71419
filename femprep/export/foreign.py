"""A mesh of meshio's in, a tagged volume mesh out: blocks gathered by type, tags and names found."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import Any, Final

import numpy as np

from femprep.export.deck.names import Numbers
from femprep.export.deck.unread import no_elements, with_node_sets, with_unread
from femprep.export.vtk.xml import RECORD, record_of
from femprep.mesh.elements import ELEMENTS, FACET_CORNERS
from femprep.model import VolumeMesh
from femprep.model.notice import Notice, noted
from femprep.model.verdict import VERDICT

log = logging.getLogger(__name__)

#: Cell arrays that hold tags, by the programs that write them, in the order they are looked for.
TAG_ARRAYS: Final = (
    *("region", "facet_tag", "gmsh:physical", "medit:ref", "cell_tags", "Cell tags", "Facet tags"),
    *("elemTag", "ModelRegionID", "ModelFaceID", "material", "MaterialID", "ID"),
    *(
        "_surface-id",
        "_volume-id",
        "tetgen:ref",
    ),
)
#: From so many elements on an array with a number of its own for each of them counts elements: no tags.
_FEW: Final = 100
#: Arrays that say nothing about the mesh, only about the file.
_BOOKKEEPING: Final = ("gmsh:geometrical", "gmsh:dim_tags")


@dataclass(frozen=True)
class Block:
    """Cells of one type: what ``meshio.CellBlock`` is, without its check, which does not know ``wedge15``."""

    type: str
    data: Any


@dataclass(frozen=True)
class ForeignMesh:
    """The parts of a ``meshio.Mesh`` that are read here."""

    points: Any
    cells: list[Block]
    point_data: Mapping[str, Any] = field(default_factory=dict)
    cell_data: Mapping[str, list[Any]] = field(default_factory=dict)
    field_data: Mapping[str, Any] = field(default_factory=dict)
    cell_sets: Mapping[str, list[Any]] = field(default_factory=dict)
    #: Names by dimension and number, where regions and facets may have the same.
    names: Mapping[int, Mapping[int, str]] = field(default_factory=dict)


def from_meshio(mesh: Any) -> VolumeMesh:
    """Tagged volume mesh of a ``meshio.Mesh``, or of a :class:`ForeignMesh`.

    Raises
    ------
    InputError
        It holds no volume element that femprep knows.
    """
    numbers, names = Numbers(), _names_by_dimension(mesh)
    kept: dict[str, list[int]] = {}
    for i, block in enumerate(mesh.cells):
        kept.setdefault(block.type, []).append(i)
    left_out = sorted(set(kept) - set(ELEMENTS) - set(FACET_CORNERS))
    volume = [i for kind, where in kept.items() if kind in ELEMENTS for i in where]
    surface = [i for kind, where in kept.items() if kind in FACET_CORNERS for i in where]
    if not volume:
        raise no_elements(kept)
    if left_out:
        log.warning("elements of types %s are left out", ", ".join(left_out))
    region, region_from = _tags(mesh, volume, numbers, names[3], facet=False)
    facet_tag, facet_from = _tags(mesh, surface, numbers, names[2], facet=True)
    taken = {region_from, facet_from, *_BOOKKEEPING}
    points = np.asarray(mesh.points)
    if points.ndim == 2 and points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    uneven = _uneven(mesh, (volume, surface), taken)
    unfit = _unfit(mesh, volume, {name for name, _ in uneven}) if region_from == "none" else []
    words = [
        *(f"{name} is left out: it does not have numbers of one shape for all {where}" for name, where in uneven),
        *(f"regions are left out: {name} is not of whole numbers of 32 bits" for name in unfit),
    ]
    record = record_of(mesh.field_data)
    found = VolumeMesh(
        points=points,
        cells=_gather(mesh, kept, ELEMENTS),
        region=region,
        facets=_gather(mesh, kept, FACET_CORNERS),
        facet_tag=facet_tag,
        cell_data=_data(mesh.cell_data, volume, taken),
        point_data={name: values for name, values in _at_points(mesh).items() if _alike([values])},
        facet_data=_data(mesh.cell_data, surface, taken) if surface else {},
        info={
            "source": {"region": region_from, "facet_tag": facet_from, "left_out": left_out},
            **noted(numbers.info, *(Notice.of("left out", one) for one in words)),
            **({VERDICT: record[VERDICT]} if VERDICT in record else {}),
        },
    )
    found = with_node_sets(found, getattr(mesh, "point_sets", {}))
    others = (
        name for name, values in mesh.field_data.items() if name not in (RECORD, "med:nom") and not _names(values)
    )
    return with_unread(found, "field data", others)


def _at_points(mesh: Any) -> dict[str, np.ndarray]:
    """Arrays at points that are no tags."""
    tags = (*TAG_ARRAYS, *_BOOKKEEPING)
    return {name: np.asarray(values) for name, values in mesh.point_data.items() if name not in tags}


def _gather(mesh: Any, kept: Mapping[str, list[int]], kinds: Any) -> dict[str, np.ndarray]:
    return {
        kind: np.concatenate([np.asarray(mesh.cells[i].data) for i in kept[kind]]) for kind in kept if kind in kinds
    }


def _names_by_dimension(mesh: Any) -> dict[int, dict[int, str]]:
    """Names that a file gives to tags, by the dimension of what they name."""
    found: dict[int, dict[int, str]] = {dimension: {} for dimension in range(4)}
    for name, value in mesh.field_data.items():
        if _names(value):
            number, dimension = (int(one) for one in np.asarray(value).ravel())
            found.setdefault(dimension, {})[number] = name
    for dimension, names in getattr(mesh, "names", {}).items():
        found.setdefault(dimension, {}).update(names)
    return found


def _names(value: Any) -> bool:
    """Whether field data are the number and the dimension of what their name names."""
    entry = np.asarray(value)
    return entry.size == 2 and entry.dtype.kind in "iu"


def _tags(
    mesh: Any, blocks: list[int], numbers: Numbers, names: Mapping[int, str], *, facet: bool
) -> tuple[np.ndarray, str]:
    """Tags over some blocks, and the name of the array or the word ``sets`` they come from."""
    total = sum(len(mesh.cells[i].data) for i in blocks)
    if not blocks:
        return np.empty(0, dtype=np.int32), "none"
    for array in TAG_ARRAYS:
        if array not in mesh.cell_data:
            continue
        values = _values(mesh, array, blocks)
        if _are_tags(values):
            tags = np.concatenate(values).astype(np.int64)
            if len(tags) > _FEW and len(np.unique(tags)) == len(tags):
                continue
            # MED's names are those of families, which meshio keeps beside the tags.
            families = {tag: own[0] for tag, own in getattr(mesh, "cell_tags", {}).items() if own}
            told = {tag: name for tag, name in {**families, **names}.items() if name}
            return numbers.of_tags(tags, told, facet=facet).astype(np.int32), array
    out = np.zeros(total, dtype=np.int64)
    named = False
    for name, sets in getattr(mesh, "cell_sets", {}).items():
        if name.startswith("gmsh:"):
            continue
        first = 0
        for i in blocks:
            chosen = np.asarray(sets[i] if sets[i] is not None else [], dtype=np.int64)
            if chosen.size:
                out[first + chosen] = numbers.of(name, facet=facet)
                named = True
            first += len(mesh.cells[i].data)
    return out.astype(np.int32), "sets" if named else "none"


def _values(mesh: Any, array: str, blocks: list[int]) -> list[np.ndarray]:
    return [np.asarray(mesh.cell_data[array][i]) for i in blocks]


def _are_tags(parts: list[np.ndarray]) -> bool:
    """Whether values are whole numbers that a tag can have; others would be cut to them."""
    most = np.iinfo(np.int32).max
    for values in parts:
        whole = values.dtype.kind in "iu" or (values.dtype.kind in "bf" and np.array_equal(values, np.round(values)))
        if values.ndim != 1 or not whole or not np.all((values >= -most) & (values <= most)):
            return False
    return True


def _uneven(mesh: Any, groups: Iterable[list[int]], taken: set[str]) -> list[tuple[str, str]]:
    """Arrays of elements that are there for some blocks and no numbers of one shape for all of them; of points."""
    found = {(name, "points") for name, values in _at_points(mesh).items() if not _alike([values])}
    for name, blocks in product(set(mesh.cell_data) - taken, groups):
        parts = [mesh.cell_data[name][i] for i in blocks]
        if any(part is not None for part in parts) and not _alike([np.asarray(part) for part in parts]):
            found.add((name, "elements"))  # MED's fields are of some types
    return sorted(found)


def _unfit(mesh: Any, volume: list[int], told: set[str]) -> list[str]:
    """Arrays that would tell regions, did they hold tags, and of which nothing else is told."""
    there = [name for name in TAG_ARRAYS if name in mesh.cell_data and name not in told]
    return [name for name in there if not _are_tags(_values(mesh, name, volume))]


def _alike(parts: list[np.ndarray]) -> bool:
    """Whether parts are numbers, of one shape that is not empty."""
    numbers = all(part.dtype.kind in "biuf" and 0 not in part.shape[1:] for part in parts)
    return numbers and len({part.shape[1:] for part in parts}) == 1


def _data(cell_data: Mapping[str, list[Any]], blocks: list[int], taken: set[str]) -> dict[str, np.ndarray]:
    """Cell arrays over some blocks.

    Left out are arrays that differ in shape between blocks or are no numbers, and those that are zero throughout:
    files with one array for cells and facets alike fill it up with zeros where it says nothing.
    """
    found = {}
    for name, arrays in cell_data.items():
        parts = [np.asarray(arrays[i]) for i in blocks]
        if name not in taken and _alike(parts) and any(np.any(part) for part in parts):
            values = np.concatenate(parts)
            # Formats that know floats alone give the AHA segments back as such.
            found[name] = values.astype(np.int32) if name == "aha" else values
    return found
