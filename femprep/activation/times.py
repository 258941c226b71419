"""VolumeMesh with fibres in, the same with the time at which a beat activates each of its points out.

The beat leaves the roots of the Purkinje fibres at 0 and enters the wall at their junctions; without such fibres it
begins at all nodes of the endocardia at once, as the stimuli of the openCARP files do. Through the wall it spreads by
the speeds along fibres, sheets and across: the eikonal equation, solved on the tetrahedra into which elements are cut
(:mod:`femprep.mesh.eikonal`). It tells within seconds whether fibres, nodes and stimuli fit each other, before a solver
needs hours for it: what is reached late or never is seen at once.

Atria, vessels and blood conduct none of it; scar and other tissue of a second image conducts as the wall it lies in.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np

from femprep.anatomy.tissue.regions import WALL_REGION
from femprep.errors import InputError
from femprep.export.deck.fibres import directions
from femprep.export.deck.names import facet_nodes
from femprep.mesh.eikonal import first_times
from femprep.mesh.elements import ELEMENTS
from femprep.mesh.length_unit import require_unit
from femprep.mesh.operations.element_tets import mesh_tets
from femprep.model import (
    REGION_TAGS,
    BoolArray,
    FloatArray,
    IntArray,
    Notice,
    VolumeMesh,
    endo_tags,
    is_blood,
    noted,
    without_failure,
)
from femprep.model.blocks import block_rows
from femprep.options import ActivationOptions, choose, takes

#: Name of the point data, and the time of points that are never reached, as openCARP has it.
ACTIVATION: Final = "activation"
NEVER: Final = -1.0
#: Regions whose muscle conducts the beat of the ventricles.
_VENTRICLES: Final = tuple(REGION_TAGS[name] for name in ("lv", "rv", "septum"))
#: Regions that do not.
_OTHERS: Final = tuple(REGION_TAGS[name] for name in ("la", "ra", "aorta", "pulmonary_artery"))


@takes(ActivationOptions)
def add_activation(mesh: VolumeMesh, options: ActivationOptions | None = None, **changes: Any) -> VolumeMesh:
    """Add the time at which a beat activates each point of the ventricles.

    Parameters
    ----------
    mesh : VolumeMesh
        With fibres (``fiber`` and ``sheet`` in ``cell_data``), of any element types; with Purkinje fibres or facets
        tagged as endocardium of a ventricle, where the beat begins.
    options : ActivationOptions, optional
        Speeds; also by keyword.

    Returns
    -------
    VolumeMesh
        With ``activation`` in ``point_data``, ms; -1 where the beat never comes. ``info["activation"]``: options, where
        it begins, when the last point is reached and where.

    Raises
    ------
    InputError
        The mesh has no fibres or nothing to begin from, or an element is inverted.

    References
    ----------
    Fu, Kirby and Whitaker 2013, doi 10.1137/120881956 (eikonal equation); Caldwell et al. 2009,
    doi 10.1161/CIRCEP.108.830133 (speeds)

    Examples
    --------
    >>> fibred = fp.add_fibres(mesh, axes=fp.ventricular_axes(seg))
    >>> bool((fp.add_activation(fibred).point_data["activation"] >= 0).all())
    True
    """
    chosen = choose(ActivationOptions, options, changes)
    fibre, sheet = require_fibres(mesh)
    region = np.asarray(mesh.cell_data.get(WALL_REGION, mesh.region))
    tissue = np.isin(region, _VENTRICLES)
    if not tissue.any():  # a mesh with numbers of its own
        tissue = ~is_blood(region) & ~np.isin(region, _OTHERS)
    tets, row = _tetrahedra(mesh, tissue)
    wall = np.zeros(len(mesh.points), dtype=bool)
    wall[tets] = True
    source, nodes, times = _beginning(mesh, wall)
    speeds = (chosen.fibre_speed, chosen.sheet_speed, chosen.normal_speed)
    first = first_times(mesh.points, tets, _metric(fibre[row], sheet[row], speeds), nodes, times)
    first = _middles(mesh, first, tissue)
    reached = np.isfinite(first)
    missed = np.flatnonzero(wall & ~reached)
    value = np.where(reached, first, NEVER)
    last = int(np.argmax(value))
    record: dict[str, Any] = {
        "options": chosen.model_dump(),
        "begins": source,
        "stimuli": len(nodes),
        "first_ms": round(float(first[reached].min()), 3),
        "last_ms": round(float(value[last]), 3),
        "last_at": np.round(mesh.points[last], 2).tolist(),
        "never_reached": len(missed),
    }
    if len(missed):
        words = f"{len(missed)} points of the ventricles are never activated, the first near {{place}}: no way is there"
        record = noted(record, Notice.of("left out", words, place=mesh.points[missed[0]]))
    info = {**without_failure(mesh.info, ACTIVATION), ACTIVATION: record}
    return replace(mesh.with_data(point={ACTIVATION: value}), info=info)


def require_fibres(mesh: VolumeMesh) -> tuple[FloatArray, FloatArray]:
    """Fibre and sheet direction of each element, which whoever grows a tree first may ask for before.

    Raises
    ------
    InputError
        The mesh has none, they are no directions, or the unit of the mesh's file is not known.
    """
    require_unit(mesh)
    found = directions(mesh)
    if found is None:
        raise InputError(
            "activation runs along fibres, which the mesh does not have; add them (add_fibres, or --fibres)"
        )
    return found


def _tetrahedra(mesh: VolumeMesh, tissue: BoolArray) -> tuple[IntArray, IntArray]:
    """Tetrahedra of the elements that conduct, and which element each is of."""
    tets, row = mesh_tets(mesh.cells)
    kept = tissue[row]
    return tets[kept], row[kept]


def _beginning(mesh: VolumeMesh, wall: BoolArray) -> tuple[str, IntArray, FloatArray]:
    """Where a beat begins and when, ms."""
    net = mesh.purkinje
    if net is not None:
        ends = net.junctions
        return "junctions of the Purkinje fibres", net.mesh_point[ends], net.arrival[ends]
    tags = [tag for tag in endo_tags() if np.any(mesh.facet_tag == tag)]
    nodes = np.unique(np.concatenate([np.empty(0, np.int64), *(facet_nodes(mesh, tag, corners=True) for tag in tags)]))
    nodes = nodes[wall[nodes]]
    if not len(nodes):
        have = ", ".join(mesh.facet_names) or "none"
        raise InputError(f"activation begins at Purkinje fibres or at facets of an endocardium; this mesh has {have}")
    return "all nodes of the endocardia", nodes, np.zeros(len(nodes))


def _metric(fibre: FloatArray, sheet: FloatArray, speeds: tuple[float, float, float]) -> FloatArray:
    """Inverse of the tensor of squared speeds, ms2/mm2: 1 m/s is 1 mm/ms."""
    out = np.zeros((len(fibre), 3, 3))
    for axis, speed in zip((fibre, sheet, np.cross(fibre, sheet)), speeds):
        out += np.einsum("ni,nj->nij", axis, axis) / speed**2
    return out


def _middles(mesh: VolumeMesh, values: FloatArray, tissue: BoolArray) -> FloatArray:
    """Mid-side nodes of the elements that conduct get the mean of their two ends."""
    out = values.copy()
    for kind, block, own in block_rows(mesh.cells):
        element = ELEMENTS[kind]
        if element.quadratic:
            chosen = block[tissue[own]]
            for k, (i, j) in enumerate(element.edges):
                out[chosen[:, element.corners + k]] = (values[chosen[:, i]] + values[chosen[:, j]]) / 2
    return out
