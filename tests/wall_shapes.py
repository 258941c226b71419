"""Exact template surfaces and label maps for the tests of the wall stage."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from femprep.image import Grid, Segmentation
from femprep.model import Plane, Surface
from femprep.template import charge_template


@dataclass(frozen=True)
class Ellipsoid:
    """The map from the unit sphere to an ellipsoid."""

    axes: tuple[float, float, float]
    centre: np.ndarray = field(default_factory=lambda: np.zeros(3))
    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))

    def __call__(self, directions) -> np.ndarray:
        return (np.asarray(directions) * self.axes) @ self.rotation.T + self.centre

    def off(self, points) -> np.ndarray:
        """How far points lie off the ellipsoid, in shares of its size."""
        return np.linalg.norm(((points - self.centre) @ self.rotation) / self.axes, axis=1) - 1.0


def template_surface(shape: Callable[[np.ndarray], np.ndarray], vertices: int = 600, name: str = "lv") -> Surface:
    """A template sent through a map of the sphere."""
    template = charge_template(vertices)
    return Surface(shape(template.directions), template.cells, name, directions=template.directions, shape=shape)


def ellipsoids(
    inner=(25.0, 25.0, 45.0), outer=(33.0, 33.0, 53.0), vertices: int = 600, rotation=None, centre=(0.0, 0.0, 0.0)
) -> tuple[Surface, Surface]:
    """Endocardium and epicardium of a thick ellipsoid; the apex is at -z."""
    turn = np.eye(3) if rotation is None else rotation
    endo = template_surface(Ellipsoid(inner, np.asarray(centre), turn), vertices, "lv")
    epi = template_surface(Ellipsoid(outer, np.asarray(centre), turn), vertices, "epi")
    return epi, endo


def cap_volume(axes, height: float) -> float:
    """Volume of an ellipsoid about the origin below z = height."""
    a, b, c = axes
    t = height / c
    return float(np.pi * a * b * c * (2.0 / 3.0 + t - t**3 / 3.0))


def plane_z(height: float, up: bool = True) -> Plane:
    return Plane(np.array([0.0, 0.0, height]), np.array([0.0, 0.0, 1.0 if up else -1.0]))


def turned(seed: int) -> np.ndarray:
    """A random proper rotation."""
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    turn[:, 0] *= np.sign(np.linalg.det(turn))
    return turn


def stack(slices: list[str], spacing=(1.5, 1.5, 8.0), direction=None, radii=None) -> Segmentation:
    """A label map drawn slice by slice: ``o`` ring around cavity, ``c`` open ring, ``m`` myocardium alone, ``.`` empty.

    The rings shrink from the first slice to the last one unless radii (of the cavity, mm) are given; walls are 8 mm.
    """
    n = 64
    x = (np.arange(n) - (n - 1) / 2) * spacing[0]
    radius = np.hypot(*np.meshgrid(x, x, indexing="ij"))
    radii = np.linspace(24.0, 12.0, len(slices)) if radii is None else radii
    labels = np.zeros((n, n, len(slices)), dtype=np.uint8)
    for k, (kind, inner) in enumerate(zip(slices, radii)):
        if kind in "oc":
            labels[radius < inner + 8.0, k] = 2
            labels[radius < inner, k] = 3
        if kind == "c":
            labels[: n // 2, n // 2 - 2 : n // 2 + 2, k] *= labels[: n // 2, n // 2 - 2 : n // 2 + 2, k] == 3
        if kind == "m":
            labels[radius < inner + 8.0, k] = 2
    turn = np.eye(3) if direction is None else direction
    grid = Grid(labels.shape, np.asarray(spacing), np.array([5.0, -7.0, 11.0]), turn)
    return Segmentation(labels, grid, {"rv": (1,), "myo": (2,), "lv": (3,)})


def shifted_end(shift: float) -> Segmentation:
    """A tapering stack whose last slice, still with cavity, lies beside the others and is half as wide."""
    radii = np.array([24.0, 24.0, 23.0, 21.0, 19.0, 16.0, 8.0])
    seg = stack(list("coooooo"), radii=radii)
    labels = seg.labels.copy()
    labels[:, :, -1] = np.roll(labels[:, :, -1], round(shift / seg.grid.spacing[0]), axis=0)
    return Segmentation(labels, seg.grid, seg.structures)
