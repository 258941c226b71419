"""Grey images to lie under label maps: values known in each structure, and a field that is linear in the world."""

from __future__ import annotations

from typing import Any

import numpy as np

import femprep as fp
from femprep.image import Grid

#: Mean of a structure, as in a cine image of steady-state free precession; deviation of the noise.
MEANS = {"lv": 220.0, "rv": 205.0, "myo": 90.0}
REST, NOISE = 55.0, 12.0


def cine(seg: fp.Segmentation, seed: int = 0, noise: float = NOISE, blur: float = 0.0) -> fp.IntensityImage:
    """An image of the label map's own voxels, noise on it, its edges as soft as ``blur`` pixels within a slice."""
    draw = np.random.default_rng(seed)
    values = np.full(seg.labels.shape, REST)
    for name, mean in MEANS.items():
        if name in seg.structures:
            values[np.isin(seg.labels, seg.structures[name])] = mean
    if blur:
        from scipy import ndimage

        values = ndimage.gaussian_filter(values, (blur, blur, 0.0))
    return fp.IntensityImage((values + draw.normal(0.0, noise, values.shape)).astype(np.float32), seg.grid)


def linear(grid: Grid) -> fp.IntensityImage:
    """An image whose values are ``world_value`` of the voxels' places."""
    index = np.stack(np.meshgrid(*map(np.arange, grid.shape), indexing="ij"), axis=-1).reshape(-1, 3)
    return fp.IntensityImage(world_value(grid.to_world(index.astype(float))).reshape(grid.shape), grid)


def world_value(points: np.ndarray) -> np.ndarray:
    """Linear in the world, so that linear interpolation is exact."""
    return np.asarray(1000.0 + points @ np.array([1.5, -2.0, 0.7]))


def write_image(image: fp.IntensityImage, path: Any) -> None:
    """Write an image of intensities, of numbers as they are."""
    import SimpleITK as sitk

    made = sitk.GetImageFromArray(np.ascontiguousarray(image.values.T))
    made.SetSpacing([float(s) for s in image.grid.spacing])
    made.SetOrigin([float(x) for x in image.grid.origin])
    made.SetDirection([float(x) for x in image.grid.direction.ravel()])
    sitk.WriteImage(made, str(path))
