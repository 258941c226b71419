"""A tagged volume mesh in, the closed surface of one of its cavities out: endocardium and flat caps."""

from __future__ import annotations

import numpy as np

from femprep.errors import InputError
from femprep.mesh.topology import border_edges, border_loops, closed_by_fans
from femprep.model import FACET_TAGS, FloatArray, IntArray, Plane, Surface, VolumeMesh
from femprep.model.facets import facet_triangles
from femprep.model.products import product
from femprep.wall.joining.solid import plane_frame, triangulate_rings


def open_cavities(mesh: VolumeMesh) -> list[str]:
    """Names of the cavities of a mesh whose endocardium has rims, and no caps of blood over them."""
    named = [name.removeprefix("endo_") for name in mesh.facet_names if name.startswith("endo_")]
    found = []
    for name in [*(["lv"] if "endo" in mesh.facet_names else []), *named]:
        wall = facet_triangles(mesh, _endocardium(mesh, name))
        if len(border_edges(wall)) and _in_rings(wall) and f"cap_{name}" not in mesh.facet_names:
            found.append(name)
    return found


def _in_rings(wall: IntArray) -> bool:
    """Whether the rims are rings. Where they touch at a node, as in meshes of others, what is inside stays open."""
    rim = border_edges(wall)
    return len(np.unique(rim[:, 0])) == len(rim)


def cavity_surface(mesh: VolumeMesh, name: str = "lv", *, centre: bool = False) -> Surface:
    """The closed surface of a cavity, made of nodes of the mesh alone: endocardial facets, then caps over its openings.

    The caps are those of the mesh where it has blood pools, else flat ones over the rims, without further nodes.

    A solver that moves its points with the mesh has the cavity's volume at any time, by the divergence theorem over the
    surface: what a pressure-volume relation or a windkessel needs.

    Parameters
    ----------
    mesh : VolumeMesh
        With facets ``endo_<name>``, or ``endo`` where it is a left ventricle, or another chamber alone.
    name : str
        Which cavity: ``"lv"``, ``"rv"``, ``"la"``, ``"ra"``.
    centre : bool
        Close each rim by a fan about a further point in its middle, for solvers that want caps of even triangles.

    Returns
    -------
    Surface
        Wound out of the cavity, so that ``surface.volume`` is the cavity's volume, mm3, positive. ``point_data`` holds
        ``GlobalNodeID``, the number of each point in the mesh from 1, 0 of those in the middle of fans;
        ``info["cap_triangles"]`` of the last triangles are caps. Mid-side nodes are left out.

    Raises
    ------
    InputError
        The mesh has no such facets, or their rim touches itself at a node.

    Examples
    --------
    >>> fp.cavity_surface(mesh, "lv").volume > 0
    True
    """
    tag = _endocardium(mesh, name)
    wall = facet_triangles(mesh, tag) if tag in mesh.facet_names else np.empty((0, 3), dtype=np.int64)
    if not len(wall):
        have = ", ".join(mesh.facet_names) or "none"
        wanted = f"'endo_{name}' or 'endo'" if tag == "endo" else repr(tag)
        raise InputError(f"the mesh has no facets tagged {wanted}, so no cavity {name!r}; its facets: {have}")
    if f"cap_{name}" not in mesh.facet_names and not _in_rings(wall):
        raise InputError(f"the rim of the cavity {name!r} touches itself at a node, so that no cap closes it")
    points, wall = mesh.points, wall[:, ::-1]  # they look into the cavity
    if f"cap_{name}" in mesh.facet_names:  # meshed together with the blood
        triangles = np.concatenate([wall, facet_triangles(mesh, f"cap_{name}")])
    elif centre:
        points, triangles = closed_by_fans(points, wall)
    else:
        triangles = np.concatenate([wall, *(_cap(points, loop) for loop in border_loops(wall))])
    used, number = np.unique(triangles, return_inverse=True)
    return Surface(
        points[used],
        number.reshape(-1, 3),
        name=f"{name} cavity",
        point_data={"GlobalNodeID": np.where(used < len(mesh.points), used + 1, 0)},
        info={"cap_triangles": len(triangles) - len(wall)},
    )


def _endocardium(mesh: VolumeMesh, name: str) -> str:
    """Facets of a cavity. Those plainly called ``endo`` are the LV's, or where there is no LV the one chamber's."""
    own = f"endo_{name}"
    chambers = {f"endo_{region}" for region in mesh.region_names} & FACET_TAGS.keys()
    alone = own == "endo_lv" or (own in FACET_TAGS and chambers <= {own})
    return "endo" if alone and own not in mesh.facet_names else own


def _cap(points: FloatArray, loop: IntArray) -> IntArray:
    """Triangles that close a rim, wound to match."""
    ring = points[loop[::-1]]
    middle = ring.mean(axis=0)
    normal = np.cross(ring - middle, np.roll(ring, -1, axis=0) - middle).sum(axis=0)
    flat = product(ring - middle, plane_frame(Plane(middle, normal))[:2].T)
    return loop[::-1][triangulate_rings(flat, [np.arange(len(loop))])]
