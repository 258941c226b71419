"""A VTK image on a label object's grid, and VTK polygons back to a Surface; pyvista is imported here alone, late."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from femprep.image import Grid
from femprep.mesh.topology import volume
from femprep.model import Surface


def image_of(values: npt.NDArray[Any], spacing: npt.ArrayLike) -> Any:
    """A pyvista image of values ``[i, j, k]`` with its first voxel centre at the origin and its axes along x, y, z."""
    import pyvista

    image = pyvista.ImageData(dimensions=values.shape, spacing=tuple(float(s) for s in np.asarray(spacing)))
    image.point_data["values"] = values.ravel(order="F")
    return image


def surface_of(polygons: Any, grid: Grid, name: str, method: str, **info: Any) -> Surface:
    """A Surface from polygons of such an image: in world coordinates, triangles wound outward."""
    polygons = polygons.triangulate()
    local = np.asarray(polygons.points, dtype=np.float64)
    cells = np.asarray(polygons.regular_faces, dtype=np.int64)
    points = grid.to_world(local / grid.spacing)
    if volume(points, cells) < 0.0:
        cells = cells[:, ::-1]
    return Surface(points, cells, name=name, info={"method": method, **info})
