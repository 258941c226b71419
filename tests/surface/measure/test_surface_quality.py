from __future__ import annotations

import numpy as np
import pytest
from surface_shapes import box, cube_of_quads, moved, sphere

from femprep.model import Surface
from femprep.surface.measure.quality import surface_quality


def test_a_cube_of_triangles():
    found = surface_quality(box())
    # Half squares: sides 1, 1, sqrt 2 times 2.
    p = 1.0 + np.sqrt(0.5)
    expected = 8 * (p - 1) ** 2 * (p - np.sqrt(2)) / np.sqrt(2)
    assert found.q.mean == pytest.approx(expected)
    assert found.q.std == pytest.approx(0.0, abs=1e-12)
    assert found.smallest_angle == pytest.approx(45.0)
    assert found.largest_angle == pytest.approx(90.0)
    assert found.largest_fold == pytest.approx(90.0)
    assert found.area == pytest.approx(24.0)
    assert found.volume == pytest.approx(8.0)
    assert found.edge_length.max == pytest.approx(2.0 * np.sqrt(2.0))
    assert found.cell_type == "triangle"
    assert found.scaled_jacobian is None
    assert found.sound


def test_a_cube_of_quadrilaterals():
    found = surface_quality(cube_of_quads())
    assert found.cell_type == "quad"
    assert found.cells == 6
    assert found.scaled_jacobian is not None
    assert found.scaled_jacobian.min == pytest.approx(1.0)
    assert found.smallest_angle == pytest.approx(90.0)
    assert found.volume == pytest.approx(1.0)
    assert found.sound


def test_measures_do_not_change_under_a_rigid_motion():
    here, there = surface_quality(sphere(subdivisions=2)), surface_quality(moved(sphere(subdivisions=2), 3))
    assert there.q.min == pytest.approx(here.q.min, rel=1e-9)
    assert there.volume == pytest.approx(here.volume, rel=1e-9)
    assert there.sound


def test_what_is_not_sound_says_why():
    ball = sphere(subdivisions=2)
    holed = surface_quality(Surface(ball.points, ball.cells[1:]))
    assert (holed.closed, holed.volume, holed.sound) == (False, None, False)
    inward = surface_quality(Surface(ball.points, ball.cells[:, ::-1]))
    assert (inward.closed, inward.outward, inward.sound) == (True, False, False)
    mixed = np.array(ball.cells)
    mixed[3] = mixed[3, ::-1]
    flipped = surface_quality(Surface(ball.points, mixed))
    assert (flipped.consistently_wound, flipped.largest_fold, flipped.sound) == (False, None, False)
    points = np.array(ball.points)
    points[5] *= -1.1
    crossed = surface_quality(Surface(points, ball.cells))
    assert crossed.closed
    assert crossed.self_intersections > 0
    assert not crossed.sound
    two = Surface(np.r_[ball.points, ball.points + 100.0], np.r_[ball.cells, ball.cells + len(ball.points)])
    assert surface_quality(two).pieces == 2
    assert not surface_quality(two).sound


def test_record_is_json():
    flat = Surface([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    found = surface_quality(flat)
    assert found.largest_aspect_ratio is None
    assert '"largest_aspect_ratio":null' in found.model_dump_json()
