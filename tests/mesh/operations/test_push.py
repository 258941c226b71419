"""A surface pushed away from a plane: far enough everywhere, along the way told, and no farther than need be."""

from __future__ import annotations

import numpy as np
import pyvista

from femprep.mesh.operations.push import Pushing, push

PUSHING = Pushing(rounds=20, reach=3, fade=0.8)


def sheet() -> tuple[np.ndarray, np.ndarray]:
    """A flat square of 20 mm, half a millimetre above z = 0, in triangles."""
    square = pyvista.Plane(i_size=20.0, j_size=20.0, i_resolution=20, j_resolution=20).triangulate()
    lifted = square.points.astype(float) + np.array([0.0, 0.0, 0.5])
    return lifted, square.faces.reshape(-1, 4)[:, 1:].astype(np.int64)


def test_what_lacks_is_pushed_and_its_neighbours_follow() -> None:
    points, triangles = sheet()
    start = points.copy()
    near = np.linalg.norm(points[:, :2], axis=1) < 2.5

    def lacking() -> tuple[np.ndarray, np.ndarray]:
        short = np.where(near, np.maximum(1.02 * 2.0 - points[:, 2], 0.0), 0.0)
        return short, np.tile([0.0, 0.0, 1.0], (len(points), 1))

    push(points, triangles, PUSHING, lacking, 0.04)
    assert np.all(points[near, 2] >= 2.0)
    assert points[:, 2].max() <= 2.04 + 1e-12
    moved = points[:, 2] - start[:, 2]
    away = np.linalg.norm(points[:, :2], axis=1)
    assert 0.0 < moved[(away > 3.2) & (away < 3.8)].min() < moved[near].min()
    assert not moved[away > 7.0].any()


def test_moves_are_held_and_nothing_is_moved_that_lacks_nothing() -> None:
    points, triangles = sheet()
    start = points.copy()
    along = np.tile([0.6, 0.0, 0.8], (len(points), 1))
    push(points, triangles, PUSHING, lambda: (np.full(len(points), 0.01), along), 0.02)
    np.testing.assert_array_equal(points, start)

    def lacking() -> tuple[np.ndarray, np.ndarray]:
        return np.maximum(1.0 - points[:, 2], 0.0), along

    push(points, triangles, PUSHING, lacking, 1e-6, held=lambda moves: moves * [0.0, 0.0, 1.0])
    np.testing.assert_array_equal(points[:, :2], start[:, :2])
    np.testing.assert_allclose(points[:, 2], 1.0, atol=2e-6)
