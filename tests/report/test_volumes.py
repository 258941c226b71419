"""Enclosed volumes against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from femprep.mesh.topology import enclosed_volume
from femprep.model import Plane, Surface
from femprep.report.volumes import volume_below


def tube(n: int, radius: float, height: float) -> tuple[np.ndarray, np.ndarray]:
    """Open side of a prism with n corners."""
    angle = 2 * np.pi * np.arange(n) / n
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    points = np.concatenate([np.c_[ring, np.zeros(n)], np.c_[ring, np.full(n, height)]])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    return points, np.concatenate([np.c_[i, j, j + n], np.c_[i, j + n, i + n]])


@pytest.mark.parametrize("shift", [0.0, 1000.0])
def test_two_open_rims_are_closed_flat(shift: float) -> None:
    points, triangles = tube(7, 3.0, 5.0)
    exact = 7 * 0.5 * 3.0**2 * np.sin(2 * np.pi / 7) * 5.0
    assert_allclose(enclosed_volume(points + shift, triangles), exact, rtol=1e-12)
    assert_allclose(enclosed_volume(points + shift, triangles[:, ::-1]), -exact, rtol=1e-12)


def test_closed_surface_needs_no_fan() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    triangles = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    assert_allclose(enclosed_volume(points, triangles), 1 / 6, rtol=1e-14)


@pytest.mark.parametrize("height", [-0.5, 0.0, 0.3, 0.9, 1.0, 2.0])
def test_a_given_surface_is_cut_at_the_base(height: float) -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    tetra = Surface(corners + 7.0, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]))
    base = Plane([9.0, -3.0, 7.0 + height], [0.0, 0.0, 1.0])
    exact = (1.0 - (1.0 - np.clip(height, 0.0, 1.0)) ** 3) / 6.0
    assert_allclose(volume_below(tetra, base), exact, rtol=1e-12, atol=1e-14)
    assert_allclose(volume_below(tetra, None), 1.0 / 6.0, rtol=1e-12)
