from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from femprep.mesh.measures.triangles import (
    angles,
    areas,
    aspect_ratio,
    edge_lengths,
    normals,
    scaled_jacobian,
    triangle_quality,
    vertex_normals,
)

ONE = np.array([[0, 1, 2]])
EQUILATERAL = np.array([[0.0, 0, 0], [2, 0, 0], [1, np.sqrt(3.0), 0]])


def test_equilateral_triangle():
    assert triangle_quality(EQUILATERAL, ONE)[0] == pytest.approx(1.0, abs=1e-15)
    assert aspect_ratio(EQUILATERAL, ONE)[0] == pytest.approx(1.0)
    np.testing.assert_allclose(angles(EQUILATERAL, ONE), np.pi / 3)
    assert areas(EQUILATERAL, ONE)[0] == pytest.approx(np.sqrt(3.0))
    np.testing.assert_allclose(normals(EQUILATERAL, ONE), [[0, 0, 1]])


def test_right_triangle_has_the_quality_of_the_formula():
    # Sides 3, 4, 5: p = 6, Q = 8 * 3 * 2 * 1 / 60.
    points = np.array([[0.0, 0, 0], [3, 0, 0], [0, 4, 0]])
    assert triangle_quality(points, ONE)[0] == pytest.approx(0.8)
    np.testing.assert_allclose(edge_lengths(points, ONE), [[3, 5, 4]])


def test_triangles_without_area():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 0, 0]])
    cells = np.array([[0, 1, 2], [0, 3, 1], [0, 3, 3]])
    np.testing.assert_array_equal(triangle_quality(points, cells), 0.0)
    assert np.isinf(aspect_ratio(points, cells)).all()
    np.testing.assert_array_equal(normals(points, cells), 0.0)


def test_a_needle_keeps_its_quality_to_all_digits():
    # Isosceles with a short base h: Q -> 2 h for h -> 0 in units of the long side.
    h = 1e-7
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, h, 0]])
    a, b, c = 1.0, h, np.hypot(1.0, h)
    exact = 4.0 * h * h / (a * b * c * (a + b + c))
    assert triangle_quality(points, ONE)[0] == pytest.approx(exact, rel=1e-12)


@settings(deadline=None, max_examples=50)
@given(st.integers(0, 2**32 - 1), st.floats(0.01, 100.0))
def test_measures_do_not_depend_on_place_size_or_corner_order(seed, scale):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(30, 3))
    cells = np.arange(30).reshape(10, 3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    moved = scale * points @ turn.T + rng.normal(size=3)
    q = triangle_quality(points, cells)
    assert np.all((q >= 0) & (q <= 1))
    np.testing.assert_allclose(triangle_quality(moved, np.roll(cells, 1, axis=1)), q, rtol=1e-7)
    np.testing.assert_allclose(aspect_ratio(moved, cells[:, ::-1]), aspect_ratio(points, cells), rtol=1e-7)
    np.testing.assert_allclose(angles(points, cells).sum(axis=1), np.pi)


def test_vertex_normals_of_a_sphere_and_a_cube():
    ball = trimesh.creation.icosphere(subdivisions=3)
    np.testing.assert_allclose(vertex_normals(ball.vertices, ball.faces), ball.vertices, atol=5e-3)
    box = trimesh.creation.box()
    expected = np.sign(box.vertices) / np.sqrt(3.0)
    np.testing.assert_allclose(vertex_normals(box.vertices, box.faces), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("quad", "expected"),
    [
        ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], 1.0),
        ([[0, 0, 0], [3, 0, 0], [3, 1, 0], [0, 1, 0]], 1.0),
        ([[0, 0, 0], [1, 0, 0], [1.5, np.sqrt(0.75), 0], [0.5, np.sqrt(0.75), 0]], np.sin(np.pi / 3)),
        ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0.5, 0.5, 0]], 0.0),  # one corner straight: a triangle
    ],
)
def test_scaled_jacobian(quad, expected):
    assert scaled_jacobian(np.array(quad, dtype=float), [[0, 1, 2, 3]])[0] == pytest.approx(expected, abs=1e-12)


def test_scaled_jacobian_is_negative_for_a_dent_and_a_bow_tie():
    dent = np.array([[0.0, 0, 0], [1, 0, 0], [0.2, 0.2, 0], [0, 1, 0]])
    assert scaled_jacobian(dent, [[0, 1, 2, 3]])[0] < -0.5
    tie = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 2, 0]])
    assert scaled_jacobian(tie, [[0, 1, 2, 3]])[0] < 0
