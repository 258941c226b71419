r"""VolumeMesh in, the same mesh with fibre, sheet and normal directions out. Here stands the one sign convention.

At each point there are three directions: l from apex to base, along the wall; t outward, through the wall; and
c = l x t, round the wall. Seen from outside with the base up, c points to the right::

              base                                    base
          l                                        \    \    \
          ^    / fibre, helix angle > 0              \    \    \       epicardium, -60 degrees
          |   /                                        \    \    \     (a left-handed helix)
          |  /  )  angle                          ----------------------
          | /   )                                      /    /    /
          +----------> c                             /    /    /       endocardium, +60 degrees,
         t points at you                           /    /    /         seen through the wall from outside
                                                                       (a right-handed helix)
              apex                                    apex

    fibre  f = cos(a) c + sin(a) l        helix angle a: positive where the fibre climbs to the right seen from outside
    across x = cos(a) l - sin(a) c        in the wall, across the fibre
    sheet  s = cos(b) t + sin(b) x        sheet angle b: 0 where the sheet runs straight through the wall
    normal n = f x s                      so f, s, n are right-handed

A positive angle is a right-handed helix, whatever the position of the heart; an anatomical heart has +60 degrees at the
endocardium and -60 at the epicardium, more or less (Streeter et al. 1969, doi 10.1161/01.RES.24.3.339). In the RV wall
outward is out of the RV; in the septum the fibres of both sides, each with its endocardial angle, meet at angle 0.
Bayer et al. count the sheet angle from the wall's tangent plane: b = their beta + 90 degrees. The sign of a direction
has no meaning: f and -f are the same fibre.

A mirror image of a heart has the mirror image of its fibres. Where the axes say that the heart is mirrored, the helix
angles are reversed, which is logged and stands in ``info["fibres"]``; ``mirrored="no"`` takes the heart as it lies.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from femprep.anatomy.axes.ventricular_axes import VentricularAxes, hand_notices
from femprep.anatomy.frames import make_frames
from femprep.anatomy.laplace.fields import WallFields
from femprep.anatomy.laplace.shapes import quadrature
from femprep.anatomy.laplace.valves import closed_valves
from femprep.anatomy.rules import Sites, at_centres, at_points, node_fields, triads
from femprep.errors import InputError
from femprep.model import FloatArray, Notice, VolumeMesh, frozen, noted, without_failure
from femprep.model.arrays import floats
from femprep.options import FibreOptions, choose, takes

logger = logging.getLogger(__name__)

#: Names of the three directions of a triad.
_NAMES: Final = ("fiber", "sheet", "normal")


@takes(FibreOptions)
def add_fibres(
    mesh: VolumeMesh,
    options: FibreOptions | None = None,
    *,
    axes: VentricularAxes | None = None,
    fields: WallFields | None = None,
    **changes: Any,
) -> VolumeMesh:
    """Add rule-based fibre, sheet and normal directions to a mesh of the LV or of both ventricles.

    Parameters
    ----------
    mesh : VolumeMesh
        Of any element types, with facets tagged ``endo`` (or ``endo_lv``, ``endo_rv``), ``epi``, ``base``, and ``apex``
        where the wall is cut there.
    options : FibreOptions, optional
        Angles and rule; also by keyword, as in ``endo_angle=60.0, epi_angle=-60.0``.
    axes : VentricularAxes, optional
        From labels, for the hand; found from the mesh where not given.
    fields : WallFields, optional
        Of this mesh, where they exist already: nothing is solved twice.

    Returns
    -------
    VolumeMesh
        With ``fiber``, ``sheet`` and ``normal``, ``(n, 3)`` unit vectors, in ``cell_data`` and, with ``nodes=True``, in
        ``point_data``; and ``info["fibres"]``: angles, rule, hand, the correlation of depth and helix angle.

    Raises
    ------
    InputError
        Facets are missing, or a piece of the mesh touches no tagged boundary.
    OptionError
        An angle is out of range.

    References
    ----------
    Bayer et al. 2012, doi 10.1007/s10439-012-0593-5; for open valves (``rule="doste"``) Doste et al. 2019,
    doi 10.1002/cnm.3185

    Examples
    --------
    >>> fibred = fp.add_fibres(mesh, axes=fp.ventricular_axes(seg), endo_angle=60.0, epi_angle=-60.0)
    >>> fibred.cell_data["fiber"].shape == (mesh.n_cells, 3)
    True
    """
    chosen = choose(FibreOptions, options, changes)
    fields = fields or WallFields(mesh, axes)
    mirrored = _mirrored(fields, chosen)
    nodes = node_fields(fields, chosen.rule)
    # Some elements at a time: on the way there are twenty times as many numbers as in what comes out.
    cell = {name: np.empty((fields.space.n_cells, 3)) for name in _NAMES}
    degenerate = np.empty(fields.space.n_cells, dtype=np.bool_)
    free = []
    for rows, corners in fields.space.parts():
        sites = at_centres(nodes, corners)
        result, degenerate[rows] = triads(sites, chosen, biventricular=fields.biventricular, mirrored=mirrored)
        for name, values in _named(result).items():
            cell[name][rows] = values
        free.append(_free_walls(sites, result[:, :, 0], mirrored))
    cell = {name: frozen(values) for name, values in cell.items()}
    point = None
    if chosen.nodes:
        point = _named(_at_all_points(fields, nodes, chosen, mirrored))
    record: dict[str, Any] = {
        **chosen.model_dump(),
        "mirrored": mirrored,
        "convention": "helix angle positive where a fibre climbs to the right seen from outside with the base up",
        "degenerate_elements": int(np.count_nonzero(degenerate)),
        "depth_angle_correlation": _correlation(free),
    }
    if "hand" in fields.axes.info.get("assumed", ()) and chosen.mirrored == "auto":
        record["assumed"] = "the heart is not mirrored: nothing in the mesh tells"
    if chosen.mirrored == "auto":
        record = noted(record, *hand_notices(fields.axes))
    for ventricle, names in closed_valves(fields).items() if chosen.rule == "doste" else ():
        words = f"the {ventricle} has no outflow tract, as it has no open {' and '.join(names)} valve"
        record = noted(record, Notice.of("assumed", words))
    if degenerate.any():
        where = fields.space.to_cells(mesh.points[fields.space.nodes])[np.flatnonzero(degenerate)[0]]
        words = "{amount} have no fibre direction of their own, the first near {place}: theirs follows from no rule"
        notice = Notice.of("assumed", words, amount=np.count_nonzero(degenerate), unit="elements", place=where)
        record = noted(record, notice)
    info = {**without_failure(mesh.info, "fibres"), "axes": fields.axes.record(), "fibres": record}
    return replace(mesh.with_data(cell=cell, point=point), info=info)


@takes(FibreOptions)
def quadrature_fibres(
    mesh: VolumeMesh,
    options: FibreOptions | None = None,
    *,
    points: Mapping[str, FloatArray] | None = None,
    axes: VentricularAxes | None = None,
    fields: WallFields | None = None,
    **changes: Any,
) -> dict[str, FloatArray]:
    """Fibre, sheet and normal at the quadrature points of each element.

    Parameters
    ----------
    mesh, options, axes, fields, **changes
        As for :func:`add_fibres`.
    points : mapping of str to (q, 3) array, optional
        Reference points by element type, on the reference elements of
        :func:`femprep.anatomy.laplace.shapes.shape_functions`. Where not given: four points of a tetrahedron (degree
        2), six of a wedge, eight of a hexahedron.

    Returns
    -------
    dict of str to (k, q, 3, 3) array
        By element type: for each element and point a matrix whose columns are fibre, sheet and normal.

    Examples
    --------
    >>> list(fp.quadrature_fibres(mesh, axes=fp.ventricular_axes(seg)))
    ['tetra']
    """
    chosen = choose(FibreOptions, options, changes)
    fields = fields or WallFields(mesh, axes)
    mirrored = _mirrored(fields, chosen)
    nodes = node_fields(fields, chosen.rule)
    out = {}
    for name in fields.space.block_names:
        at = floats((points or {}).get(name, default_points(name)), f"quadrature points of {name!r}")
        if at.ndim != 2 or at.shape[1] != 3:
            raise InputError(f"quadrature points of {name!r} have shape {at.shape}, expected (q, 3)")
        sites = at_points(fields.space, nodes, name, at)
        result, _ = triads(sites, chosen, biventricular=fields.biventricular, mirrored=mirrored)
        out[name] = result.reshape(-1, len(at), 3, 3)
    return out


def default_points(name: str) -> FloatArray:
    """Reference points ``(q, 3)`` of a quadrature of degree 2 or more for an element type."""
    if name.startswith("tetra"):
        far, near = 0.5854101966249685, 0.1381966011250105
        return np.full((4, 3), near) + (far - near) * np.vstack([np.zeros(3), np.eye(3)])
    return quadrature(name)[0]


def helix_angle(fibre: FloatArray, to_base: FloatArray, outward: FloatArray) -> FloatArray:
    """Helix angle of fibres ``(n, 3)``, degrees in (-90, 90], in the frame of an upward and an outward direction."""
    frames, _ = make_frames(to_base, outward)
    along = np.einsum("nij,ni->nj", frames[:, :, :2], fibre)
    angle = np.degrees(np.arctan2(along[:, 1], along[:, 0]))
    return np.asarray(90.0 - (90.0 - angle) % 180.0, dtype=np.float64)


def _mirrored(fields: WallFields, options: FibreOptions) -> bool:
    if options.mirrored != "auto":
        return options.mirrored == "yes"
    if fields.axes.mirrored:
        logger.warning("the heart is a mirror image: its fibres are mirrored too; flip the heart or say mirrored='no'")
    return bool(fields.axes.mirrored)


def _at_all_points(fields: WallFields, nodes: Sites, options: FibreOptions, mirrored: bool) -> FloatArray:
    """Triads at all points of the mesh, mid-side nodes with the mean fields of their two ends."""
    everywhere = nodes.each(fields.space.to_points)
    return triads(everywhere, options, biventricular=fields.biventricular, mirrored=mirrored)[0]


def _named(result: FloatArray) -> dict[str, FloatArray]:
    return {name: result[:, :, i] for i, name in enumerate(_NAMES)}


def _free_walls(cells: Sites, fibre: FloatArray, mirrored: bool) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Depth and helix angle at the elements of each free wall, as measured on the fibres.

    The angle is the anatomical one: that of a mirrored heart is the negative of what is measured on its mesh.
    """
    out = {}
    free = cells.outside >= 0.5 * (1 - np.abs(cells.across))
    for name, side, outward in (("lv", cells.across >= 0, -1.0), ("rv", cells.across < 0, 1.0)):
        at = free & side
        angle = helix_angle(fibre[at], cells.to_base[at], outward * cells.to_across[at])
        out[name] = 1 - np.abs(cells.across_distance[at]), -angle if mirrored else angle
    return out


def _correlation(parts: list[dict[str, tuple[FloatArray, FloatArray]]]) -> dict[str, float | None]:
    """Pearson correlation of depth and helix angle over the elements of each free wall."""
    out: dict[str, float | None] = {}
    for name in ("lv", "rv"):
        depth, angle = (np.concatenate([part[name][i] for part in parts]) for i in (0, 1))
        if not len(angle):
            continue
        flat = np.ptp(angle) < 1e-6 or np.ptp(depth) < 1e-12
        out[name] = None if flat else round(float(np.corrcoef(depth, angle)[0, 1]), 4)
    return out
