"""VolumeMesh in, the same mesh with an AHA segment for every element and facet out.

The 17 segments of Cerqueira et al. 2002 (doi 10.1161/hc0402.102975). The long axis from the base to the end of the LV
cavity is cut into equal thirds, across the axis: basal (1-6), mid (7-12), apical (13-16); what lies beyond the cavity
is the apex (17). Round the axis a basal or mid segment spans 60 degrees, an apical one 90, counted from the middle of
the septum (of the two RV insertion points, where the axes come from labels), positive to the front::

    basal, mid     0- 60 anteroseptal 2, 8        apical   -45- 45 septal    14
                  60-120 anterior     1, 7                  45-135 anterior  13
                 120-180 anterolateral 6, 12               135-225 lateral   16
                 180-240 inferolateral 5, 11               225-315 inferior  15
                 240-300 inferior     4, 10
                 300-360 inferoseptal 3, 9

No standard divides the RV. Here its free wall has nine segments, 21-29: the same three levels, each in thirds of the
angle that the RV free wall spans about the LV's long axis at that level, from the front to the diaphragm: anterior (21,
24, 27), lateral (22, 25, 28), inferior (23, 26, 29); below the end of the LV cavity it belongs to the apical level. The
septum is the LV's.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.anatomy.axes.find_axes import facets_of, ventricular_axes
from femprep.anatomy.axes.ventricular_axes import BASE_FACETS, VentricularAxes, septum_notices
from femprep.anatomy.laplace.fields import WallFields
from femprep.anatomy.part import refuse_blood
from femprep.errors import InputError
from femprep.mesh.elements import match_facets
from femprep.mesh.measures.volume_elements import all_centroids, all_volumes
from femprep.model import FACET_TAGS, BoolArray, FloatArray, VolumeMesh, noted
from femprep.model.arrays import floats
from femprep.model.blocks import chosen_rows, nodes_of
from femprep.model.facets import centres_and_areas

#: Names of the segments: 1-17 of the left ventricle, 21-29 of the right ventricular free wall.
SEGMENTS: Final = MappingProxyType(
    {
        **{
            1 + 6 * level + k: f"{name} {side}"
            for level, name in enumerate(("basal", "mid"))
            for k, side in enumerate(
                ("anterior", "anteroseptal", "inferoseptal", "inferior", "inferolateral", "anterolateral")
            )
        },
        **{13 + k: f"apical {side}" for k, side in enumerate(("anterior", "septal", "inferior", "lateral"))},
        17: "apex",
        **{
            21 + 3 * level + k: f"RV {name} {side}"
            for level, name in enumerate(("basal", "mid", "apical"))
            for k, side in enumerate(("anterior", "lateral", "inferior"))
        },
    }
)

_SIXTHS: Final = np.array([2, 1, 6, 5, 4, 3])
_QUARTERS: Final = np.array([14, 13, 16, 15])


def add_aha(mesh: VolumeMesh, *, axes: VentricularAxes | None = None, fields: WallFields | None = None) -> VolumeMesh:
    """Add AHA segments to a mesh.

    Parameters
    ----------
    mesh : VolumeMesh
        With facets tagged ``endo`` (or ``endo_lv``, ``endo_rv``), ``epi`` and ``base``.
    axes : VentricularAxes, optional
        From labels, for the septum and the hand; found from the mesh where not given. Where nothing tells the septum
        it is assumed, which ``info["aha"]`` says.
    fields : WallFields, optional
        Of this mesh, where they exist already; needed for both ventricles only, to tell the RV's wall from the LV's.

    Returns
    -------
    VolumeMesh
        With ``aha`` (int32) in ``cell_data`` and ``facet_data``, and ``info["aha"]``: volume of each segment, mm3.

    Raises
    ------
    InputError
        Facets are missing, or base and end of the cavity lie at the same height.

    References
    ----------
    Cerqueira et al. 2002, doi 10.1161/hc0402.102975

    Examples
    --------
    >>> segments = fp.add_aha(mesh, axes=fp.ventricular_axes(seg)).cell_data["aha"]
    >>> sorted(set(segments.tolist())) == list(range(1, 18))
    True
    """
    refuse_blood(mesh)
    axes = (fields.axes if fields else axes) or ventricular_axes(mesh)
    endo, _ = facets_of(mesh, "endo", "endo_lv")
    rv_endo, _ = facets_of(mesh, "endo_rv")
    base, _ = facets_of(mesh, *BASE_FACETS)
    if not len(endo) or not len(base):
        raise InputError(f"AHA segments need facets tagged endo and base; the mesh has {', '.join(mesh.facet_names)}")
    bottom, top = _cavity_end(mesh, axes), float(axes.height(base).mean())
    if not top - bottom > 1e-6:
        raise InputError(f"the LV cavity ends {bottom:.1f} mm and the base lies {top:.1f} mm above the apex: no room")

    centre, volume = all_centroids(mesh.points, mesh.cells), all_volumes(mesh.points, mesh.cells)
    facet, _ = centres_and_areas(mesh.points, mesh.facets)
    cell_rv, facet_rv = np.zeros(len(centre), dtype=bool), np.zeros(len(facet), dtype=bool)
    if len(rv_endo):
        fields = fields or WallFields(mesh, axes)
        cell_rv = rv_free_wall(fields)
        element, _ = match_facets(mesh.cells, mesh.facets)
        facet_rv = cell_rv[element] & (element >= 0)
    span = _rv_span(axes, centre[cell_rv], bottom, top) if cell_rv.any() else None
    cell = _segments(axes, centre, bottom, top, cell_rv, span)
    on_facets = _segments(axes, facet, bottom, top, facet_rv, span)
    record: dict[str, Any] = {
        "volumes_mm3": {int(k): round(float(volume[cell == k].sum()), 3) for k in np.unique(cell)},
        "cavity_end_mm": round(bottom, 3),
        "base_mm": round(top, 3),
        "empty": [k for k in range(1, 18) if not np.any(cell == k)],
    }
    if "septal" in axes.info.get("assumed", ()):
        record["assumed"] = "where the septum lies: nothing in the mesh tells"
    if "hand" in axes.info.get("assumed", ()):
        record["assumed_hand"] = "the heart is not mirrored: nothing in the mesh tells"
    record = noted(record, *septum_notices(axes))
    info = {**mesh.info, "axes": axes.record(), "aha": record}
    return replace(mesh.with_data(cell={"aha": cell}, facet={"aha": on_facets}), info=info)


def segment_means(mesh: VolumeMesh, values: npt.ArrayLike, *, largest: int = 17) -> FloatArray:
    """Volume-weighted mean of a value per element in each segment.

    Parameters
    ----------
    mesh : VolumeMesh
        With ``cell_data["aha"]``.
    values : (n_cells,) array
        One value per element.
    largest : int
        Means of segments 1 to this one.

    Returns
    -------
    (largest,) array
        NaN for a segment without elements.
    """
    if "aha" not in mesh.cell_data:
        raise InputError("the mesh has no AHA segments; call add_aha first")
    values = floats(values, "values")
    if values.shape != (mesh.n_cells,):
        raise InputError(f"values have shape {values.shape}, expected one per element, ({mesh.n_cells},)")
    volume = all_volumes(mesh.points, mesh.cells)
    segment = np.minimum(mesh.cell_data["aha"], largest + 1)
    weight = np.bincount(segment, weights=volume, minlength=largest + 2)[1 : largest + 1]
    total = np.bincount(segment, weights=volume * values, minlength=largest + 2)[1 : largest + 1]
    mean: FloatArray = np.divide(total, weight, out=np.full(largest, np.nan), where=weight > 0)
    return mean


def _segments(
    axes: VentricularAxes,
    points: FloatArray,
    bottom: float,
    top: float,
    rv: BoolArray,
    span: FloatArray | None,
) -> npt.NDArray[np.int32]:
    level = _level(axes, points, bottom, top)
    angle = axes.angle(points)
    ring = _SIXTHS[np.minimum((angle // 60).astype(int), 5)]
    quarter = _QUARTERS[((angle + 45) % 360 // 90).astype(int) % 4]
    out = np.select([level == 0, level == 1, level == 2], [ring, ring + 6, quarter], default=17)
    if span is not None:
        row = np.minimum(level, 2)
        share = (span[row, 1] - axes.turn(points)) / np.maximum(span[row, 1] - span[row, 0], 1e-9)  # 0 at the front
        third = np.clip(np.floor(3 * share).astype(int), 0, 2)
        out = np.where(rv, 21 + 3 * row + third, out)
    return np.asarray(out, dtype=np.int32)


def _level(axes: VentricularAxes, points: FloatArray, bottom: float, top: float) -> npt.NDArray[np.int64]:
    """0 basal, 1 mid, 2 apical, 3 beyond the end of the cavity."""
    share = (top - axes.height(points)) / (top - bottom)
    return np.where(share >= 1.0, 3, np.clip(np.floor(3 * share), 0, 2)).astype(np.int64)


def _rv_span(axes: VentricularAxes, points: FloatArray, bottom: float, top: float) -> FloatArray:
    """Smallest and largest angle of the RV free wall at the three levels, degrees in (-180, 180], ``(3, 2)``."""
    level, angle = np.minimum(_level(axes, points, bottom, top), 2), axes.turn(points)
    whole = np.percentile(angle, [1, 99])
    rows = [np.percentile(angle[level == k], [1, 99]) if np.any(level == k) else whole for k in range(3)]
    return np.array(rows)


def _cavity_end(mesh: VolumeMesh, axes: VentricularAxes) -> float:
    """Height of the lowest point of the LV endocardium above the apex, mm."""
    endo = np.isin(mesh.facet_tag, [FACET_TAGS["endo"], FACET_TAGS["endo_lv"]])
    return float(axes.height(mesh.points[nodes_of(chosen_rows(mesh.facets, endo))]).min(initial=np.inf))


def rv_free_wall(fields: WallFields) -> BoolArray:
    """Elements of the right ventricle outside the septum, where tissue lies nearer to the epicardium than to the LV."""
    across, outside = fields.space.to_cells(fields.across), fields.space.to_cells(fields.outside)
    return np.asarray((fields.space.to_cells(fields.side) < 0) & (outside >= 0.5 * (1 - np.abs(across))))
