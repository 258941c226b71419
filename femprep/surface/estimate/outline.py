"""A LabelObject in, a rough closed mesh around its voxels out: a ball's surface even where the voxels have tunnels."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.errors import StageError
from femprep.image.object import LabelObject
from femprep.image.resample import isotropic, slice_distance
from femprep.mesh.measures.triangles import areas
from femprep.mesh.polygons import decimated_to, isosurface, taubin
from femprep.mesh.topology import euler_characteristic, is_closed, pieces, volume
from femprep.model import FloatArray, IntArray
from femprep.model.functions import exponential, logarithm

#: Voxels of the grid the mesh is made on: the object's volume over this many, between these sizes, mm.
_VOXELS: Final = 15000
_FINEST, _COARSEST = 1.0, 3.0
#: Voxels that an object has at least, however small: a mouse's ventricle has some microlitres.
_LEAST_VOXELS: Final = 1000
#: How far outside of the voxels the mesh may run, in those voxels, step by step, until it is a ball's.
_OFFSETS: Final = (0.0, 0.7, 1.4, 2.1, 2.8, 3.5)
#: Voxels around the object that leave room for that.
_ROOM: Final = int(np.ceil(_OFFSETS[-1])) + 2
#: Smoothing of the mesh: passes and pass band of Taubin's filter.
_PASSES: Final = 20
_PASS_BAND: Final = 0.05
#: Share of the mesh' area that crumbs beside the largest piece may have.
_CRUMBS: Final = 0.05


def outlines(obj: LabelObject, count: int) -> tuple[tuple[FloatArray, IntArray], tuple[FloatArray, IntArray]]:
    """A smooth closed mesh near an object's surface, as fine as the grid it is made on, and a coarser one of it.

    Parameters
    ----------
    obj : LabelObject
    count : int
        Number of vertices of the coarser one, about.

    Returns
    -------
    fine, coarse : tuple of (n, 3) and (m, 3) array
        Vertices from the object's barycentre, mm, and triangles, wound outward.

    Raises
    ------
    StageError
        The mesh is not a ball's at any distance from the voxels that was tried.
    """
    finest = min(_FINEST, _edge(obj.volume / _LEAST_VOXELS))
    voxel = float(np.clip(_edge(obj.volume / _VOXELS), finest, _COARSEST))
    even = isotropic(obj, voxel)
    index, cells = _ball(even)
    if not _reaches(obj, even.grid.to_world(index - _ROOM)):
        even = isotropic(obj, voxel, along=True)
        index, cells = _ball(even)
    fine = taubin(index, cells, _PASSES, _PASS_BAND), cells

    def along(index: FloatArray, cells: IntArray) -> tuple[FloatArray, IntArray]:
        points = even.grid.to_world(index - _ROOM) - obj.barycentre
        return points, cells if volume(points, cells) > 0.0 else np.ascontiguousarray(cells[:, ::-1])

    return along(*fine), along(*decimated_to(*fine, count))


def _ball(even: LabelObject) -> tuple[FloatArray, IntArray]:
    """A closed mesh of a ball's kind around even voxels: vertices in their indices, padded, and triangles."""
    from scipy.ndimage import gaussian_filter

    mask = np.pad(even.mask, _ROOM)
    # In voxels, positive inside.
    depth = gaussian_filter(slice_distance(mask, (1.0, 1.0, 1.0)), 1.0)
    for offset in _OFFSETS:
        index, cells = isosurface(depth, -offset)
        if len(cells) == 0:  # thinner than the smoothing is wide
            continue
        piece = pieces(cells)
        area = np.bincount(piece, areas(index, cells))
        if area.max() < (1.0 - _CRUMBS) * area.sum():
            continue
        cells = cells[piece == np.argmax(area)]
        if is_closed(cells) and euler_characteristic(cells) == 2:
            break
    else:
        widest = _OFFSETS[-1] * float(even.grid.spacing[0])
        raise StageError(
            f"object {even.name!r} has tunnels too wide to be closed by {widest:.1f} mm around its voxels; fill them "
            "in the labels"
        )
    used, cells = np.unique(cells, return_inverse=True)
    return index[used], cells.reshape(-1, 3)


def _reaches(obj: LabelObject, points: FloatArray) -> bool:
    """Whether points lie on both sides of the middles of an object's first and last slice."""
    slices = np.flatnonzero(obj.mask.any(axis=obj.grid.flat_axes))
    height = obj.grid.to_index(points)[:, obj.stack_axis]
    return bool(height.min() < slices[0] and height.max() > slices[-1])


def _edge(volume: float) -> float:
    """Edge of a cube of a volume, the same on every machine."""
    return float(exponential(logarithm(volume) / 3.0))
