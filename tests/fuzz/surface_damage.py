"""Surfaces in, damaged ones out: what meshes of surfaces come to by scanners, exporters, units and mistakes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from fuzz.damage import Random, choose


@dataclass(frozen=True)
class Shape:
    """Points and triangles that nothing is asked of, for files to be written of: a `Surface` refuses some of them."""

    points: np.ndarray[Any, Any]
    triangles: np.ndarray[Any, Any]


def _holed(random: Random, surface: Shape) -> Shape:
    centre = surface.points[int(random.integers(len(surface.points)))]
    middle = surface.points[surface.triangles].mean(axis=1)
    kept = np.linalg.norm(middle - centre, axis=1) > float(random.uniform(3.0, 40.0))
    return replace(surface, triangles=surface.triangles[kept]) if kept.sum() > 3 else surface


def _dropped(random: Random, surface: Shape) -> Shape:
    kept = random.random(len(surface.triangles)) > float(choose(random, (0.01, 0.1, 0.5)))  # type: ignore[arg-type]
    kept[:4] = True
    return replace(surface, triangles=surface.triangles[kept])


def _flipped(random: Random, surface: Shape) -> Shape:
    rows = random.random(len(surface.triangles)) < float(choose(random, (1.1, 0.5, 0.05)))  # type: ignore[arg-type]
    cells = np.array(surface.triangles)
    cells[rows] = cells[rows][:, ::-1]
    return replace(surface, triangles=cells)


def _noisy(random: Random, surface: Shape) -> Shape:
    size = float(choose(random, (0.1, 1.0, 5.0, 30.0)))  # type: ignore[arg-type]
    return replace(surface, points=surface.points + random.normal(0.0, size, surface.points.shape))


def _scaled(random: Random, surface: Shape) -> Shape:
    factor = float(choose(random, (1e-3, 1e3, 0.1, 10.0, -1.0, 1e-30, 1e30, 0.0)))  # type: ignore[arg-type]
    return replace(surface, points=surface.points * factor)


def _moved(random: Random, surface: Shape) -> Shape:
    shift = random.normal(0.0, float(choose(random, (5.0, 50.0, 1e6))), 3)  # type: ignore[arg-type]
    return replace(surface, points=surface.points + shift)


def _turned(random: Random, surface: Shape) -> Shape:
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    return replace(surface, points=surface.points @ turn)


def _flat(random: Random, surface: Shape) -> Shape:
    factors = np.ones(3)
    factors[int(random.integers(3))] = float(choose(random, (0.0, 1e-6, 0.05)))  # type: ignore[arg-type]
    return replace(surface, points=surface.points * factors)


def _spiked(random: Random, surface: Shape) -> Shape:
    points = np.array(surface.points)
    rows = random.integers(0, len(points), int(random.integers(1, 6)))
    points[rows] *= float(choose(random, (3.0, 100.0, -2.0, 0.0)))  # type: ignore[arg-type]
    return replace(surface, points=points)


def _doubled(random: Random, surface: Shape) -> Shape:
    """Triangles given twice, or the surface twice, apart or not."""
    if random.random() < 0.5:
        rows = random.integers(0, len(surface.triangles), int(random.integers(1, 50)))
        return replace(surface, triangles=np.concatenate([surface.triangles, surface.triangles[rows]]))
    shift = float(choose(random, (0.0, 0.5, 200.0)))  # type: ignore[arg-type]
    points = np.concatenate([surface.points, surface.points + np.array([shift, 0.0, 0.0])])
    return replace(
        surface, points=points, triangles=np.concatenate([surface.triangles, surface.triangles + len(points) // 2])
    )


def _torn(random: Random, surface: Shape) -> Shape:
    """Every triangle with corners of its own, some of them apart from their neighbours'."""
    corners = surface.points[surface.triangles].reshape(-1, 3)
    corners = corners + random.normal(0.0, float(choose(random, (0.0, 1e-5, 0.3))), corners.shape)  # type: ignore[arg-type]
    return replace(surface, points=corners, triangles=np.arange(len(corners)).reshape(-1, 3))


def _few(random: Random, surface: Shape) -> Shape:
    return replace(surface, triangles=surface.triangles[: int(random.integers(1, 9))])


def _cut(random: Random, surface: Shape) -> Shape:
    """An open cup, cut at any height along any axis."""
    axis = int(random.integers(3))
    middle = surface.points[surface.triangles].mean(axis=1)[:, axis]
    kept = middle < np.quantile(middle, float(random.uniform(0.2, 0.95)))
    return replace(surface, triangles=surface.triangles[kept])


#: What may be done to a surface, by name.
SURFACES: dict[str, Callable[[Random, Shape], Shape]] = {
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
