"""Patches against a surface known exactly: fourth order, projection onto rims, independence of the start."""

from __future__ import annotations

import numpy as np
import pytest

from femprep.mesh.patches import PatchSurface
from femprep.template import charge_template

AXES = np.array([25.0, 22.0, 45.0])


def _ellipsoid(vertices: int) -> PatchSurface:
    template = charge_template(vertices)
    return PatchSurface(template.directions * AXES, template.cells)


def _height(points: np.ndarray) -> np.ndarray:
    """Distance from the ellipsoid to first order, which is exact near it."""
    scaled = points / AXES
    return (np.einsum("ij,ij->i", scaled, scaled) - 1.0) / (2.0 * np.linalg.norm(scaled / AXES, axis=1))


@pytest.fixture(scope="module")
def queries() -> np.ndarray:
    shift = 1.0 + 0.01 * np.random.default_rng(3).standard_normal(500)
    return charge_template(500).directions * AXES * shift[:, None]


def test_projection_is_of_fourth_order(queries):
    errors = [np.abs(_height(_ellipsoid(v).project(queries)[0])).max() for v in (200, 800)]
    # Four times the vertices halve the edge length: 2^4.
    assert errors[0] / errors[1] > 9.0
    assert errors[1] < 0.01


def test_vertices_stay_and_normals_are_the_surface_s():
    surface = _ellipsoid(800)
    points, normals = surface.project(surface.points)
    assert np.abs(points - surface.points).max() < 5e-3
    exact = surface.points / AXES**2
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    assert np.degrees(np.arccos(np.clip((exact * normals).sum(axis=1), -1, 1))).max() < 0.5


def test_a_start_nearby_gives_the_same_foot(queries):
    surface = _ellipsoid(400)
    start = surface.nearest(queries)
    neighbour = surface.arrays[4][start, 0]
    assert np.array_equal(surface.project(queries)[0], surface.project(queries, neighbour)[0])


def test_rim_points_lie_in_the_plane_and_on_the_surface(queries):
    surface = _ellipsoid(800)
    low = queries[np.abs(queries[:, 2] - 8.0) < 3.0]
    plane = np.array([[0.0, 0.0, 1.0, 8.0]])
    points, _, _ = surface.settle(low, None, np.ones(len(low)), plane)
    assert len(low) > 10
    assert np.abs(points[:, 2] - 8.0).max() < 1e-12
    assert np.abs(_height(points)).max() < 0.01
