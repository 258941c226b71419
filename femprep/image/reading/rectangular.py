"""A volume whose axes are not at right angles in, the same on a rectangular grid out, resampled within its slices.

The slices stay in their planes, so that nothing is made up between them: each is drawn anew with rectangular pixels.
Labels move by their shapes: at each place the label counts that it lies deepest in, by signed distances smoothed a
little, so that outlines move by fractions of a pixel, not by whole ones. Intensities are interpolated linearly.

References
----------
Raya & Udupa 1990, Shape-based interpolation of multidimensional objects, doi 10.1109/42.52980.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.image.grid import Grid
from femprep.image.reading.native import require_memory
from femprep.image.resample import slice_distance
from femprep.image.segmentation import count_labels
from femprep.image.topology import used_box
from femprep.model import FloatArray

#: Cosine between axes from which they are taken for sheared, as ``Grid`` refuses them.
SHEARED: Final = 1e-4
#: Smoothing of the distances, pixels: evens out steps of one pixel, and keeps a wall of one pixel.
_BLUR: Final = 0.7
#: Pixels around the labels of a slice that are drawn.
_ROOM: Final = 3


def is_sheared(step: FloatArray) -> bool:
    """Whether steps along the axes, columns ``(3, 3)``, are finite and not at right angles."""
    if not np.isfinite(step).all() or not np.linalg.det(step):
        return False
    unit = step / np.linalg.norm(step, axis=0)
    return bool(np.abs(unit.T @ unit - np.eye(3)).max() >= SHEARED)


def sharpest_angle(step: FloatArray) -> float:
    """Smallest angle between two axes, degrees."""
    unit = step / np.linalg.norm(step, axis=0)
    return float(np.degrees(np.arccos(np.abs(unit.T @ unit - np.eye(3)).max())))


@dataclass(frozen=True)
class _Slices:
    """How pixels of each slice of the rectangular grid lie in the slice of the sheared one.

    Attributes
    ----------
    axes : (int, int, int)
        The two axes within slices, and the one across.
    back : (2, 2) array
        Sheared index within a slice, of places along the slice's two directions, mm.
    shift : (2,) array
        How far a slice lies from the one before within its plane, mm.
    first : (2,) array
        Place of the first rectangular pixel from that of the first sheared one, mm.
    """

    grid: Grid
    axes: tuple[int, int, int]
    sizes: FloatArray
    back: FloatArray
    shift: FloatArray
    first: FloatArray

    def places(self, k: int) -> FloatArray:
        """Sheared index ``(2, n, m)`` of each rectangular pixel of slice ``k``."""
        counts = [self.grid.shape[axis] for axis in self.axes[:2]]
        local = np.indices(counts, dtype=np.float64) * self.sizes[:, None, None]
        local += (self.first - k * self.shift)[:, None, None]
        return np.asarray(np.einsum("ij,jnm->inm", self.back, local), dtype=np.float64)


def _slices(shape: tuple[int, ...], step: FloatArray, origin: FloatArray, file: Path) -> _Slices:
    """The rectangular grid that covers a sheared one, of the same slices and the same volume of a voxel."""
    lengths = np.linalg.norm(step, axis=0)
    across = int(np.flatnonzero(lengths >= lengths.max() * (1.0 - 1e-3))[-1])
    a, b = (axis for axis in range(3) if axis != across)
    normal = np.cross(step[:, a], step[:, b])
    normal /= np.linalg.norm(normal)
    normal *= np.sign(step[:, across] @ normal)
    along = step[:, a] / lengths[a]
    aside = step[:, b] - (step[:, b] @ along) * along
    aside /= np.linalg.norm(aside)
    plane = np.column_stack([along, aside])
    within = plane.T @ step[:, [a, b]]
    shift = plane.T @ step[:, across]
    sizes = np.array([lengths[a], step[:, b] @ aside])
    corners = np.array([[i, j] for i in (0, shape[a] - 1) for j in (0, shape[b] - 1)], dtype=np.float64) @ within.T
    corners = np.concatenate([corners, corners + (shape[across] - 1) * shift])
    first = np.floor(corners.min(axis=0) / sizes + 1e-6) * sizes
    counts = np.ceil((corners.max(axis=0) - first) / sizes - 1e-6).astype(int) + 1
    direction, spacing, size = np.zeros((3, 3)), np.zeros(3), [0, 0, 0]
    for axis, vector, length, count in (
        (a, along, sizes[0], counts[0]),
        (b, aside, sizes[1], counts[1]),
        (across, normal, step[:, across] @ normal, shape[across]),
    ):
        direction[:, axis], spacing[axis], size[axis] = vector, length, int(count)
    require_memory(file, size)
    grid = Grid((size[0], size[1], size[2]), spacing, origin + plane @ first, direction)
    (p, q), (r, s) = within
    back = np.array([[s, -q], [-r, p]]) / (p * s - q * r)
    return _Slices(grid, (a, b, across), sizes, back, shift, first)


def rectangular_labels(
    labels: npt.NDArray[Any], step: FloatArray, origin: FloatArray, file: Path
) -> tuple[npt.NDArray[Any], Grid, str]:
    """Labels on the rectangular grid, and what is said of it.

    Parameters
    ----------
    labels : (i, j, k) array
    step : (3, 3) array
        Steps along the axes as columns, mm.
    origin : (3,) array
        Centre of the first voxel, mm.
    file : path
        Named where there is not enough memory.
    """
    slices = _slices(labels.shape, step, origin, file)
    out = np.zeros(slices.grid.shape, labels.dtype)
    across = slices.axes[2]
    for k, plane, drawn in _planes(labels, out, across):
        if plane.any():
            _draw(plane, slices.places(k), drawn)
    before, after = count_labels(labels), count_labels(out)
    change = max((abs(after.get(label, 0) / count - 1.0) for label, count in before.items() if label), default=0.0)
    said = (
        f"axes at {sharpest_angle(step):.1f} degrees to one another: resampled within the slices onto "
        f"{' x '.join(map(str, out.shape))} voxels; volumes of labels change by {100.0 * change:.2g} % at most"
    )
    return out, slices.grid, said


def rectangular_values(
    values: npt.NDArray[Any], step: FloatArray, origin: FloatArray, file: Path
) -> tuple[npt.NDArray[np.floating[Any]], Grid]:
    """Intensities on the rectangular grid, NaN beyond the image; parameters as of :func:`rectangular_labels`."""
    from scipy import ndimage

    slices = _slices(values.shape, step, origin, file)
    out = np.full(slices.grid.shape, np.nan, dtype=np.float32)
    for k, plane, drawn in _planes(values, out, slices.axes[2]):
        drawn[...] = ndimage.map_coordinates(plane.astype(np.float64), slices.places(k), order=1, cval=np.nan)
    return out, slices.grid


def _planes(
    source: npt.NDArray[Any], target: npt.NDArray[Any], across: int
) -> Iterator[tuple[int, npt.NDArray[Any], npt.NDArray[Any]]]:
    """Number of each slice, with views of it in both arrays."""
    for k in range(source.shape[across]):
        at = tuple(k if axis == across else slice(None) for axis in range(3))
        yield k, source[at], target[at]


def _draw(plane: npt.NDArray[Any], places: FloatArray, drawn: npt.NDArray[Any]) -> None:
    """Draw the labels of a slice at sheared places: at each the label, or none, that it lies deepest in."""
    from scipy import ndimage

    box = tuple(slice(max(part.start - _ROOM, 0), part.stop + _ROOM) for part in used_box(plane != 0))
    used = np.pad(plane[box], _ROOM)
    low = np.array([part.start - _ROOM for part in box], dtype=np.float64)
    own = places - low[:, None, None]
    inside = np.all((own >= 0.0) & (own <= np.array(used.shape)[:, None, None] - 1.0), axis=0)
    if not inside.any():
        return
    part = used_box(inside)
    own = own[(slice(None), *part)]
    deepest = np.full(own.shape[1:], -np.inf)
    found = np.zeros(own.shape[1:], dtype=drawn.dtype)
    for label in np.unique(used):
        depth = ndimage.gaussian_filter(slice_distance(used == label, (1.0, 1.0)), _BLUR)
        depth = ndimage.map_coordinates(depth, own, order=1, mode="nearest")
        deeper = depth > deepest
        deepest[deeper], found[deeper] = depth[deeper], label
    view = drawn[part]
    view[inside[part]] = found[inside[part]]
