"""Anyone's volume mesh and limits in, a quality report out."""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.errors import InputError, require_kind
from femprep.mesh.length_unit import is_external, require_unit, unit_doubt
from femprep.mesh.measures.triangles import areas
from femprep.mesh.measures.volume_elements import MEASURES, centroids, element_measures
from femprep.mesh.topology import pieces
from femprep.model import FloatArray, IntArray, VolumeMesh, is_blood
from femprep.model.blocks import chosen_rows, nodes_of
from femprep.model.facets import split_facets
from femprep.model.shared_records.tissue import TissuesRecord
from femprep.options import CheckOptions, choose, takes
from femprep.volume.quality.judged import carried_failures, limits_for
from femprep.volume.quality.limits import judge
from femprep.volume.quality.neighbours import neighbours
from femprep.volume.quality.report import (
    FacetRecord,
    Histogram,
    QualityReport,
    RegionRecord,
    Statistics,
    WorstElement,
)
from femprep.volume.quality.transmural import elements_through_wall, mesh_edges
from femprep.volume.quality.validity import validity

#: Measures whose worst elements are listed; the smallest value is the worst.
_LISTED = ("scaled_jacobian", "mean_ratio", "minimum_dihedral", "characteristic_length")
#: Range of the histogram of measures that have one; the others' goes from the smallest to the largest value.
_RANGES = {
    "scaled_jacobian": (0.0, 1.0),
    "relative_jacobian": (0.0, 1.0),
    "mean_ratio": (0.0, 1.0),
    "radius_ratio": (0.0, 1.0),
    "minimum_dihedral": (0.0, 90.0),
    "maximum_dihedral": (60.0, 180.0),
}
_BINS = 20
#: A range no wider is of no width: what a bin would be of it is no number.
_LEAST = 1e-300
#: Ratios of no less are those of flat elements: their squares are no numbers.
_MOST = 1e150


@takes(CheckOptions)
def check(mesh: VolumeMesh, *, options: CheckOptions | None = None, **changes: Any) -> QualityReport:
    """Judge a mesh: element quality, orientation, boundary, points, tags.

    Parameters
    ----------
    mesh : VolumeMesh
        Elements of any types of ``femprep.mesh.elements.ELEMENTS``, mixed too; with or without tags.
    options : CheckOptions, optional
        Limits. Where not given: those by which the mesh was judged when it was made, which travel with it, unless a
        purpose is given; else those of the purpose and of the mesher that made it.
    **changes
        Limits by name in place of those given; None leaves a limit out.

    Returns
    -------
    QualityReport
        ``report.passed`` tells the verdict, ``report.failures`` why, ``report.raise_if_failed()`` raises.

    Raises
    ------
    InputError
        The mesh has no elements, an element type is not known, points are not finite, or a limit is a length or time
        and the unit of the mesh's file is not known.
    OptionError
        A limit is out of range.

    Examples
    --------
    >>> fp.check(mesh, purpose="general").validity.inverted_elements
    0
    """
    _check_input(mesh)
    limits, source = limits_for(mesh, choose(CheckOptions, options, changes))
    if limits.minimum_time_step is not None or limits.maximum_edge_by_space_constant is not None:
        require_unit(mesh)
    measures = {name: element_measures(mesh.points, block, name) for name, block in mesh.cells.items() if len(block)}
    found = {key: [values[key] for values in measures.values() if key in values] for key in MEASURES}
    overall = {key: own[0] if len(own) == 1 else np.concatenate(own) for key, own in found.items() if own}
    faces = neighbours(mesh.cells, overall["volume"])
    sound = validity(mesh, overall["relative_jacobian"], faces)
    edges = mesh_edges(mesh.cells)
    length = np.linalg.norm(mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]], axis=1)
    through = elements_through_wall(mesh, None if is_blood(mesh.region).any() else edges)
    through = through[through >= 0]
    by_type = {name: _summary(values) for name, values in measures.items()}
    lengths = statistics(length, "mm")
    facet_tags, notes = _facet_records(mesh), []
    if mesh.n_facets == 0:
        notes.append("no facet tags: boundary conditions have nothing to name")
    elif len(through) == 0:
        notes.append("elements through the wall are not counted: no facets tagged endo and epi")
    if doubt := unit_doubt(mesh):
        notes.append(doubt)
    small = overall["characteristic_length"]
    sizes: dict[str, float | None] = {
        "time_step": 1e3 * max(float(small.min()), 0.0) / limits.wave_speed,
        "size_ratio": float(small.min() / np.median(small)) if small.min() > 0 else 0.0,
        "volume_ratio": faces.volume_ratio,
        "edge_by_space_constant": float(length.mean()) / limits.space_constant,
    }
    worst = _worst(mesh, measures, limits.worst)
    verdicts, failures = judge(measures, sound, facet_tags, sizes, limits, worst)
    # A mesh of another program may be of parts that were not joined.
    apart = [f"{sound.pieces} unconnected pieces"] if sound.pieces > 1 and is_external(mesh) else []
    used = mesh.points[nodes_of(mesh.cells)]
    low, high = used.min(axis=0).tolist(), used.max(axis=0).tolist()
    return QualityReport(
        n_points=len(mesh.points),
        cells={name: len(block) for name, block in mesh.cells.items()},
        facets={name: len(block) for name, block in mesh.facets.items()},
        volume=float(overall["volume"].sum()),
        bounds=((low[0], low[1], low[2]), (high[0], high[1], high[2])),
        regions={
            name: RegionRecord(
                tag=tag,
                elements=int((mesh.region == tag).sum()),
                volume=float(overall["volume"][mesh.region == tag].sum()),
            )
            for name, tag in mesh.region_names.items()
        },
        facet_tags=facet_tags,
        measures=next(iter(by_type.values())) if len(by_type) == 1 else _summary(overall),
        measures_by_type=by_type,
        edge_length=lengths,
        elements_through_wall=_count_statistics(through) if len(through) else None,
        time_step=float(sizes["time_step"] or 0.0),
        volume_ratio=sizes["volume_ratio"],
        worst=worst,
        validity=sound,
        tissues=TissuesRecord(**mesh.info["tissues"]) if "tissues" in mesh.info else None,
        options=limits,
        limits_from=source,
        limits=verdicts,
        failures=(*failures, *apart, *carried_failures(mesh)),
        notes=tuple(notes),
    )


def _summary(measures: dict[str, FloatArray]) -> dict[str, Statistics]:
    """Distribution of each measure over the elements on which it is finite: ratios of flat elements are not."""
    sound = {key: np.abs(values) < _MOST for key, values in measures.items()}
    finite = {key: values if sound[key].all() else values[sound[key]] for key, values in measures.items()}
    return {key: statistics(value, MEASURES[key], _RANGES.get(key)) for key, value in finite.items() if len(value)}


def statistics(
    values: FloatArray, unit: str, bounds: tuple[float, float] | None = None, bins: int = _BINS
) -> Statistics:
    """Distribution of values ``(n,)``, n at least 1; those out of bounds count into the outermost bins."""
    low, high = bounds or (float(values.min()), float(values.max()))
    if high - low <= 1e-9 * abs(high) + _LEAST:  # too narrow for bins of their own
        half = 0.5 * max(abs(low), abs(high))
        half = half if half > _LEAST else 0.5
        low, high = low - half, high + half
    shares = (0, 1, 5, 25, 50, 75, 95, 99, 100)
    found = dict(zip(shares, np.percentile(values, shares).tolist()))
    counts, edges = np.histogram(np.clip(values, low, high), bins=bins, range=(low, high))
    return Statistics(
        unit=unit,
        count=len(values),
        min=found.pop(0),
        mean=float(values.mean()),
        median=found.pop(50),
        max=found.pop(100),
        standard_deviation=float(values.std()),
        percentiles={str(share): value for share, value in found.items()},
        histogram=Histogram(edges=tuple(edges.tolist()), counts=tuple(counts.tolist())),
    )


def _count_statistics(values: IntArray) -> Statistics:
    """Distribution of whole numbers, a bin of the histogram for each of them."""
    low, high = int(values.min()), int(values.max())
    return statistics(values.astype(np.float64), "elements", (low - 0.5, high + 0.5), high - low + 1)


def _check_input(mesh: VolumeMesh) -> None:
    require_kind(mesh, VolumeMesh, "read_mesh")
    if mesh.n_cells == 0:
        raise InputError("the mesh has no volume elements; check takes tetrahedra, wedges and hexahedra")
    if not np.isfinite(mesh.points).all():
        row = int(np.argmin(np.isfinite(mesh.points).all(axis=1)))
        raise InputError(f"point {row} of the mesh is {mesh.points[row].tolist()}; every coordinate must be finite")


def _worst(mesh: VolumeMesh, measures: dict[str, dict[str, FloatArray]], count: int) -> tuple[WorstElement, ...]:
    """The worst elements by each of the listed measures."""
    names = {tag: name for name, tag in mesh.region_names.items()}
    blocks, first = list(measures), np.cumsum([0, *(len(mesh.cells[name]) for name in measures)])
    out = []
    for measure in _LISTED:
        tables = [table[measure] for table in measures.values()]
        values = tables[0] if len(tables) == 1 else np.concatenate(tables)
        for element in _smallest(values, count).tolist():
            block = int(np.searchsorted(first, element, side="right")) - 1
            kind, row = blocks[block], element - int(first[block])
            x, y, z = centroids(mesh.points, mesh.cells[kind][row : row + 1], kind)[0].tolist()
            out.append(
                WorstElement(
                    measure=measure,
                    value=float(values[element]),
                    element=element,
                    type=kind,
                    region=names[int(mesh.region[element])],
                    centroid=(x, y, z),
                )
            )
    return tuple(out)


def _smallest(values: FloatArray, count: int) -> IntArray:
    """Places of the smallest values, ascending, equal ones in their order."""
    if 0 < count < len(values):
        near = np.flatnonzero(values <= np.partition(values, count - 1)[count - 1])
    else:
        near = np.arange(len(values))
    return np.asarray(near[np.argsort(values[near], kind="stable")][:count])


def _facet_records(mesh: VolumeMesh) -> dict[str, FacetRecord]:
    """Counts, areas, pieces and flatness of the facets of each tag."""
    records = {}
    for name, tag in mesh.facet_names.items():
        chosen = chosen_rows(mesh.facets, mesh.facet_tag == tag)
        split, points = split_facets(chosen), nodes_of(chosen)
        plane = mesh.planes.get(name)
        records[name] = FacetRecord(
            tag=tag,
            facets=sum(map(len, chosen.values())),
            area=float(areas(mesh.points, split).sum()),
            pieces=int(pieces(split).max()) + 1,
            off_plane=None if plane is None else float(np.abs(plane.signed_distance(mesh.points[points])).max()),
        )
    return records
