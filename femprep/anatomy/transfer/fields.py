"""Two meshes with ventricular coordinates in, the second one with fields of the first one, by coordinates, out."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any, Final

import numpy as np

from femprep.anatomy.transfer.carry import Kind, carry_cells, carry_points, kind_of, put_right
from femprep.anatomy.transfer.correspondence import Correspondence, paired, require_same_anatomy
from femprep.anatomy.wall_parts import PARTS, wall_parts
from femprep.errors import InputError
from femprep.mesh.measures.volume_elements import element_volumes
from femprep.mesh.measures.weighted import weighted_percentile
from femprep.model import FloatArray, Notice, VolumeMesh, is_blood, noted
from femprep.model.shared_records.transfer import FieldRecord, TransferRecord
from femprep.volume.quality.transmural import mesh_edges

#: The field that the regions of a mesh are.
REGION: Final = "region"
#: Coordinates may be off by this share of an edge before a place counts as outside.
_OUTSIDE: Final = 0.5


def transfer(
    source: VolumeMesh, target: VolumeMesh, fields: str | Iterable[str], *, there_and_back: bool = True
) -> VolumeMesh:
    """Bring fields from one heart, phase, mesh or level to another by their ventricular coordinates.

    A place of the target gets what the source has at the same depth, height and angle of the same part of the wall:
    numbers linear in between; tags (whole numbers, ``region`` too) those of the element there; directions (unit
    vectors, both senses mean the same) and other vectors by their components along the axes that the coordinates grow
    along, so that they turn with the wall. A mesh gives itself, and one of the same points and elements, its own
    values.

    Parameters
    ----------
    source : VolumeMesh
        With the fields in ``cell_data`` or ``point_data`` (both, where a name is in both) and ventricular coordinates.
    target : VolumeMesh
        Of the same anatomy, with ventricular coordinates; of any elements.
    fields : str or iterable of str
        Names of fields, or ``"region"``.
    there_and_back : bool
        Whether to carry the fields back as well, to measure what comes back.

    Returns
    -------
    VolumeMesh
        The target with the fields, and ``info["transfer"]``, a
        :class:`~femprep.model.shared_records.transfer.TransferRecord`.

    Raises
    ------
    InputError
        A field or the coordinates are missing, or the anatomy differs.

    References
    ----------
    Bayer et al. 2018, doi 10.1016/j.media.2018.01.005; Schuler et al. 2021, doi 10.1016/j.media.2021.102247

    Examples
    --------
    >>> axes = fp.ventricular_axes(seg)
    >>> fine = fp.add_fibres(fp.add_coordinates(mesh, axes=axes), axes=axes)
    >>> moved = fp.transfer(fine, fine, "fiber")
    >>> moved.info["transfer"]["fields"][0]["kind"]
    'direction'
    """
    names = list(dict.fromkeys([fields] if isinstance(fields, str) else fields))
    cells, points = _chosen(source, names)
    sources, targets = wall_parts(source, "the source"), wall_parts(target, "the target")
    require_same_anatomy(source, target, sources, targets)
    if _same(source, target):
        # Round an apex whole elements have the height 0, and so one place: each is its own all the same.
        new_cells, new_points = ({name: np.array(own[name][0]) for name in own} for own in (cells, points))
        record = _record(source, target, [part.number for part in targets], 0.0)
        record = _unlost(record, cells, points, there_and_back)
    else:
        there = paired(source, target, sources, targets)
        new_cells = {name: carry_cells(there, values, kind) for name, (values, kind) in cells.items()}
        new_points = {name: carry_points(there, values, kind) for name, (values, kind) in points.items()}
        for new in (new_cells, new_points):
            put_right(new)
        record = _record(source, target, [pair.source.number for pair in there.pairs], _outside_share(there))
        if there_and_back:
            back = paired(target, source, targets, sources)
            record = _measured(record, there, back, cells, points, new_cells, new_points)
        else:
            record = _unlost(record, cells, points, False)
    region = np.where(is_blood(target.region), target.region, new_cells.pop(REGION, target.region))
    info = {**target.info, "transfer": record.model_dump(mode="json")}
    return replace(
        target.with_data(cell=new_cells, point=new_points), region=region, info=noted(info, *_notices(record))
    )


def _chosen(source: VolumeMesh, names: list[str]) -> tuple[dict[str, tuple[Any, Kind]], dict[str, tuple[Any, Kind]]]:
    """Values and kind of the fields asked for: of the elements, of the points."""
    cells: dict[str, tuple[Any, Kind]] = {}
    points: dict[str, tuple[Any, Kind]] = {}
    if not names:
        raise InputError("no field named; give the name of one at least")
    for name in names:
        if name == REGION:
            cells[name] = np.asarray(source.region), "tag"
            continue
        for own, data in ((cells, source.cell_data), (points, source.point_data)):
            if name in data:
                own[name] = np.asarray(data[name]), kind_of(data[name], name)
        if name not in cells and name not in points:
            have = ", ".join(dict.fromkeys([REGION, *source.cell_data, *source.point_data]))
            raise InputError(f"the source has no field {name!r}; it has {have}")
    return cells, points


def _same(source: VolumeMesh, target: VolumeMesh) -> bool:
    """Whether two meshes have the same points and elements, in the same order."""
    return (
        np.array_equal(source.points, target.points)
        and list(source.cells) == list(target.cells)
        and all(np.array_equal(block, target.cells[kind]) for kind, block in source.cells.items())
    )


def _outside_share(there: Correspondence) -> float:
    edge = _edge(there.target)
    outside = sum(int(np.sum(pair.cells.distance > _OUTSIDE * edge)) for pair in there.pairs)
    return outside / sum(len(pair.target.cells) for pair in there.pairs)


def _record(source: VolumeMesh, target: VolumeMesh, parts: list[int], outside_share: float) -> TransferRecord:
    return TransferRecord(
        parts=[PARTS[number] for number in parts],
        source_elements=source.n_cells,
        target_elements=target.n_cells,
        source_edge_mm=round(_edge(source), 4),
        target_edge_mm=round(_edge(target), 4),
        outside_share=outside_share,
    )


def _unlost(
    record: TransferRecord, cells: dict[str, tuple[Any, Kind]], points: dict[str, tuple[Any, Kind]], back: bool
) -> TransferRecord:
    """The record with its fields: unmeasured, or with nothing lost on the way back."""
    owned = (("elements", cells), ("points", points))
    told = [_told(name, on, values, kind) for on, own in owned for name, (values, kind) in own.items()]
    if not back:
        return record.model_copy(update={"fields": told})
    none = {"back_mean": 0.0, "back_95": 0.0, "back_largest": 0.0}
    told = [one.model_copy(update=none if one.kind != "tag" else {"back_mean": 0.0}) for one in told]
    zero = {"place_back_mean_mm": 0.0, "place_back_95_mm": 0.0, "place_back_largest_mm": 0.0}
    return record.model_copy(update={"fields": told, **zero})


def _measured(
    record: TransferRecord,
    there: Correspondence,
    back: Correspondence,
    cells: dict[str, tuple[Any, Kind]],
    points: dict[str, tuple[Any, Kind]],
    new_cells: dict[str, Any],
    new_points: dict[str, Any],
) -> TransferRecord:
    """The record with what comes back."""
    source = there.source
    size = np.concatenate([element_volumes(source.points, block, kind) for kind, block in source.cells.items()])
    size = np.where(is_blood(source.region), 0.0, size)
    used = np.zeros(len(source.points))
    for pair in back.pairs:
        used[pair.target.points] = 1.0
    fields = []
    for name, (values, kind) in cells.items():
        again = carry_cells(back, new_cells[name], kind)
        fields.append(_told(name, "elements", values, kind, again, size))
    for name, (values, kind) in points.items():
        again = carry_points(back, new_points[name], kind)
        fields.append(_told(name, "points", values, kind, again, used))
    # Where each element of the source comes back: the target's places in the source, carried back.
    seen = carry_points(back, np.nan_to_num(there.places()[1]), "number")
    middle = _centres(source, seen), _centres(source, source.points)
    off = np.linalg.norm(middle[0] - middle[1], axis=1)
    mean, most, largest = _three(off, size)
    return record.model_copy(
        update={
            "fields": fields,
            "place_back_mean_mm": mean,
            "place_back_95_mm": most,
            "place_back_largest_mm": largest,
        }
    )


def _told(
    name: str, on: Any, values: Any, kind: Kind, again: Any = None, weight: FloatArray | None = None
) -> FieldRecord:
    unit = {"tag": "%", "direction": "degrees"}.get(kind, "")
    span = float(np.ptp(values)) if kind == "number" and len(values) else None
    told = FieldRecord(name=name, on=on, kind=kind, unit=unit, span=span)
    if again is None or weight is None:
        return told
    if kind == "tag":
        return told.model_copy(update={"back_mean": 100.0 * float(np.average(again != values, weights=weight))})
    if kind == "direction":
        cosine = np.abs(np.sum(values.astype(float) * again, axis=1))
        error = np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))
        weight = np.where(np.any(values, axis=1), weight, 0.0)
    else:
        error = np.abs(again.astype(float) - values)
        error = error if error.ndim == 1 else np.linalg.norm(error, axis=1)
    mean, most, largest = _three(error, weight)
    return told.model_copy(update={"back_mean": mean, "back_95": most, "back_largest": largest})


def _three(error: FloatArray, weight: FloatArray) -> tuple[float, float, float]:
    """Mean, what 95 % of the weight do not exceed, largest."""
    some = weight > 0.0
    error, weight = error[some], weight[some]
    return float(np.average(error, weights=weight)), weighted_percentile(error, weight, 95.0), float(error.max())


def _edge(mesh: VolumeMesh) -> float:
    pairs = mesh_edges(mesh.cells)
    return float(np.linalg.norm(mesh.points[pairs[:, 0]] - mesh.points[pairs[:, 1]], axis=1).mean())


def _centres(mesh: VolumeMesh, values: FloatArray) -> FloatArray:
    return np.concatenate([values[block].mean(axis=1) for block in mesh.cells.values()])


def _notices(record: TransferRecord) -> list[Notice]:
    if record.outside_share < 0.01:
        return []
    words = (
        "{amount} of the target's elements have coordinates that the source has not, as where one wall goes on; they "
        "got the values of the nearest ones"
    )
    return [Notice.of("extrapolated", words, amount=100.0 * record.outside_share, unit="%")]
