"""A structured ventricle with coordinates and segments, and label maps of scars in it whose shape is known."""

from __future__ import annotations

from functools import cache

import numpy as np
from anatomy_meshes import ellipsoid

import femprep as fp
from femprep.image import Grid

AXES = fp.VentricularAxes([0, 0, -65.0], [0, 0, 15.0], [1.0, 0, 0], mirrored=False)


@cache
def ventricle(kind: str = "tetra", size: int = 5, layers: int = 4) -> fp.VolumeMesh:
    """The thick ellipsoid of ``anatomy_meshes`` with coordinates, segments and fibres."""
    mesh = ellipsoid(kind, size=size, layers=layers).mesh
    return fp.add_fibres(fp.add_aha(fp.add_coordinates(mesh, axes=AXES), axes=AXES), axes=AXES)


def depth(points: np.ndarray) -> np.ndarray:
    """0 on the endocardial, 1 on the epicardial ellipsoid."""
    low, high = np.full(len(points), -0.4), np.full(len(points), 1.4)
    for _ in range(30):
        middle = (low + high) / 2
        a, b = 25 + 10 * middle, 55 + 10 * middle
        outside = (points[:, 0] ** 2 + points[:, 1] ** 2) / a**2 + points[:, 2] ** 2 / b**2 > 1.0
        low, high = np.where(outside, middle, low), np.where(outside, high, middle)
    return (low + high) / 2


def sector(points: np.ndarray, inner: float = 0.0, outer: float = 0.5) -> np.ndarray:
    """A scar: 70 degrees of the wall round 40 degrees from x to y, between two depths."""
    turn = np.degrees(np.arctan2(points[:, 1], points[:, 0]))
    through = depth(points)
    return (through >= inner) & (through < outer) & (np.abs(turn - 40.0) < 35.0)


def stack(spacing: tuple[float, float, float] = (1.4, 1.4, 8.0), tilt: float = 0.0) -> Grid:
    """A grid round the ventricle, turned about y."""
    a = np.radians(tilt)
    turn = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    shape = tuple(int(np.ceil(length / step)) for length, step in zip((110.0, 90.0, 120.0), spacing))
    middle = np.array([0.0, 0.0, -25.0])
    return Grid(shape, spacing, middle - turn @ ((np.array(shape) - 1) / 2 * np.array(spacing)), turn)


def centres(grid: Grid) -> np.ndarray:
    """World points of all voxels."""
    index = np.stack(np.meshgrid(*map(np.arange, grid.shape), indexing="ij"), axis=-1).reshape(-1, 3)
    return grid.to_world(index.astype(float))


def late_enhancement(grid: Grid, inner: float = 0.0, outer: float = 0.5) -> fp.Segmentation:
    """Scar 1, a border zone 2 beside it in depth, the rest of the wall 3."""
    points = centres(grid)
    through = depth(points)
    wall = (through >= 0.0) & (through <= 1.0) & (points[:, 2] <= 15.0)
    labels = np.where(wall, 3, 0)
    labels[wall & sector(points, outer, outer + 0.2)] = 2
    labels[wall & sector(points, inner, outer)] = 1
    return fp.Segmentation(labels.reshape(grid.shape).astype(np.uint8), grid, {"scar": (1,)})
