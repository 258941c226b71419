"""The grid of an image: index coordinates in, world points (mm, LPS) out, and back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.model import FloatArray, readonly


@dataclass(frozen=True, eq=False)
class Grid:
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
    """

    shape: tuple[int, int, int]
    spacing: FloatArray
    origin: FloatArray
    direction: FloatArray

    def __post_init__(self) -> None:
        shape = tuple(int(n) for n in self.shape)
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
        # Files hold the directions in single precision, so that they are orthonormal to about 1e-6 only.
        error = np.abs(self.direction.T @ self.direction - np.eye(3)).max()
        if not error < 1e-4:
            raise InputError(f"grid directions are not orthonormal (off by {error:.2g}): {self.direction.tolist()}")

    @property
    def voxel_volume(self) -> float:
        """Volume of one voxel, mm3."""
        return float(np.prod(self.spacing))

    @property
    def stack_axis(self) -> int:
        """Axis across the slices: the one with the largest voxel size; the last one where sizes are equal."""
        largest = self.spacing.max()
        return int(np.flatnonzero(self.spacing >= largest * (1.0 - 1e-3))[-1])

    @property
    def right_handed(self) -> bool:
        """Whether the axes i, j, k form a right-handed system in the world."""
        return bool(np.linalg.det(self.direction) > 0.0)

    def to_world(self, index: npt.ArrayLike) -> FloatArray:
        """World points ``(n, 3)`` mm LPS of (fractional) indices ``(n, 3)``."""
        return np.asarray(
            self.origin + (np.asarray(index, dtype=np.float64) * self.spacing) @ self.direction.T, dtype=np.float64
        )

    def to_index(self, points: npt.ArrayLike) -> FloatArray:
        """Fractional indices ``(n, 3)`` of world points ``(n, 3)`` mm LPS."""
        offset = np.asarray(points, dtype=np.float64) - self.origin
        return np.asarray((offset @ np.linalg.inv(self.direction).T) / self.spacing, dtype=np.float64)

    def window(self, first: tuple[int, int, int], shape: tuple[int, int, int]) -> Grid:
        """The grid of a box of voxels that begins at index ``first`` (may lie outside) and has the given shape."""
        return Grid(shape, self.spacing, self.to_world(np.asarray(first, dtype=float)), self.direction)
