"""VTK's filters on plain arrays: a ball's isosurface, smoothed and thinned."""

from __future__ import annotations

import numpy as np

from femprep.mesh.polygons import decimated, isosurface, taubin
from femprep.mesh.topology import euler_characteristic, is_closed, volume

_RADIUS = 9.3
_MIDDLE = 12.0


def ball(noise: float = 0.0) -> np.ndarray:
    """Signed distance from a sphere, positive inside, on a grid of 25 voxels a side."""
    index = np.indices((25, 25, 25)) - _MIDDLE
    rng = np.random.default_rng(3)
    return _RADIUS - np.linalg.norm(index, axis=0) + noise * rng.standard_normal((25, 25, 25))


def test_isosurface_of_a_ball_lies_on_the_sphere() -> None:
    points, cells = isosurface(ball(), 0.0)
    assert is_closed(cells)
    assert euler_characteristic(cells) == 2
    np.testing.assert_allclose(np.linalg.norm(points - _MIDDLE, axis=1), _RADIUS, atol=0.03)
    assert abs(volume(points, cells)) / (4.0 / 3.0 * np.pi * _RADIUS**3) > 0.98


def test_level_moves_the_surface() -> None:
    points, _ = isosurface(ball(), -1.5)
    np.testing.assert_allclose(np.linalg.norm(points - _MIDDLE, axis=1), _RADIUS + 1.5, atol=0.03)


def test_nothing_where_the_level_is_not_passed() -> None:
    points, cells = isosurface(ball(), 100.0)
    assert points.shape == (0, 3)
    assert cells.shape == (0, 3)


def test_taubin_smooths_without_shrinking() -> None:
    points, cells = isosurface(ball(noise=0.15), 0.0)
    smooth = taubin(points, cells, 20, 0.05)
    rough, even = (np.std(np.linalg.norm(p - _MIDDLE, axis=1)) for p in (points, smooth))
    assert even < 0.6 * rough
    assert abs(volume(smooth, cells) / volume(points, cells) - 1.0) < 0.01


def test_decimated_keeps_volume_and_topology() -> None:
    points, cells = isosurface(ball(), 0.0)
    fewer, triangles = decimated(points, cells, 0.75)
    assert is_closed(triangles)
    assert euler_characteristic(triangles) == 2
    assert abs(len(triangles) / (0.25 * len(cells)) - 1.0) < 0.02
    assert abs(volume(fewer, triangles) / volume(points, cells) - 1.0) < 0.005
