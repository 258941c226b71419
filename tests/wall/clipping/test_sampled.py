from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from wall_shapes import Ellipsoid

from femprep.mesh.tangents import tangents
from femprep.template import charge_template
from femprep.wall.clipping.sampled import SampledMap


def bumpy(directions) -> np.ndarray:
    d = np.asarray(directions)
    radius = 30.0 + 4.0 * np.sin(3 * d[:, 0]) * np.cos(2 * d[:, 1]) + 3.0 * d[:, 2] ** 3
    return radius[:, None] * d


def random_directions(count: int) -> np.ndarray:
    d = np.random.default_rng(1).normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def test_it_passes_through_its_samples():
    directions = charge_template(300).directions
    sampled = SampledMap(directions, bumpy(directions))
    assert np.abs(sampled(directions) - bumpy(directions)).max() < 1e-9


def test_the_error_falls_with_the_third_power_of_the_sample_distance():
    queries = random_directions(4000)
    errors = []
    for vertices in (300, 1200, 4800):  # halves the distance each time
        directions = charge_template(vertices).directions
        errors.append(np.abs(SampledMap(directions, bumpy(directions))(queries) - bumpy(queries)).max())
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert rates.min() > 2.5
    assert errors[1] < 0.03  # mm, at the spacing the surfaces have


def test_a_step_displaces_points_along_the_surface():
    directions = charge_template(1200).directions
    shape = Ellipsoid((20.0, 25.0, 40.0))
    sampled = SampledMap(directions, shape(directions))
    start = random_directions(200)
    tangent = sampled.tangents(start)
    wanted = 0.01 * tangent[:, 0] / np.linalg.norm(tangent[:, 0], axis=1, keepdims=True)
    moved = sampled(sampled.step(start, wanted)) - sampled(start)
    assert np.linalg.norm(moved - wanted, axis=1).max() < 0.05 * 0.01


def test_a_step_across_the_surface_goes_nowhere():
    directions = charge_template(600).directions
    sampled = SampledMap(directions, 30.0 * directions)
    slid = 30.0 * np.linalg.norm(sampled.step(directions, 5.0 * directions) - directions, axis=1)
    assert slid.max() < 0.01 * 5.0


@settings(deadline=None, max_examples=40)
@given(st.lists(st.floats(-1, 1), min_size=3, max_size=3).filter(lambda v: np.linalg.norm(v) > 0.1))
def test_frames_are_right_handed(vector):
    d = np.array([vector]) / np.linalg.norm(vector)
    frame = tangents(d)[0]
    assert np.linalg.det(np.stack([frame[0], frame[1], d[0]])) == pytest.approx(1.0)
