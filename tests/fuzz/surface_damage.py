"""Surfaces in, damaged ones out: what meshes of surfaces come to by scanners, exporters, units and mistakes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from fuzz.damage import Random, choose

from femprep.model import Surface


def _holed(random: Random, surface: Surface) -> Surface:
    centre = surface.points[int(random.integers(len(surface.points)))]
    middle = surface.points[surface.triangles].mean(axis=1)
    kept = np.linalg.norm(middle - centre, axis=1) > float(random.uniform(3.0, 40.0))
    return replace(surface, cells=surface.triangles[kept]) if kept.sum() > 3 else surface


def _dropped(random: Random, surface: Surface) -> Surface:
    kept = random.random(len(surface.triangles)) > float(choose(random, (0.01, 0.1, 0.5)))  # type: ignore[arg-type]
    kept[:4] = True
    return replace(surface, cells=surface.triangles[kept])


def _flipped(random: Random, surface: Surface) -> Surface:
    rows = random.random(len(surface.triangles)) < float(choose(random, (1.1, 0.5, 0.05)))  # type: ignore[arg-type]
    cells = np.array(surface.triangles)
    cells[rows] = cells[rows][:, ::-1]
    return replace(surface, cells=cells)


def _noisy(random: Random, surface: Surface) -> Surface:
    size = float(choose(random, (0.1, 1.0, 5.0, 30.0)))  # type: ignore[arg-type]
    return replace(surface, points=surface.points + random.normal(0.0, size, surface.points.shape))


def _scaled(random: Random, surface: Surface) -> Surface:
    factor = float(choose(random, (1e-3, 1e3, 0.1, 10.0, -1.0, 1e-30, 1e30, 0.0)))  # type: ignore[arg-type]
    return replace(surface, points=surface.points * factor)


def _moved(random: Random, surface: Surface) -> Surface:
    shift = random.normal(0.0, float(choose(random, (5.0, 50.0, 1e6))), 3)  # type: ignore[arg-type]
    return replace(surface, points=surface.points + shift)


def _turned(random: Random, surface: Surface) -> Surface:
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return replace(surface, points=surface.points @ turn)


def _flat(random: Random, surface: Surface) -> Surface:
    factors = np.ones(3)
    factors[int(random.integers(3))] = float(choose(random, (0.0, 1e-6, 0.05)))  # type: ignore[arg-type]
    return replace(surface, points=surface.points * factors)


def _spiked(random: Random, surface: Surface) -> Surface:
    points = np.array(surface.points)
    rows = random.integers(0, len(points), int(random.integers(1, 6)))
    points[rows] *= float(choose(random, (3.0, 100.0, -2.0, 0.0)))  # type: ignore[arg-type]
    return replace(surface, points=points)


def _doubled(random: Random, surface: Surface) -> Surface:
    """Triangles given twice, or the surface twice, apart or not."""
    if random.random() < 0.5:
        rows = random.integers(0, len(surface.triangles), int(random.integers(1, 50)))
        return replace(surface, cells=np.concatenate([surface.triangles, surface.triangles[rows]]))
    shift = float(choose(random, (0.0, 0.5, 200.0)))  # type: ignore[arg-type]
    points = np.concatenate([surface.points, surface.points + np.array([shift, 0.0, 0.0])])
    return replace(
        surface, points=points, cells=np.concatenate([surface.triangles, surface.triangles + len(points) // 2])
    )


def _torn(random: Random, surface: Surface) -> Surface:
    """Every triangle with corners of its own, some of them apart from their neighbours'."""
    corners = surface.points[surface.triangles].reshape(-1, 3)
    corners = corners + random.normal(0.0, float(choose(random, (0.0, 1e-5, 0.3))), corners.shape)  # type: ignore[arg-type]
    return replace(surface, points=corners, cells=np.arange(len(corners)).reshape(-1, 3))


def _few(random: Random, surface: Surface) -> Surface:
    return replace(surface, cells=surface.triangles[: int(random.integers(1, 9))])


def _cut(random: Random, surface: Surface) -> Surface:
    """An open cup, cut at any height along any axis."""
    axis = int(random.integers(3))
    middle = surface.points[surface.triangles].mean(axis=1)[:, axis]
    kept = middle < np.quantile(middle, float(random.uniform(0.2, 0.95)))
    return replace(surface, cells=surface.triangles[kept])


#: What may be done to a surface, by name.
SURFACES: dict[str, Callable[[Random, Surface], Surface]] = {
    "holed": _holed,
    "triangles dropped": _dropped,
    "flipped": _flipped,
    "noisy": _noisy,
    "scaled": _scaled,
    "moved": _moved,
    "turned": _turned,
    "flat": _flat,
    "spiked": _spiked,
    "doubled": _doubled,
    "torn": _torn,
    "few triangles": _few,
    "cut": _cut,
}
