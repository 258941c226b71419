"""An image of intensities beside a label map in, its values at places of the labels out: to draw one on the other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError, OptionError
from femprep.image.grid import Grid
from femprep.image.reading.intensity import IntensityImage, read_image
from femprep.image.segmentation import Segmentation
from femprep.image.shifts import scanned_places
from femprep.model import BoolArray, FloatArray, Notice, noted
from femprep.model.image_file import ImageFile
from femprep.options import Options

_MIRRORED: Final = "flip mirrors the label map and not the {}; mirror both files first"
#: Grids whose voxels lie closer than this share of a voxel are one.
_SAME: Final = 0.05


@dataclass(frozen=True, eq=False)
class Underlay:
    """An image that lies under a label map.

    Attributes
    ----------
    seg : Segmentation
        The label map, its slices moved back or not.
    image : IntensityImage
    same_grid : bool
        Whether the image has the voxels of the label map, so that nothing is interpolated.
    covered : float
        Share of the labelled voxels that lie in the image.
    """

    seg: Segmentation
    image: IntensityImage
    same_grid: bool
    covered: float

    def values(self, index: npt.ArrayLike) -> FloatArray:
        """Values of the image where (fractional) indices of the label map ``(n, 3)`` lay in the scanner; NaN beyond it.

        Parameters
        ----------
        index : (n, 3) array

        Returns
        -------
        (n,) array
            Interpolated linearly.
        """
        from scipy import ndimage

        places = self.image.grid.to_index(scanned_places(self.seg, np.asarray(index, dtype=np.float64)))
        shape = np.array(self.image.grid.shape)
        inside = ((places > -0.5) & (places < shape - 0.5)).all(axis=1)
        found = np.full(len(places), np.nan)
        # Beyond the centres of the outermost voxels their values go on to their faces.
        at = np.clip(places[inside], 0.0, shape - 1.0).T
        found[inside] = ndimage.map_coordinates(self.image.values, at, order=1, mode="nearest")
        return found


def lay_under(seg: Segmentation, image: IntensityImage, name: str = "image") -> Underlay:
    """Compare the grid and pose of an image with those of a label map, and lay it under.

    Parameters
    ----------
    seg : Segmentation
    image : IntensityImage
        Of any grid and pose, in the same world coordinates.
    name : str
        What a refusal calls it.

    Returns
    -------
    Underlay

    Raises
    ------
    InputError
        No labelled voxel lies in the image, or the label map was mirrored and the image was not.

    Examples
    --------
    >>> from femprep.image.underlay import lay_under
    >>> under = lay_under(seg, fp.IntensityImage(100.0 * seg.labels, seg.grid))
    >>> under.same_grid, under.covered
    (True, 1.0)
    """
    if seg.info.get("flipped"):
        raise InputError(_MIRRORED.format(name))
    numbers = [number for labels in seg.structures.values() for number in labels]
    marked = np.argwhere(np.isin(seg.labels, numbers))
    centres = scanned_places(seg, marked.astype(np.float64))
    inside = within(image.grid, centres)
    if len(centres) and not inside.any():
        middle = np.round(centres.mean(axis=0), 1).tolist()
        raise InputError(
            f"the {name} does not meet the labels: its middle is at {_middle(image.grid)}, theirs at {middle} mm; both "
            "files have to be in the same world coordinates"
        )
    corners = np.array([[0, 0, 0], np.array(seg.grid.shape) - 1, *np.diag(np.array(seg.grid.shape) - 1)], dtype=float)
    same = seg.grid.shape == image.grid.shape and bool(
        np.abs(image.grid.to_index(scanned_places(seg, corners)) - corners).max() < _SAME
    )
    return Underlay(seg, image, same, float(inside.mean()) if len(inside) else 1.0)


def read_under(seg: Segmentation, file: ImageFile, options: Options) -> IntensityImage:
    """Read an image that is to lie under a label map, and make sure that it can.

    Raises
    ------
    FileError, InputError, OptionError
        It cannot be read, does not lie where the labels do, or these are to be mirrored.
    """
    if options.flip:
        raise OptionError(_MIRRORED.format(f"image {str(file.path)!r}"))
    image = read_image(file.path, frame=file.frame)
    if options.image.spacing is not None and image.grid.shape == seg.grid.shape:
        # What the header of the labels lacks that of their image lacks too, as a rule.
        line = "the image (--image) was given the voxel sizes of the labels, by the option spacing"
        grid = replace(image.grid, spacing=seg.grid.spacing)
        image = replace(image, grid=grid, info=noted(image.info, Notice.of("assumed", line)))
    lay_under(seg, image, f"image {str(file.path)!r}")
    return image


def within(grid: Grid, points: FloatArray) -> BoolArray:
    """Whether points ``(n, 3)`` mm lie in the box of a grid's voxels, ``(n,)``."""
    index = grid.to_index(points)
    return np.asarray(((index > -0.5) & (index < np.array(grid.shape) - 0.5)).all(axis=1))


def window(values: FloatArray, share: float = 1.0) -> tuple[float, float]:
    """Values that are drawn black and white: all but ``share`` per cent at each end lie between."""
    known = values[np.isfinite(values)]
    if not len(known):
        return 0.0, 1.0
    low, high = (float(x) for x in np.percentile(known, (share, 100.0 - share)))
    return low, high if high > low else low + 1.0


def greys(values: FloatArray, limits: tuple[float, float]) -> npt.NDArray[np.uint8]:
    """Values as shades from 0 to 255 between two limits; NaN are white."""
    low, high = limits
    return np.asarray(np.nan_to_num(np.clip((values - low) / (high - low), 0.0, 1.0), nan=1.0) * 255.0, dtype=np.uint8)


def _middle(grid: Grid) -> list[float]:
    return [float(x) for x in np.round(grid.to_world([(np.array(grid.shape) - 1) / 2.0])[0], 1)]
