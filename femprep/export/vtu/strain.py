"""A mesh and its displacement in, the strain of each element out."""

from __future__ import annotations

import numpy as np

from femprep.export.vtk.xml import add_arrays
from femprep.export.vtu.write import bare_grid
from femprep.model import FloatArray, VolumeMesh


def principal_strains(mesh: VolumeMesh, displacement: FloatArray) -> FloatArray:
    """Largest principal strain, stretch less 1, by its size without the sign, in the middle of every element.

    The stretch is that of the displacement itself, by the Green-Lagrange strain ``E``: ``sqrt(1 + 2 E)``. A solution of
    small-strain elasticity that turns parts of the wall is strained by it, too.

    Parameters
    ----------
    mesh : VolumeMesh
    displacement : (n, 3) array
        mm.

    Returns
    -------
    (n_cells,) array
    """
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersGeneral import vtkCellDerivatives

    derivatives, grid = vtkCellDerivatives(), bare_grid(mesh)
    add_arrays(grid.GetPointData(), {"displacement": displacement}, "point data")
    grid.GetPointData().SetActiveVectors("displacement")
    derivatives.SetInputData(grid)
    derivatives.SetTensorModeToComputeGreenLagrangeStrain()
    derivatives.Update()
    strain = vtk_to_numpy(derivatives.GetOutput().GetCellData().GetTensors()).reshape(-1, 3, 3)
    return np.asarray(np.abs(np.sqrt(np.maximum(1.0 + 2.0 * np.linalg.eigvalsh(strain), 0.0)) - 1.0).max(axis=1))
