"""A label object to its marching cubes surface: what the paper is compared with."""

from __future__ import annotations

import numpy as np

from femprep.image import LabelObject
from femprep.model import Surface
from femprep.surface.reference._vtk import image_of, surface_of

METHOD = "marching cubes"


def marching_cubes(obj: LabelObject) -> Surface:
    """Marching cubes at one half of the mask, in world coordinates [1]_ (VTK's flying edges).

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
    image = image_of(obj.mask.astype(np.float32), obj.grid.spacing)
    return surface_of(image.contour([0.5], method="flying_edges"), obj.grid, obj.name, METHOD)
