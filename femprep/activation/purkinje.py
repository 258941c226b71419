"""VolumeMesh in, the same with a net of Purkinje fibres on the endocardia of its ventricles out.

On each endocardium a fractal tree grows from the root of its bundle branch. Its points are laid onto the facets, and
each end is led on, within the facet it lies in, to the nearest node of the mesh that no other end has: the junction.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np

from femprep.activation.growth import grow, require_growth
from femprep.activation.roots import find_root
from femprep.anatomy import VentricularAxes, ventricular_axes
from femprep.errors import InputError
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import FACET_TAGS, FloatArray, IntArray, Notice, PurkinjeNet, VolumeMesh, noted
from femprep.model.facets import facet_triangles
from femprep.options import PurkinjeOptions, choose, takes

#: Endocardia that have a tree, and which ventricle each is of.
ENDOCARDIA: Final = {"endo": "lv", "endo_lv": "lv", "endo_rv": "rv"}
#: An end nearer than this to a node is that node, mm.
_SAME: Final = 1e-9
#: A root that was given is brought to a node; less than this is not worth a word, mm.
_MOVED: Final = 0.05


@takes(PurkinjeOptions)
def add_purkinje(
    mesh: VolumeMesh,
    options: PurkinjeOptions | None = None,
    *,
    axes: VentricularAxes | None = None,
    **changes: Any,
) -> VolumeMesh:
    """Grow Purkinje fibres on the endocardia of a mesh.

    Parameters
    ----------
    mesh : VolumeMesh
        Of any element types, with facets tagged ``endo``, or ``endo_lv`` and ``endo_rv``.
    options : PurkinjeOptions, optional
        Lengths and angles; also by keyword.
    axes : VentricularAxes, optional
        For the side of the septum; those of the mesh where not given.

    Returns
    -------
    VolumeMesh
        With ``purkinje``. All its points lie on the (flat) facets of the endocardia, all its ends are points of the
        mesh. ``info["purkinje"]``: options, points, junctions and length of each tree, root.

    Raises
    ------
    InputError
        The mesh has no endocardium of a ventricle, or an option is wrong.
    MissingDependencyError
        fractal-tree is not installed.
    StageError
        Nothing grew from a root.

    References
    ----------
    Sahli Costabal et al. 2016, doi 10.1016/j.jbiomech.2015.12.025

    Examples
    --------
    >>> axes = fp.ventricular_axes(seg)
    >>> grown = fp.add_purkinje(mesh, axes=axes, generations=3)  # doctest: +SKIP
    >>> set(grown.purkinje.junctions) <= set(range(len(grown.purkinje.points)))  # doctest: +SKIP
    True
    """
    chosen = choose(PurkinjeOptions, options, changes)
    require_growth()
    names = [name for name in ENDOCARDIA if name in mesh.facet_names]
    if not names:
        have = ", ".join(mesh.facet_names) or "none"
        raise InputError(f"Purkinje fibres lie on facets tagged {', '.join(ENDOCARDIA)}; this mesh has {have}")
    there = {ENDOCARDIA[name] for name in names}
    for ventricle in ("lv", "rv"):
        if getattr(chosen, f"root_{ventricle}") is not None and ventricle not in there:
            raise InputError(
                f"root_{ventricle} is given, but the mesh has no endocardium of the {ventricle}; leave it out"
            )
    axes = axes or ventricular_axes(mesh)
    parts, record, moved = [], {}, []
    for name in names:
        ventricle = ENDOCARDIA[name]
        used, corners = np.unique(facet_triangles(mesh, name), return_inverse=True)
        points, triangles = mesh.points[used], corners.reshape(-1, 3)
        given = chosen.root_lv if ventricle == "lv" else chosen.root_rv
        root = find_root(points, triangles, axes, ventricle, given)
        if given is not None and (away := float(np.linalg.norm(root.point - np.asarray(given)))) > _MOVED:
            words = f"the root given for the {ventricle} was brought {{amount}} to the nearest node of its endocardium"
            moved.append(Notice.of("moved", words, amount=away, unit="mm"))
        grown, edges = grow(points, triangles, root.point, root.direction, root.trunk, root.fascicles, chosen)
        grown, edges, at = _attached(grown, edges, points, triangles)
        parts.append((grown, edges, FACET_TAGS[name], np.where(at >= 0, used[at], -1)))
        ends = grown[edges]
        record[name] = {
            "root": np.round(root.point, 3).tolist(),
            "points": len(grown),
            "junctions": int(np.sum(at >= 0)),
            "length_mm": round(float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()), 1),
        }
    first = np.cumsum([0, *(len(part[0]) for part in parts)])
    net = PurkinjeNet.numbered(
        np.concatenate([part[0] for part in parts]),
        np.concatenate([part[1] + start for part, start in zip(parts, first)]),
        np.concatenate([np.full(len(part[1]), part[2], dtype=np.int32) for part in parts]),
        np.concatenate([part[3] for part in parts]),
        speed=chosen.speed,
        info=record,
    )
    info = noted({**mesh.info, "purkinje": {"options": chosen.model_dump(), **record}}, *moved)
    return replace(mesh, purkinje=net, info=info)


def _attached(
    grown: FloatArray, edges: IntArray, points: FloatArray, triangles: IntArray
) -> tuple[FloatArray, IntArray, IntArray]:
    """A tree with its points on the triangles and its ends at vertices; and which vertex each of its points is, or -1.

    Two ends share a vertex only where all three of a triangle are taken.
    """
    foot = ClosestFinder(points, triangles)(grown)
    out = [foot.points]
    at = [np.full(len(grown), -1, dtype=np.int64)]
    ends = np.setdiff1d(edges[:, 1], edges[:, 0])
    number: dict[int, int] = {}
    more = []
    for end in ends.tolist():
        corners = triangles[foot.triangle[end]]
        distance = np.linalg.norm(points[corners] - foot.points[end], axis=1)
        order = corners[np.argsort(distance, kind="stable")]
        free = [int(corner) for corner in order if int(corner) not in number]
        vertex = free[0] if free else int(order[0])
        if vertex not in number and distance.min() < _SAME and vertex == int(order[0]):
            out[0][end], at[0][end], number[vertex] = points[vertex], vertex, end
            continue
        if vertex not in number:
            number[vertex] = len(grown) + len(out) - 1
            out.append(points[vertex][None])
            at.append(np.array([vertex]))
        more.append((end, number[vertex]))
    joined = np.concatenate([edges, np.array(more, dtype=np.int64).reshape(-1, 2)])
    return np.concatenate(out), joined, np.concatenate(at)
