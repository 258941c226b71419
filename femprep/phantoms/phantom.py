"""Phantom: solids with known surfaces at a place in the world; label maps, exact points, volumes, base plane out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import inf
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.image import Grid, Segmentation
from femprep.model import BoolArray, FloatArray, Immutable, Plane, readonly
from femprep.phantoms.rasterise import rasterise, stack_grid
from femprep.phantoms.solids import EllipsoidBody, Solid


@dataclass(frozen=True)
class Region:
    """One closed surface of a phantom.

    Attributes
    ----------
    solid : Solid
        What it encloses.
    label : int
        Label of its voxels; regions painted later replace it.
    structure : str
        Name of that label in the segmentation (the region ``epi`` is painted as ``myo``).
    offset : (3,) tuple
        Where the solid's origin lies in the phantom, mm.
    """

    solid: Solid
    label: int
    structure: str
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Phantom(Immutable):
    """A heart whose surfaces are known.

    Attributes
    ----------
    regions : mapping of str to Region
        Closed surfaces by name (``"rv"``, ``"epi"``, ``"lv"``), in the order in which they are painted.
    name : str
    rotation : (3, 3) array
        Columns are the phantom's x, y and z axis (z the long axis, base towards +z) in the world.
    origin : (3,) array
        Where the phantom's origin lies, mm LPS.
    """

    regions: Mapping[str, Region]
    name: str = "phantom"
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    origin: FloatArray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        object.__setattr__(self, "regions", MappingProxyType(dict(self.regions)))
        object.__setattr__(self, "rotation", readonly(self.rotation, np.float64, (3, 3), "rotation"))
        object.__setattr__(self, "origin", readonly(self.origin, np.float64, (3,), "origin"))
        if not np.allclose(self.rotation.T @ self.rotation, np.eye(3), atol=1e-9):
            raise InputError(f"rotation of phantom {self.name!r} is not orthonormal: {self.rotation.tolist()}")

    def moved(self, rotation: npt.ArrayLike | None = None, origin: npt.ArrayLike | None = None) -> Phantom:
        """The same phantom at another place in the world."""
        return replace(
            self,
            rotation=self.rotation if rotation is None else np.asarray(rotation, dtype=np.float64),
            origin=self.origin if origin is None else np.asarray(origin, dtype=np.float64),
        )

    def inside(self, name: str, points: npt.ArrayLike) -> BoolArray:
        """Whether world points ``(n, 3)`` lie within a region's closed surface."""
        region = self._region(name)
        return region.solid.inside(self._to_solid(region, points))

    def exact_surface(self, name: str, directions: npt.ArrayLike, *, truncated: bool = True) -> FloatArray:
        """Exact points of a region's surface.

        Parameters
        ----------
        name : str
        directions : (n, 3) array
            Unit vectors.
        truncated : bool
            Whether flat caps belong to the surface; else the smooth surface as it was before it was cut.

        Returns
        -------
        (n, 3) array
            mm LPS.
        """
        region = self._region(name)
        directions = np.asarray(directions, dtype=np.float64)
        points = region.solid.surface(directions) if truncated else region.solid.smooth_surface(directions)
        return np.asarray((points + region.offset) @ self.rotation.T + self.origin)

    def distance(self, name: str, points: npt.ArrayLike) -> FloatArray:
        """Signed distance ``(n,)`` of world points from a region's smooth surface (before truncation), mm."""
        region = self._region(name)
        return region.solid.distance(self._to_solid(region, points))

    def volume(self, name: str, low: float = -inf, high: float = inf) -> float:
        """Closed-form volume of a region between two heights along the long axis, mm3."""
        region = self._region(name)
        return region.solid.volume(low - region.offset[2], high - region.offset[2])

    @property
    def cavity_volume(self) -> float:
        """Volume of the left-ventricular cavity, mm3."""
        return self.volume("lv")

    @property
    def wall_volume(self) -> float:
        """Volume of the left-ventricular wall: epicardium less cavity, mm3."""
        return self.volume("epi") - self.volume("lv")

    @property
    def base(self) -> Plane:
        """Plane of the upper cut, its normal pointing out of the heart.

        Raises
        ------
        InputError
            The phantom is not cut.
        """
        for region in reversed(list(self.regions.values())):
            solid = region.solid
            if isinstance(solid, EllipsoidBody) and np.isfinite(solid.high):
                top = np.array([[0.0, 0.0, solid.high]])
                point = solid.bend.forward(top)[0] + region.offset
                normal = solid.bend.jacobian(top)[0, :, 2] if solid.bend.along == 2 else np.array([0.0, 0.0, 1.0])
                return Plane(self.rotation @ point + self.origin, self.rotation @ normal, source="phantom")
        raise InputError(f"phantom {self.name!r} is not cut by a base plane")

    def height(self, points: npt.ArrayLike) -> FloatArray:
        """Height ``(n,)`` of world points along the phantom's straight long axis, mm."""
        return np.asarray((np.asarray(points, dtype=np.float64) - self.origin) @ self.rotation[:, 2])

    def grid(self, spacing: npt.ArrayLike, **placement: Any) -> Grid:
        """A stack of slices that holds the phantom; see :func:`femprep.phantoms.rasterise.stack_grid`."""
        return stack_grid(self, spacing, **placement)

    def segmentation(
        self,
        spacing: npt.ArrayLike = (1.44, 1.44, 8.0),
        *,
        grid: Grid | None = None,
        supersample: int = 1,
        slice_thickness: float | None = None,
        shifts: npt.ArrayLike | None = None,
        apex: str = "capped",
        **placement: Any,
    ) -> Segmentation:
        """Label map of the phantom.

        Parameters
        ----------
        spacing : 3 floats
            Voxel size, mm; the last one between slices.
        grid : Grid, optional
            Any grid, in place of ``spacing`` and ``placement``.
        supersample : int
            1: a voxel has the label of its centre. n: it belongs to a region when more than half of n x n x n points
            in it do (partial volume).
        slice_thickness : float, optional
            Thickness the points of a voxel spread over across the slice, mm; the distance of slices where not given.
        shifts : (n_slices, 2) array, optional
            How far each slice is displaced along its two in-plane axes, mm (breath-hold shifts).
        apex : str
            ``"capped"``, or ``"uncapped"``: slices below the cavity hold no myocardium, as in ACDC.
        **placement
            Passed to :meth:`grid`.

        Returns
        -------
        Segmentation
        """
        grid = self.grid(spacing, **placement) if grid is None else grid
        labels = rasterise(self, grid, supersample, slice_thickness, shifts, apex)
        structures = {region.structure: (region.label,) for region in self.regions.values()}
        return Segmentation(labels, grid, structures, {"file": self.name, "phantom": self.name})

    def _region(self, name: str) -> Region:
        if name not in self.regions:
            raise InputError(f"phantom {self.name!r} has no surface {name!r}; it has {', '.join(self.regions)}")
        return self.regions[name]

    def _to_solid(self, region: Region, points: npt.ArrayLike) -> FloatArray:
        world = np.atleast_2d(np.asarray(points, dtype=np.float64))
        return np.asarray((world - self.origin) @ self.rotation - region.offset)
