"""Where surfaces meet the level 0 of a value at their vertices, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from surface_shapes import sphere

from femprep.mesh.level_segments import level_segments


def tube(n: int, radius: float, height: float) -> tuple[np.ndarray, np.ndarray]:
    """Open side of a prism with n corners."""
    angle = 2 * np.pi * np.arange(n) / n
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    points = np.concatenate([np.c_[ring, np.zeros(n)], np.c_[ring, np.full(n, height)]])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    return points, np.concatenate([np.c_[i, j, j + n], np.c_[i, j + n, i + n]])


def test_cut_of_a_tube_is_its_ring() -> None:
    points, triangles = tube(12, 3.0, 5.0)
    crossings, segments = level_segments(points, triangles, points[:, 2] - 2.0)
    assert len(crossings) == len(segments) == 24
    assert_allclose(crossings[:, 2], 2.0, atol=1e-12)
    length = np.linalg.norm(crossings[segments[:, 1]] - crossings[segments[:, 0]], axis=1).sum()
    assert_allclose(length, 12 * 2 * 3.0 * np.sin(np.pi / 12), rtol=1e-12)


def test_cut_beside_a_surface_is_empty() -> None:
    points, triangles = tube(12, 3.0, 5.0)
    crossings, segments = level_segments(points, triangles, points[:, 2] + 1.0)
    assert crossings.shape == (0, 3)
    assert segments.shape == (0, 2)


@pytest.mark.parametrize("level", [0.0, 0.3, 7.0])
def test_segments_of_a_closed_surface_run_on_from_each_other(level: float) -> None:
    ball = sphere(20.0)  # at 0 through whole rings of vertices
    crossings, segments = level_segments(ball.points, ball.cells, ball.points[:, 2] - level)
    assert_allclose(crossings[:, 2], level, atol=1e-12)
    assert_array_equal(np.sort(segments[:, 0]), np.arange(len(crossings)))
    assert_array_equal(np.sort(segments[:, 1]), np.arange(len(crossings)))


def test_other_vertices_of_the_mesh_do_not_matter() -> None:
    points, triangles = tube(12, 3.0, 5.0)
    more = np.concatenate([points, np.full((3, 3), np.nan)])
    for one, other in zip(
        level_segments(points, triangles, points[:, 2] - 2.0), level_segments(more, triangles, more[:, 2] - 2.0)
    ):
        assert_array_equal(one, other)
