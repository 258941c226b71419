"""Pieces, tunnels and voids of bodies whose topology is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.extra.numpy import arrays

from femprep.image.topology import euler_characteristic, label_pieces, label_voids, topology


def ball(n: int = 11, radius: float = 4.0) -> np.ndarray:
    x = np.arange(n) - n // 2
    return sum(a * a for a in np.meshgrid(x, x, x)) <= radius**2


def torus(n: int = 21) -> np.ndarray:
    x, y, z = np.meshgrid(*[np.arange(n) - n // 2] * 3)
    return (np.hypot(x, y) - 6.0) ** 2 + z**2 <= 2.5**2


def counts(mask):
    found = topology(mask)
    return found.pieces, found.tunnels, found.voids


def test_known_bodies():
    hollow = ball(15, 6.0)
    hollow[7, 7, 7] = False
    assert counts(ball()) == (1, 0, 0)
    assert counts(torus()) == (1, 1, 0)
    assert counts(hollow) == (1, 0, 1)
    assert counts(np.concatenate([torus(), torus()])) == (2, 2, 0)


def test_nothing_has_nothing():
    assert counts(np.zeros((3, 3, 3), dtype=bool)) == (0, 0, 0)


def test_two_torus_has_two_tunnels():
    plate = np.ones((3, 9, 5), dtype=bool)
    plate[:, 2, 2] = plate[:, 6, 2] = False
    assert counts(plate) == (1, 2, 0)


def test_voxels_that_share_a_corner_are_one_piece():
    pair = np.zeros((2, 2, 2), dtype=bool)
    pair[0, 0, 0] = pair[1, 1, 1] = True
    assert counts(pair) == (1, 0, 0)


def test_a_void_does_not_leak_through_edges():
    # The background is 6-connected: a cavity whose only way out is across an edge is a void.
    box = np.ones((4, 4, 4), dtype=bool)
    box[1, 1, 1] = box[1, 2, 2] = False
    box[0, 2, 2] = False
    assert counts(box) == (1, 0, 1)


def test_pieces_come_largest_first_and_equal_ones_in_array_order():
    mask = np.zeros((20, 3, 3), dtype=bool)
    mask[1:3, 1, 1] = mask[5:9, 1, 1] = mask[11:13, 1, 1] = True
    pieces, sizes = label_pieces(mask)
    assert sizes.tolist() == [4, 2, 2]
    assert [int(pieces[i, 1, 1]) for i in (1, 5, 11)] == [2, 1, 3]


def test_void_labels_leave_out_what_reaches_the_border():
    mask = np.zeros((7, 7, 7), dtype=bool)
    mask[1:6, 1:6, 1:6] = True
    mask[3, 3, 3] = False
    voids, sizes = label_voids(mask)
    assert sizes.tolist() == [1]
    assert voids[3, 3, 3] == 1
    assert voids[0, 0, 0] == 0


@settings(deadline=None, max_examples=60)
@given(arrays(bool, (4, 5, 4)))
def test_euler_characteristic_is_additive_and_symmetric(mask):
    value = euler_characteristic(mask)
    assert euler_characteristic(mask.transpose(2, 0, 1)) == value
    assert euler_characteristic(mask[::-1]) == value
    whole = topology(mask)
    assert whole.euler == value
    assert whole.tunnels >= 0


@pytest.mark.parametrize("pad", [0, 1, 3])
def test_euler_characteristic_does_not_depend_on_padding(pad):
    assert euler_characteristic(np.pad(torus(), pad)) == 0
