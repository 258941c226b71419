"""Where the surface passes between slices: the height of a cone's and of a ball's, and what the ends say."""

from __future__ import annotations

import numpy as np
import pytest

from femprep.surface.estimate.crossings import crossings, slice_distances

PIXEL, STEP = 0.5, 4.0


def discs(radii: list[float]) -> np.ndarray:
    """Slices of a body of revolution."""
    side = (np.arange(121) - 60) * PIXEL
    r = np.hypot(*np.meshgrid(side, side, indexing="ij"))
    return np.stack([r < radius for radius in radii])


def found(stack: np.ndarray, number: int, side: int) -> tuple[np.ndarray, np.ndarray]:
    """Distances from the axis at which the label changes between two slices, mm, and the shares found there."""
    pixels = np.argwhere(stack[number] & ~stack[number + side]).T
    voxel = np.stack([np.full(pixels.shape[1], number), *pixels])
    share = crossings(slice_distances(stack, (PIXEL, PIXEL)), voxel, np.full(pixels.shape[1], side))
    return np.hypot(*((pixels - 60) * PIXEL)), share


def test_distance_is_signed_and_unknown_without_object() -> None:
    distance = slice_distances(discs([0.0, 10.0]), (PIXEL, PIXEL))
    assert np.isnan(distance[0]).all()
    assert distance[1, 60, 60] == pytest.approx(10.0, abs=PIXEL)
    assert distance[1, 60, 100] == pytest.approx(-10.0, abs=PIXEL)


@pytest.mark.parametrize("side", [1, -1])
def test_cone_is_straight(side: int) -> None:
    radii = [24.0, 20.0, 16.0, 12.0, 8.0]
    stack = discs(radii[::side])
    r, share = found(stack, 2, side)
    np.testing.assert_allclose(share, (16.0 - r) / 4.0, atol=0.15)


def test_ball_is_round_rather_than_straight() -> None:
    z = STEP * np.arange(-6, 7)
    radii = np.sqrt(np.maximum(26.0**2 - z**2, 0.0))
    stack = discs(list(radii))
    # Between 16 and 20 mm of 26: outlines 20.5 and 16.6.
    r, share = found(stack, 10, 1)
    true = np.sqrt(26.0**2 - r**2) / STEP - 4.0
    straight = (radii[10] - r) / (radii[10] - radii[11])
    assert np.abs(share - true).mean() < 0.7 * np.abs(straight - true).mean()


def test_nothing_is_known_beyond_the_ends() -> None:
    stack = discs([0.0, 10.0, 10.0, 0.0])
    assert np.all(found(stack, 2, 1)[1] == 0.5)
    # Two slices alone: straight.
    r, share = found(discs([0.0, 20.0, 10.0, 0.0]), 1, 1)
    np.testing.assert_allclose(share, (20.0 - r) / 10.0, atol=0.1)
