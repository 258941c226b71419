"""A label object to its marching cubes surface smoothed as Taubin does: the usual remedy for terraces."""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.image import LabelObject
from femprep.model import Surface
from femprep.surface.reference._vtk import image_of, surface_of

METHOD = "marching cubes, Taubin"

#: What 3D Slicer smooths segments with unless told otherwise: smoothing factor 0.5 is a pass band of 10^(-4 * 0.5).
ITERATIONS = 20
PASS_BAND = 0.01


def smooth(polygons: Any, iterations: int = ITERATIONS, pass_band: float = PASS_BAND) -> Any:
    """Smooth pyvista polygons with the windowed sinc filter, VTK's form of Taubin's low-pass filter [1]_.

    References
    ----------
    .. [1] Taubin, Zhang & Golub, Optimal surface smoothing as filter design, ECCV 1996. doi:10.1007/BFb0015544
    """
    return polygons.smooth_taubin(n_iter=iterations, pass_band=pass_band, normalize_coordinates=True)


def marching_cubes_taubin(obj: LabelObject, iterations: int = ITERATIONS, pass_band: float = PASS_BAND) -> Surface:
    """Marching cubes, then Taubin smoothing.

    Parameters
    ----------
    obj : LabelObject
    iterations : int
        Passes of the filter.
    pass_band : float
        Smaller values smooth more.

    Returns
    -------
    Surface
    """
    image = image_of(obj.mask.astype(np.float32), obj.grid.spacing)
    polygons = smooth(image.contour([0.5], method="flying_edges"), iterations, pass_band)
    return surface_of(polygons, obj.grid, obj.name, METHOD, iterations=iterations, pass_band=pass_band)
