"""Volumes of a mesh, and of the segmentation's voxels between the same planes."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from femprep.image import LabelObject
from femprep.mesh.topology import enclosed_volume
from femprep.model import Plane, VolumeMesh
from femprep.model.facets import facet_triangles


def cavity_volume(mesh: VolumeMesh, name: str = "endo") -> float:
    """Volume of a cavity up to the planes that cut it, mm3. Its facets look into the cavity, so they are turned."""
    return enclosed_volume(mesh.points, facet_triangles(mesh, name)[:, ::-1])


def voxel_volume(obj: LabelObject, planes: Iterable[Plane]) -> float:
    """Volume of an object's voxels on the kept side of all planes, mm3.

    A voxel that a plane cuts counts with the part below it: exact where the plane lies along the voxel's faces.
    """
    index = np.argwhere(obj.mask)
    centre = obj.grid.to_world(index.astype(float))
    part = np.ones(len(index))
    for plane in planes:
        extent = float(np.abs(plane.normal @ np.asarray(obj.grid.direction)) @ np.asarray(obj.grid.spacing))
        part *= np.clip(0.5 - plane.signed_distance(centre) / extent, 0.0, 1.0)
    return float(part.sum() * np.prod(obj.grid.spacing))
