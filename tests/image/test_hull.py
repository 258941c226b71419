"""How much of its convex hull a body fills."""

import numpy as np
import pytest

from femprep.image import Grid, LabelObject
from femprep.image.hull import hull_share


def body(mask, spacing=(1.4, 1.4, 8.0)):
    mask = np.pad(mask, 2)
    return LabelObject(mask, Grid(mask.shape, spacing, np.zeros(3), np.eye(3)), "body", {})


def test_a_box_fills_its_hull():
    mask = np.zeros((8, 9, 6), bool)
    mask[2:6, 1:8, 1:4] = True
    assert hull_share(body(mask)) == pytest.approx(1.0)


def test_a_notch_leaves_half_of_its_hull_open():
    mask = np.zeros((8, 8, 3), bool)
    mask[1:5, 1:5, 1] = True
    mask[3:5, 3:5, 1] = False  # the hull of an L of 12 squares cuts off half of the 4 missing
    assert hull_share(body(mask)) == pytest.approx(12.0 / 14.0)
    assert hull_share(body(mask, (1.0, 1.0, 1.0))) == pytest.approx(12.0 / 14.0)
