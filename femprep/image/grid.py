"""The grid of an image: index coordinates in, world points (mm, LPS) out, and back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, TypeVar

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError, quoted
from femprep.model import FloatArray, Immutable, readonly
from femprep.model.arrays import integers
from femprep.model.products import inverse, product

_Value = TypeVar("_Value", bound=np.generic)

#: Farthest origin, mm: no scanner is 10 km large, and in single precision a millimetre is lost there.
FARTHEST: Final = 1e7


@dataclass(frozen=True, eq=False)
class Grid(Immutable):
    """A regular grid of voxels; its arrays are indexed ``[i, j, k]`` as ITK's index, i running fastest in the file.

    Index ``(i, j, k)`` is the *centre* of a voxel; the voxel reaches half a step to each side.

    Attributes
    ----------
    shape : tuple of 3 ints
        Number of voxels along each axis.
    spacing : (3,) array
        Voxel size along each axis, mm.
    origin : (3,) array
        World position of the centre of voxel (0, 0, 0), mm LPS.
    direction : (3, 3) array
        Column ``a`` is the unit vector in world coordinates along which index ``a`` grows. May be oblique and may be
        left-handed.
    offsets : (n, 3) array, optional
        How far each slice of the stack is moved along the three axes, mm, zero along the stack: slices that were put
        right against each other by broken pixels. Between slices the offset is interpolated.
    stack : int, optional
        Axis across the slices where voxel sizes do not tell: it counts among the axes with the largest size alone.
    drawn_pixel : float, optional
        Pixel size of the image in which the labels were drawn, mm, where theirs is smaller (contours filled with
        labels).

    Examples
    --------
    >>> grid = fp.Grid((10, 10, 5), (1.5, 1.5, 8.0), (0.0, 0.0, 0.0), [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> grid.to_world([[0, 0, 1]]).tolist()
    [[0.0, 0.0, 8.0]]
    """

    shape: tuple[int, int, int]
    spacing: FloatArray
    origin: FloatArray
    direction: FloatArray
    offsets: FloatArray | None = None
    stack: int | None = None
    drawn_pixel: float | None = None

    def __post_init__(self) -> None:
        shape = tuple(np.atleast_1d(integers(self.shape, "grid shape")).tolist())
        if len(shape) != 3 or min(shape) < 1:
            raise InputError(f"grid shape is {self.shape}, expected three positive numbers of voxels")
        object.__setattr__(self, "shape", shape)
        object.__setattr__(self, "spacing", readonly(self.spacing, np.float64, (3,), "grid spacing"))
        object.__setattr__(self, "origin", readonly(self.origin, np.float64, (3,), "grid origin"))
        object.__setattr__(self, "direction", readonly(self.direction, np.float64, (3, 3), "grid direction"))
        if not np.all(np.isfinite(self.spacing)) or np.any(self.spacing <= 0.0):
            raise InputError(f"voxel sizes are {self.spacing.tolist()} mm, expected three positive numbers")
        if not np.all(np.isfinite(self.origin)):
            raise InputError(f"grid origin is {self.origin.tolist()}, expected finite numbers")
        if np.abs(self.origin).max() > FARTHEST:
            raise InputError(
                f"grid origin is {self.origin.tolist()} mm, farther than {FARTHEST:g} mm from 0, where rounding eats "
                "up a voxel; mend the header"
            )
        # Files hold the directions in single precision, so that they are orthonormal to about 1e-6 only.
        error = np.abs(self.direction.T @ self.direction - np.eye(3)).max()
        if not error < 1e-4:
            raise InputError(f"grid directions are not orthonormal (off by {error:.2g}): {self.direction.tolist()}")
        if self.offsets is not None:
            axis = self.stack_axis
            offsets = readonly(self.offsets, np.float64, (shape[axis], 3), "grid offsets")
            if not np.all(np.isfinite(offsets)) or np.any(offsets[:, axis]):
                raise InputError("grid offsets are not finite, or move slices along the stack")
            object.__setattr__(self, "offsets", offsets if np.any(offsets) else None)

    def __repr__(self) -> str:
        return f"Grid({self.words})"

    @property
    def words(self) -> str:
        """Its size in words.

        Examples
        --------
        >>> seg.grid.words
        '... voxels of 1.4 x 1.4 x 8 mm'
        """
        sides = " x ".join(f"{x:.3g}" for x in self.spacing)
        return f"{' x '.join(map(str, self.shape))} voxels of {sides} mm"

    @property
    def voxel_volume(self) -> float:
        """Volume of one voxel, mm3.

        Examples
        --------
        >>> grid = fp.Grid((10, 10, 5), (1.5, 1.5, 8.0), (0.0, 0.0, 0.0), [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
        >>> grid.voxel_volume
        18.0
        """
        return float(np.prod(self.spacing))

    @property
    def stack_axis(self) -> int:
        """Axis across the slices: the one with the largest voxel size; where sizes are equal ``stack``, or the last.

        Examples
        --------
        >>> grid = fp.Grid((10, 10, 5), (1.5, 1.5, 8.0), (0.0, 0.0, 0.0), [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
        >>> grid.stack_axis
        2
        """
        thick = self.thick_axes
        return self.stack if self.stack in thick else thick[-1]

    @property
    def flat_axes(self) -> tuple[int, int]:
        """The two other axes, along the slices.

        Examples
        --------
        >>> grid = fp.Grid((10, 10, 5), (1.5, 1.5, 8.0), (0.0, 0.0, 0.0), [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
        >>> grid.flat_axes
        (0, 1)
        """
        one, two = (axis for axis in range(3) if axis != self.stack_axis)
        return one, two

    @property
    def pixel(self) -> float:
        """The smaller voxel size along the slices, mm.

        Examples
        --------
        >>> grid = fp.Grid((10, 10, 5), (1.5, 1.5, 8.0), (0.0, 0.0, 0.0), [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
        >>> grid.pixel
        1.5
        """
        return float(self.spacing[list(self.flat_axes)].min())

    @property
    def thick_axes(self) -> list[int]:
        """The axes with the largest voxel size: one, or several of equal size.

        Examples
        --------
        >>> grid = fp.Grid((10, 10, 5), (1.5, 1.5, 8.0), (0.0, 0.0, 0.0), [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
        >>> grid.thick_axes
        [2]
        """
        return [int(axis) for axis in np.flatnonzero(self.spacing >= self.spacing.max() * (1.0 - 1e-3))]

    @property
    def right_handed(self) -> bool:
        """Whether the axes i, j, k form a right-handed system in the world.

        Examples
        --------
        >>> grid = fp.Grid((10, 10, 5), (1.5, 1.5, 8.0), (0.0, 0.0, 0.0), [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
        >>> grid.right_handed
        True
        """
        return bool(np.linalg.det(self.direction) > 0.0)

    def offset_at(self, position: npt.ArrayLike) -> FloatArray:
        """Offset ``(n, 3)`` mm along the axes at (fractional) slice numbers ``(n,)``, constant beyond the ends.

        Examples
        --------
        >>> grid = fp.Grid((10, 10, 5), (1.5, 1.5, 8.0), (0.0, 0.0, 0.0), [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
        >>> grid.offset_at([0.0, 1.5]).tolist()
        [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
        """
        position = np.asarray(position, dtype=np.float64)
        if self.offsets is None:
            return np.zeros((*position.shape, 3))
        numbers = np.arange(len(self.offsets))
        return np.stack([np.interp(position, numbers, self.offsets[:, a]) for a in range(3)], axis=-1)

    def to_world(self, index: npt.ArrayLike) -> FloatArray:
        """World points ``(n, 3)`` mm LPS of (fractional) indices ``(n, 3)``.

        Examples
        --------
        >>> grid = fp.Grid((10, 10, 5), (1.5, 1.5, 8.0), (0.0, 0.0, 0.0), [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
        >>> grid.to_world([[0, 0, 1]]).tolist()
        [[0.0, 0.0, 8.0]]
        """
        index = np.asarray(index, dtype=np.float64)
        local = index * self.spacing
        if self.offsets is not None:
            local += self.offset_at(index[..., self.stack_axis])
        return np.asarray(self.origin + product(local, self.direction.T), dtype=np.float64)

    def to_index(self, points: npt.ArrayLike) -> FloatArray:
        """Fractional indices ``(n, 3)`` of world points ``(n, 3)`` mm LPS.

        Examples
        --------
        >>> grid = fp.Grid((10, 10, 5), (1.5, 1.5, 8.0), (0.0, 0.0, 0.0), [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
        >>> grid.to_index([[0.0, 3.0, 8.0]]).tolist()
        [[0.0, 2.0, 1.0]]
        """
        local = product(np.asarray(points, dtype=np.float64) - self.origin, inverse(self.direction).T)
        if self.offsets is not None:
            axis = self.stack_axis
            # Slices stay in their planes, so that the number of the slice is known first.
            local -= self.offset_at(local[..., axis] / self.spacing[axis])
        return np.asarray(local / self.spacing, dtype=np.float64)

    def values_at(self, values: npt.NDArray[_Value], index: FloatArray) -> npt.NDArray[_Value]:
        """Values of the voxels that fractional indices lie in; 0 outside of the image.

        Parameters
        ----------
        values : array
            One for each voxel.
        index : (n, 3) array
            As :meth:`to_index` gives them.

        Returns
        -------
        (n,) array

        Examples
        --------
        >>> import numpy as np
        >>> voxels = np.argwhere(seg.labels == 3)
        >>> bool((seg.grid.values_at(seg.labels, voxels + 0.4) == 3).all())
        True
        """
        nearest = np.rint(index).astype(np.int64)
        inside = ((nearest >= 0) & (nearest < self.shape)).all(axis=1)
        found = np.zeros(len(nearest), values.dtype)
        found[inside] = values[tuple(nearest[inside].T)]
        return found

    @property
    def regular(self) -> Grid:
        """The same grid without offsets.

        Examples
        --------
        >>> seg.grid.regular.shape == seg.grid.shape
        True
        """
        return self if self.offsets is None else replace(self, offsets=None)

    def window(self, first: tuple[int, int, int], shape: tuple[int, int, int]) -> Grid:
        """The grid of a box of voxels that begins at index ``first`` (may lie outside) and has the given shape.

        Examples
        --------
        >>> grid = fp.Grid((10, 10, 5), (1.5, 1.5, 8.0), (0.0, 0.0, 0.0), [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
        >>> grid.window((2, 0, 1), (4, 4, 2)).origin.tolist()
        [3.0, 0.0, 8.0]
        """
        origin = self.regular.to_world(np.asarray(first, dtype=float))
        axis = self.stack_axis
        offsets = None if self.offsets is None else self.offset_at(first[axis] + np.arange(shape[axis]))
        return replace(self, shape=shape, origin=origin, offsets=offsets)


def require_grid(grid: Grid) -> None:
    """Refuse what is no grid, where whoever calls the library gave it.

    Raises
    ------
    InputError
    """
    if not isinstance(grid, Grid):
        raise InputError(f"the grid is {quoted(grid)}, expected a Grid")
