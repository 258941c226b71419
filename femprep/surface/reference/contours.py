"""A label object to the surfaces VTK draws around its voxels: marching cubes, smoothed or not, and surface nets."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.image import Grid, LabelObject
from femprep.mesh.topology import volume
from femprep.model import Surface

#: What 3D Slicer smooths segments with unless told otherwise: smoothing factor 0.5 is a pass band of 10^(-4 * 0.5).
_SMOOTHING: Final = {"iterations": 20, "pass_band": 0.01}


def marching_cubes(obj: LabelObject) -> Surface:
    """Marching cubes at one half of the mask, in world coordinates [1]_ (VTK's flying edges): what the paper is
    compared with.

    Parameters
    ----------
    obj : LabelObject

    Returns
    -------
    Surface
        Closed; its vertices are the midpoints between neighbouring voxels across the boundary.

    References
    ----------
    .. [1] Lorensen & Cline, Marching cubes: a high resolution 3D surface construction algorithm, Computer Graphics
       21(4), 1987. doi:10.1145/37402.37422
    """
    return surface_of(isosurface(obj.mask, obj.grid, 0.5), obj.grid, obj.name, "marching cubes")


def marching_cubes_taubin(obj: LabelObject) -> Surface:
    """Marching cubes smoothed by the windowed sinc filter, VTK's form of Taubin's low-pass filter [1]_: the usual
    remedy for terraces.

    Parameters
    ----------
    obj : LabelObject

    Returns
    -------
    Surface

    References
    ----------
    .. [1] Taubin, Zhang & Golub, Optimal surface smoothing as filter design, ECCV 1996. doi:10.1007/BFb0015544
    """
    polygons = smooth(isosurface(obj.mask, obj.grid, 0.5))
    return surface_of(polygons, obj.grid, obj.name, "marching cubes, Taubin", **_SMOOTHING)


def surface_nets(obj: LabelObject) -> Surface:
    """Surface nets with VTK's default smoothing [1]_: one vertex in each voxel quadruple at the boundary, relaxed.

    Parameters
    ----------
    obj : LabelObject

    Returns
    -------
    Surface

    References
    ----------
    .. [1] Frisken, SurfaceNets for multi-label segmentations with preservation of sharp boundaries, J. Computer
       Graphics Techniques 11(1), 2022. http://jcgt.org/published/0011/01/03/
    """
    image = _image(obj.mask.astype(np.uint8), obj.grid)
    polygons = image.contour_labels(scalars="values", output_mesh_type="triangles", pad_background=False)
    return surface_of(polygons, obj.grid, obj.name, "surface nets")


def smoothed_surface(values: npt.NDArray[Any], grid: Grid, name: str, method: str) -> Surface:
    """Where values ``[i, j, k]`` pass zero, smoothed as Taubin does."""
    return surface_of(smooth(isosurface(values, grid, 0.0)), grid, name, method, **_SMOOTHING)


def isosurface(values: npt.NDArray[Any], grid: Grid, level: float) -> Any:
    """Pyvista's polygons where values ``[i, j, k]`` pass a level; axes as of :func:`surface_of`."""
    return _image(values.astype(np.float32), grid).contour([level], method="flying_edges")


def smooth(polygons: Any) -> Any:
    """Pyvista's polygons, smoothed as Taubin does."""
    n_iter, pass_band = _SMOOTHING["iterations"], _SMOOTHING["pass_band"]
    return polygons.smooth_taubin(n_iter=n_iter, pass_band=pass_band, normalize_coordinates=True)


def surface_of(polygons: Any, grid: Grid, name: str, method: str, **info: Any) -> Surface:
    """A Surface from polygons whose axes are those of a grid, its first voxel's centre the origin: wound outward."""
    polygons = polygons.triangulate()
    local = np.asarray(polygons.points, dtype=np.float64)
    cells = np.asarray(polygons.regular_faces, dtype=np.int64)
    points = grid.to_world(local / grid.spacing)
    if volume(points, cells) < 0.0:
        cells = cells[:, ::-1]
    return Surface(points, cells, name=name, info={"method": method, **info})


def _image(values: npt.NDArray[Any], grid: Grid) -> Any:
    """A pyvista image, its first voxel centre at the origin and its axes along x, y, z; pyvista is imported late."""
    import pyvista

    image = pyvista.ImageData(dimensions=values.shape, spacing=tuple(float(s) for s in grid.spacing))
    image.point_data["values"] = values.ravel(order="F")
    return image
