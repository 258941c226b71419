"""Clipped surfaces in, the joined wall out: the only file that knows manifold3d.

The clipped epicardium is closed by a plug that stands out of its planes, each endocardium by one that reaches out
through it, and the wall is the difference of the solids. In the planes themselves nothing is cut: edges of a cap there
would cross those of rims and put vertices on them. manifold3d keeps the origin of every triangle, so tags are exact.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from femprep.errors import InputError, StageError
from femprep.mesh.numbering import none_of
from femprep.mesh.tangents import tangents
from femprep.model import FACET_TAGS, FloatArray, IntArray, Plane, Wall
from femprep.model.notice import spot
from femprep.model.products import product
from femprep.wall.clipping.clip import rim_loops
from femprep.wall.clipping.clipped_surface import ClippedSurface

#: A vertex of the result is one of the clipped surfaces' where it lies this near to it, mm.
_SAME = 1e-6


def triangulate_rings(points: FloatArray, loops: Sequence[IntArray]) -> IntArray:
    """Triangles ``(m, 3)`` that fill polygons in the plane, without further points; holes run clockwise."""
    import manifold3d

    order = np.concatenate(loops)
    found = manifold3d.triangulate([np.ascontiguousarray(points[loop]) for loop in loops], allow_convex=False)
    return np.asarray(order[np.asarray(found, dtype=np.int64)])


def plane_frame(plane: Plane) -> FloatArray:
    """Rotation ``(3, 3)`` whose rows are two directions of a plane and its normal, right-handed."""
    return np.concatenate([-tangents(plane.normal[None])[0], plane.normal[None]])


def join(epi: ClippedSurface, endo: Mapping[str, ClippedSurface]) -> tuple[IntArray, IntArray]:
    """Subtract the endocardial solids from the epicardial one.

    Parameters
    ----------
    epi : ClippedSurface
    endo : mapping of str to ClippedSurface
        By facet name.

    Returns
    -------
    triangles : (m, 3) array
        The facets of the surfaces that bound the wall, wound out of it; vertices are numbered over all of them, ``epi``
        first, then ``endo`` in its order. The caps are left out.
    source : (m,) array
        Number of the clipped surface each comes from, in the same order.

    Raises
    ------
    InputError
        An endocardium reaches the epicardium or another endocardium: the message says where.
    StageError
        A solid is not accepted, or the volumes do not add up.
    """
    import manifold3d

    clipped_surfaces = [epi, *endo.values()]
    frame_plane = next(iter(epi.planes.values()), None)
    rotation, origin = np.eye(3), epi.points.mean(axis=0)
    if frame_plane is not None:
        rotation, origin = plane_frame(frame_plane), frame_plane.point
    size = float(np.ptp(epi.points, axis=0).max())
    first_id = manifold3d.Manifold.reserve_ids(len(clipped_surfaces))
    solids = []
    for number, clipped in enumerate(clipped_surfaces):
        points, triangles = _close(clipped, plug=(0.1 if number else 0.05) * size)
        turned = product(points - origin, rotation.T)
        # In this frame the base is exactly z = 0: what the vertices on it were projected to.
        turned[: len(clipped.points)][clipped.on_plane == 0, 2] = 0.0
        # Triangles that close a clipped surface get an identity of their own, so that they can be told apart.
        closing = manifold3d.Manifold.reserve_ids(1)
        solid = _solid(turned, triangles, [0, len(clipped.triangles)], [first_id + number, closing])
        if solid.status() != manifold3d.Error.NoError:
            raise StageError(f"surface {clipped.name!r}, clipped and closed, is no solid: {solid.status().name}")
        if solid.volume() <= 0:
            raise InputError(
                f"surface {clipped.name!r} is wound inward (volume {solid.volume():.1f} mm3); reverse its triangles"
            )
        solids.append(solid)
    wall = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Subtract)
    if wall.status() != manifold3d.Error.NoError:
        raise StageError(f"the boolean difference of the surfaces failed: {wall.status().name}")
    return _clipped_facets(wall.to_mesh64(), clipped_surfaces, first_id, rotation, origin)


def _solid(points: FloatArray, triangles: IntArray, starts: Sequence[int], ids: Sequence[int]) -> Any:
    """A solid of triangles, those from each of ``starts`` on with a number that what is cut from it keeps."""
    import manifold3d

    mesh = manifold3d.Mesh64(
        np.ascontiguousarray(points),
        np.ascontiguousarray(triangles, dtype=np.uint64),
        run_index=np.array([*(3 * s for s in starts), 3 * len(triangles)], dtype=np.uint64),
        run_original_id=np.array(ids, dtype=np.uint32),
    )
    return manifold3d.Manifold(mesh)


def _close(clipped: ClippedSurface, plug: float) -> tuple[FloatArray, IntArray]:
    """Close a clipped surface by prisms of a length, mm, that stand out of its planes."""
    points, triangles = [clipped.points], [clipped.triangles]
    count = len(clipped.points)
    for number in range(len(clipped.planes)):
        plane = clipped.plane_of(number)
        rotation = plane_frame(plane)
        for loop in rim_loops(clipped, number):
            back = loop[::-1]
            top = count + np.arange(len(back))
            points.append(clipped.points[back] + plug * plane.normal)
            count += len(back)
            u, v = back, np.roll(back, -1)
            tu, tv = top, np.roll(top, -1)
            triangles += [np.stack([u, v, tv], axis=1), np.stack([u, tv, tu], axis=1)]
            flat = product(clipped.points[back] - plane.point, rotation[:2].T)
            triangles.append(top[triangulate_rings(flat, [np.arange(len(back))])])
    return np.concatenate(points), np.concatenate(triangles)


def _clipped_facets(
    mesh: Any, clipped_surfaces: Sequence[ClippedSurface], first_id: int, rotation: FloatArray, origin: FloatArray
) -> tuple[IntArray, IntArray]:
    """The facets that come from clipped surfaces, in their numbering."""
    points = product(np.asarray(mesh.vert_properties)[:, :3], rotation) + origin
    triangles = np.asarray(mesh.tri_verts, dtype=np.int64)
    runs = np.asarray(mesh.run_index, dtype=np.int64) // 3
    origin_id = np.repeat(np.asarray(mesh.run_original_id, dtype=np.int64), np.diff(runs))
    all_points = np.concatenate([clipped.points for clipped in clipped_surfaces])
    away, number = (np.asarray(found) for found in cKDTree(all_points).query(points))
    starts = np.cumsum([0, *(len(clipped.points) for clipped in clipped_surfaces)])
    found, source = [], []
    for k, clipped in enumerate(clipped_surfaces):
        own = triangles[origin_id == first_id + k]
        strange = np.unique(own[away[own] > _SAME])
        if len(strange):
            others = ", ".join(repr(other.name) for other in clipped_surfaces if other is not clipped)
            raise InputError(
                f"surface {clipped.name!r} meets {others}: {len(strange)} crossings, the first near "
                f"{spot(points[strange[0]])}; the endocardium must lie inside the epicardium"
            )
        mapped = number[own]
        sides = mapped != np.roll(mapped, 1, axis=1)
        mapped = mapped[sides.all(axis=1)]
        if len(mapped) != len(clipped.triangles):
            own = clipped.triangles + int(starts[k])
            lost = own[none_of(own, mapped)]
            raise InputError(
                f"{len(lost)} of {len(clipped.triangles)} facets of surface {clipped.name!r} do not bound the wall, "
                f"one near {spot(all_points[lost].mean(axis=(0, 1)))}; the endocardium must lie inside the epicardium"
            )
        found.append(mapped)
        source.append(np.full(len(mapped), k))
    return np.concatenate(found), np.concatenate(source)


def drill(wall: Wall, holes: Sequence[tuple[str, FloatArray]]) -> Wall:
    """Take prisms out of a closed wall.

    Parameters
    ----------
    wall : Wall
    holes : sequence of (str, (2, n, 3) array)
        Name of the facets of each hole, and the corners of its prism: those of one end, counter-clockwise seen from the
        other end, and those of the other.

    Returns
    -------
    Wall
        Vertices that stay keep their ``template``.

    Raises
    ------
    StageError
        The boolean operation failed.
    """
    cutters = []
    for name, corners in holes:
        count = corners.shape[1]
        fan = np.stack([np.zeros(count - 2, np.int64), np.arange(2, count), np.arange(1, count - 1)], axis=1)
        triangles = np.concatenate([_sides(count), fan, fan[:, ::-1] + count])
        cutters.append((corners.reshape(-1, 3), triangles, {name: 0}))
    return _subtract(wall, cutters, np.eye(3), wall.points.mean(axis=0))


def _sides(count: int) -> IntArray:
    """Triangles of the sides of a prism whose ends have so many corners each."""
    low, high = np.arange(count), count + np.arange(count)
    one, two = np.roll(low, -1), np.roll(high, -1)
    return np.concatenate([np.stack([low, one, two], axis=1), np.stack([low, two, high], axis=1)])


def _subtract(
    wall: Wall,
    cutters: Sequence[tuple[FloatArray, IntArray, Mapping[str, int]]],
    rotation: FloatArray,
    origin: FloatArray,
    largest: bool = False,
) -> Wall:
    """Subtract closed solids from a wall; of what this separates keep all, or the largest piece.

    Each has points ``(n, 3)`` in world coordinates, triangles, and by the name of their facets the row at which its
    triangles begin. The boolean operation runs in a frame with these rows as axes about an origin.
    """
    import manifold3d

    order = np.argsort(wall.facet_tag, kind="stable")
    tags, start = np.unique(wall.facet_tag[order], return_index=True)
    names = [name for _, _, starts in cutters for name in starts]
    first = manifold3d.Manifold.reserve_ids(len(tags) + len(names))

    def solid(points: FloatArray, triangles: IntArray, starts: list[int], ids: list[int]) -> Any:
        made = _solid(product(points - origin, rotation.T), triangles, starts, ids)
        if made.status() != manifold3d.Error.NoError or made.volume() <= 0:
            raise StageError(f"the wall or a cut into it is no solid: {made.status().name}, {made.volume():.4g} mm3")
        return made

    solids = [solid(wall.points, wall.triangles[order], start.tolist(), [first + k for k in range(len(tags))])]
    number = len(tags)
    for points, triangles, starts in cutters:
        solids.append(solid(points, triangles, list(starts.values()), [first + number + k for k in range(len(starts))]))
        number += len(starts)
    opened = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Subtract)
    if opened.status() != manifold3d.Error.NoError:
        raise StageError(f"cutting the wall open failed: {opened.status().name}")
    if largest:
        opened = max(opened.decompose(), key=lambda piece: piece.volume())
    mesh = opened.to_mesh64()
    points = product(np.asarray(mesh.vert_properties)[:, :3], rotation) + origin
    runs = np.diff(np.asarray(mesh.run_index, dtype=np.int64) // 3)
    source = np.repeat(np.asarray(mesh.run_original_id, dtype=np.int64), runs) - first
    away, nearest = (np.asarray(found) for found in cKDTree(wall.points).query(points))
    template = np.where(away < _SAME, wall.template[nearest], -1)
    triangles = np.asarray(mesh.tri_verts, dtype=np.int64)
    numbers = np.array([*tags.tolist(), *(FACET_TAGS[name] for name in names)], dtype=np.int32)
    return Wall(points, triangles, numbers[source], template, wall.planes, wall.info)


def cut_down(wall: Wall, plane: Plane, points: FloatArray, triangles: IntArray, floor: int) -> Wall:
    """Subtract a closed solid that stands on a plane.

    Parameters
    ----------
    wall : Wall
    plane : Plane
    points, triangles : (n, 3) arrays
        The solid, wound outward.
    floor : int
        Row at which its triangles in the plane begin, which are the last ones.

    Returns
    -------
    Wall
        Facets that the cut makes in the plane are tagged ``base_rv``, the others ``epi``.

    Raises
    ------
    StageError
        The boolean operation failed.
    """
    made = _subtract(wall, [(points, triangles, {"epi": 0, "base_rv": floor})], plane_frame(plane), plane.point, True)
    at = np.unique(made.triangles[made.facet_tag == FACET_TAGS["base_rv"]])
    exact = made.points.copy()
    exact[at] = plane.feet(exact[at])
    return replace(made, points=exact)
