"""Volumes of a mesh, and of the segmentation's voxels or the surfaces given between the same planes."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from femprep.image import LabelObject, Segmentation
from femprep.mesh.topology import enclosed_volume, volume
from femprep.model import BoolArray, Plane, Surface, VolumeMesh
from femprep.model.facets import facet_triangles
from femprep.surface.given.beyond import closed_beyond


def cavity_volume(mesh: VolumeMesh, name: str = "endo") -> float:
    """Volume of a cavity up to the planes that cut it, mm3. Its facets look into the cavity, so they are turned."""
    return enclosed_volume(mesh.points, facet_triangles(mesh, name)[:, ::-1])


def voxel_volume(obj: LabelObject, planes: Iterable[Plane]) -> float:
    """Volume of an object's voxels on the kept side of all planes, mm3.

    A voxel that a plane cuts counts with the part below it: exact where the plane lies along the voxel's faces.
    """
    return _below(obj.mask, obj, planes)


def labelled_volume(seg: Segmentation, structure: str, planes: Iterable[Plane]) -> float:
    """Volume of a structure's voxels as labelled, before any repair, like :func:`voxel_volume`; 0 without a name."""
    return _below(seg.mask(structure), seg, planes) if structure in seg.structures else 0.0


def _below(mask: BoolArray, source: LabelObject | Segmentation, planes: Iterable[Plane]) -> float:
    index = np.argwhere(mask)
    centre = source.grid.to_world(index.astype(float))
    part = np.ones(len(index))
    for plane in planes:
        part *= np.clip(0.5 - plane.signed_distance(centre) / voxel_extent(source, plane), 0.0, 1.0)
    return float(part.sum() * np.prod(source.grid.spacing))


def voxel_extent(source: LabelObject | Segmentation, plane: Plane) -> float:
    """How far a voxel extends along the normal of a plane, mm."""
    return float(np.abs(plane.normal @ np.asarray(source.grid.direction)) @ np.asarray(source.grid.spacing))


def volume_below(surface: Surface, base: Plane | None) -> float:
    """Volume that a surface encloses below a base, mm3: its own triangles, cut at the plane.

    Parameters
    ----------
    surface : Surface
        Closed, or open above the base.
    base : Plane or None
        None for all of it.
    """
    points, cells = closed_beyond(surface.points, surface.triangles)
    if base is None:
        return volume(points, cells)
    away = base.signed_distance(points)[cells]
    # Tetrahedra to a point of the plane, each triangle cut there: the cut itself then adds nothing.
    corner = points[cells] - base.point
    total = np.linalg.det(corner) / 6.0
    order = np.argsort(away, axis=1)
    low, mid, high = np.take_along_axis(away, order, axis=1).T
    with np.errstate(divide="ignore", invalid="ignore"):
        one = np.where(high != low, low / (low - high), 0.0) * np.where(mid != low, low / (low - mid), 0.0)
        two = 1.0 - np.where(high != low, high / (high - low), 0.0) * np.where(high != mid, high / (high - mid), 0.0)
    share = np.where(high <= 0.0, 1.0, np.where(low >= 0.0, 0.0, np.where(mid > 0.0, one, two)))
    return float((share * total).sum())
