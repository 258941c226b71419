"""Frames: orthonormal whatever goes in, quaternions there and back, the shortest way between frames."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from femprep.anatomy.frames import _matrices, _quaternions, bislerp, make_frames, rotate

EYE = np.eye(3)
HALF_TURNS = [EYE, np.diag([1.0, -1, -1]), np.diag([-1.0, 1, -1]), np.diag([-1.0, -1, 1])]


def _random_frames(seed: int, n: int = 50) -> np.ndarray:
    q = np.random.default_rng(seed).normal(size=(n, 4))
    return _matrices(q / np.linalg.norm(q, axis=1, keepdims=True))


def _orthonormal(frames: np.ndarray) -> float:
    return float(np.abs(np.einsum("nij,nik->njk", frames, frames) - EYE).max())


@settings(deadline=None, max_examples=100)
@example([0.0, 0.0, 2.6e-161, 0.0, 0.0, 0.0], "longitudinal")
@given(st.lists(st.floats(-1e3, 1e3), min_size=6, max_size=6), st.sampled_from(["transmural", "longitudinal"]))
def test_frames_are_right_handed_and_orthonormal_for_any_vectors(values, keep):
    v = np.array(values).reshape(2, 1, 3)
    frames, _ = make_frames(v[0], v[1], keep=keep)
    assert _orthonormal(frames) < 1e-12
    assert np.linalg.det(frames) == pytest.approx(1.0)


def test_frame_keeps_the_vector_it_is_told_to_keep():
    up, out = np.array([[0.1, 0.2, 1.0]]), np.array([[1.0, 0.3, 0.2]])
    assert make_frames(up, out)[0][0, :, 2] == pytest.approx(out[0] / np.linalg.norm(out))
    assert make_frames(up, out, keep="longitudinal")[0][0, :, 1] == pytest.approx(up[0] / np.linalg.norm(up))


def test_parallel_and_zero_vectors_are_counted_as_degenerate():
    up = np.array([[0.0, 0, 1], [0, 0, 0], [0, 0, 1], [0, 0, 0]])
    out = np.array([[0.0, 0, 2], [1, 0, 0], [1, 0, 0], [0, 0, 0]])
    frames, weak = make_frames(up, out)
    assert weak.tolist() == [True, True, False, True]
    assert _orthonormal(frames) < 1e-12


def test_circumferential_axis_points_right_seen_from_outside_with_the_base_up():
    frames, _ = make_frames(np.array([[0.0, 0, 1]]), np.array([[1.0, 0, 0]]))
    # Seen from +x towards the wall with z up, the right-hand side is +y.
    assert frames[0, :, 0].tolist() == [0.0, 1.0, 0.0]
    up_right = rotate(frames, np.array([30.0]), np.array([0.0]))[0]
    assert up_right[:, 0] == pytest.approx([0.0, np.cos(np.pi / 6), 0.5])
    assert up_right[:, 1] == pytest.approx([1.0, 0.0, 0.0])  # sheet angle 0: straight through the wall


@given(st.floats(-90, 90), st.floats(-180, 180))
def test_rotated_triads_are_right_handed_orthonormal_and_have_their_angles(helix, sheet):
    frames = _random_frames(3)
    triads = rotate(frames, np.full(50, helix), np.full(50, sheet))
    assert _orthonormal(triads) < 1e-12
    assert np.linalg.det(triads) == pytest.approx(1.0)
    assert np.sum(triads[:, :, 0] * frames[:, :, 1], axis=1) == pytest.approx(np.sin(np.radians(helix)), abs=1e-12)
    assert np.sum(triads[:, :, 1] * frames[:, :, 2], axis=1) == pytest.approx(np.cos(np.radians(sheet)), abs=1e-12)


def test_quaternions_stand_for_their_matrices_in_all_four_cases():
    frames = np.concatenate([_random_frames(4), HALF_TURNS])
    assert _matrices(_quaternions(frames)) == pytest.approx(frames, abs=1e-14)


def test_bislerp_has_its_ends_up_to_half_turns():
    a, b = _random_frames(5), _random_frames(6)
    start, signs = bislerp(a, b, np.zeros(50))
    assert start == pytest.approx(a * signs[:, None, :], abs=1e-12)
    assert signs.prod(axis=1) == pytest.approx(1.0)
    assert bislerp(a, b, np.ones(50))[0] == pytest.approx(b, abs=1e-12)
    assert set(map(tuple, signs)) == {(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)}


def test_bislerp_is_never_further_apart_than_a_half_turn_can_bring_it():
    a, b = _random_frames(7, 400), _random_frames(8, 400)
    start, _ = bislerp(a, b, np.zeros(400))
    trace = np.einsum("nij,nij->n", start, b)
    for half in HALF_TURNS[1:]:
        assert (trace >= np.einsum("nij,nij->n", a @ half, b) - 1e-9).all()


def test_bislerp_of_a_frame_with_itself_or_its_half_turn_stays():
    a = _random_frames(9)
    for half in HALF_TURNS:
        middle, signs = bislerp(a, a @ half, np.full(50, 0.3))
        assert middle == pytest.approx(a @ half, abs=1e-12)
        assert signs == pytest.approx(np.tile(np.diag(half), (50, 1)))


def test_bislerp_turns_at_a_steady_rate():
    angle = 40.0
    a = np.tile(EYE, (5, 1, 1))
    b = rotate(a, np.full(5, angle), np.full(5, 90.0))  # sheet 90: columns fibre, across, outward
    middle, _ = bislerp(a, b, np.linspace(0, 1, 5))
    turned = np.degrees(np.arctan2(middle[:, 1, 0], middle[:, 0, 0]))
    assert turned == pytest.approx(np.linspace(0, angle, 5))
