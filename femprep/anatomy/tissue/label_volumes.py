"""Labels of an image and a mesh's wall in; the volume of each label by its own voxels, up to the wall's ends, out.

A voxel is a box as thick as the slices are apart. What of it lies beyond the base, where the mesh ends and the heart
does not, is no tissue of the mesh. What lies beside the wall, in the blood or outside, is: there the surface of the
mesh is a little off, or the slice is a stair of a wall that slants, and what one box has too much the next lacks.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.image.grid import Grid
from femprep.mesh.search.locate import Locator
from femprep.model import BoolArray, FloatArray, VolumeMesh
from femprep.model.facets import facet_triangles

#: Boxes are cut at the base to a part of a pixel.
_PARTS: Final = 4
#: Voxels located at once.
_CHUNK: Final = 20_000


def label_volumes(
    mesh: VolumeMesh, locator: Locator, labels: npt.NDArray[np.integer], grid: Grid, count: int
) -> FloatArray:
    """Volume of the labels 1 to ``count`` by their voxels, mm3.

    Parameters
    ----------
    mesh : VolumeMesh
        Facets that are neither endocardium nor epicardium are its ends.
    locator : Locator
        Of the wall of the mesh, by places.
    labels : (ni, nj, nk) array
        0 for none.
    grid : Grid
    count : int
        Number of labels.

    Returns
    -------
    (count,) array
        Of the voxels some of which is within a pixel of the wall; others belong to something else.
    """
    axis = grid.stack_axis
    pixel = float(max(np.delete(grid.spacing, axis)))
    parts = max(1, int(np.ceil(_PARTS * grid.spacing[axis] / pixel)) - _PARTS + 1)
    through = np.zeros((parts, 3))
    through[:, axis] = (np.arange(parts) + 0.5) / parts - 0.5
    ends = _ends(mesh)
    index = np.argwhere((labels > 0) & (labels <= count))
    out = np.zeros(count)
    for first in range(0, len(index), _CHUNK):
        own = index[first : first + _CHUNK]
        at = locator(grid.to_world((own[:, None] + through).reshape(-1, 3).astype(float)))
        beyond = (at.distance > 0.0) & (ends[at.nodes] | (at.weights <= 0.0)).all(axis=1)
        near = at.distance.reshape(-1, parts).min(axis=1) < pixel
        kept = near * np.count_nonzero(~beyond.reshape(-1, parts), axis=1) / parts
        out += np.bincount(labels[tuple(own.T)].astype(np.int64) - 1, weights=kept, minlength=count)
    return np.asarray(out * grid.voxel_volume)


def _ends(mesh: VolumeMesh) -> BoolArray:
    """Points on facets at which the mesh ends and the heart does not: base and valves."""
    found = np.zeros(len(mesh.points), dtype=np.bool_)
    for name in mesh.facet_names:
        if name != "epi" and not name.startswith("endo"):
            found[facet_triangles(mesh, name)] = True
    return found
