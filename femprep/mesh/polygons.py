"""Arrays in, arrays out: VTK's filters that make, smooth and thin triangle meshes."""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.mesh.measures.triangles import areas
from femprep.mesh.topology import euler_characteristic, is_closed
from femprep.model import FloatArray, IntArray

# VTK is imported late and in part: all of it takes half a second to load.


def isosurface(values: FloatArray, level: float) -> tuple[FloatArray, IntArray]:
    """Triangles where values ``[i, j, k]`` on a grid pass a level: vertices ``(n, 3)`` as indices, cells ``(m, 3)``."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

    image = vtkImageData()
    image.SetDimensions(*values.shape)
    image.GetPointData().SetScalars(numpy_to_vtk(values.ravel(order="F"), deep=True))
    edges = vtkFlyingEdges3D()
    edges.SetInputData(image)
    edges.ComputeNormalsOff()
    edges.ComputeScalarsOff()
    edges.SetValue(0, level)
    return _arrays(edges)


def taubin(points: FloatArray, triangles: IntArray, passes: int, pass_band: float) -> FloatArray:
    """Vertices ``(n, 3)`` of a closed mesh after so many passes of VTK's low-pass filter [1]_.

    References
    ----------
    .. [1] G. Taubin, T. Zhang, G. Golub, "Optimal surface smoothing as filter design", ECCV 1996,
       doi 10.1007/BFb0015544.
    """
    from vtkmodules.vtkFiltersCore import vtkWindowedSincPolyDataFilter

    smoother = vtkWindowedSincPolyDataFilter()
    # In single precision, as VTK makes isosurfaces.
    smoother.SetInputData(_polydata(points.astype(np.float32), triangles))
    smoother.SetNumberOfIterations(passes)
    smoother.SetPassBand(pass_band)
    smoother.BoundarySmoothingOff()
    smoother.FeatureEdgeSmoothingOff()
    return _arrays(smoother)[0]


def decimated(points: FloatArray, triangles: IntArray, share: float) -> tuple[FloatArray, IntArray]:
    """A mesh with this share of its triangles collapsed where that moves it least (quadric errors), its volume kept."""
    from vtkmodules.vtkFiltersCore import vtkQuadricDecimation

    thinner = vtkQuadricDecimation()
    thinner.SetInputData(_polydata(points, triangles))
    thinner.SetTargetReduction(share)
    thinner.VolumePreservationOn()
    return _arrays(thinner)


def decimated_to(points: FloatArray, cells: IntArray, count: int) -> tuple[FloatArray, IntArray]:
    """A closed mesh of about ``count`` vertices for the same surface; the mesh itself where it is small, or stays so.

    Parameters
    ----------
    points, cells
        A closed mesh of a ball's surface.
    count : int
    """
    if len(points) <= 1.5 * count:
        return points, cells
    shape = decimated(points, cells, 1.0 - count / len(points))
    if not is_closed(shape[1]) or euler_characteristic(shape[1]) != 2 or areas(*shape).min() <= 0.0:
        return points, cells
    return shape


def _polydata(points: FloatArray, triangles: IntArray) -> Any:
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    places, cells, mesh = vtkPoints(), vtkCellArray(), vtkPolyData()
    places.SetData(numpy_to_vtk(np.ascontiguousarray(points), deep=True))
    starts = np.arange(0, triangles.size + 1, 3, dtype=np.int64)
    cells.SetData(*(numpy_to_vtk(array, deep=True) for array in (starts, triangles.ravel().astype(np.int64))))
    mesh.SetPoints(places)
    mesh.SetPolys(cells)
    return mesh


def _arrays(filter_: Any) -> tuple[FloatArray, IntArray]:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    filter_.Update()
    mesh = filter_.GetOutput()
    if not mesh.GetNumberOfPoints():
        return np.empty((0, 3)), np.empty((0, 3), dtype=np.int64)
    points = np.array(vtk_to_numpy(mesh.GetPoints().GetData()), dtype=np.float64)
    nodes = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray())
    return points, np.array(nodes, dtype=np.int64).reshape(-1, 3)
