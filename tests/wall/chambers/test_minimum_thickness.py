"""Cavities that come too near each other or overlap: the later one gives way, or the error says where."""

from __future__ import annotations

import numpy as np
import pytest
from wall_shapes import Ellipsoid, template_surface

from femprep.errors import InputError, OptionError
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.search.intersection import self_intersections
from femprep.wall import keep_apart


def ball(x: float, name: str):
    return template_surface(Ellipsoid((20.0, 20.0, 30.0), np.array([x, 0.0, 0.0])), 600, name)


@pytest.mark.parametrize("x", [40.4, 39.0])
def test_the_later_cavity_gives_way(x):
    left, right = ball(0.0, "lv"), ball(x, "rv")
    apart, repaired = keep_apart({"lv": left, "rv": right}, least=1.5, most=8.0)
    assert apart["lv"] is left
    moved = apart["rv"]
    assert moved.shape is None
    finder = ClosestFinder(left.points, left.triangles)
    assert finder.signed(moved.points).min() >= 1.5 * 0.95
    assert ClosestFinder(moved.points, moved.triangles).signed(left.points).min() >= 1.5 * 0.95
    assert not len(self_intersections(moved.points, moved.triangles))
    (record,) = repaired
    assert record["between"] == ["lv", "rv"]
    assert abs(record["thickness_before_mm"] - (x - 40.0)) < 0.3
    assert 1.5 - (x - 40.0) - 0.4 < record["farthest_push_mm"] < 1.5 - (x - 40.0) + 0.6
    far = np.abs(right.points[:, 0] - x) < 5.0
    np.testing.assert_allclose(moved.points[far], right.points[far], atol=0.05)


def test_cavities_that_are_apart_stay_as_they_are():
    cavities = {"lv": ball(0.0, "lv"), "rv": ball(45.0, "rv")}
    apart, repaired = keep_apart(cavities, least=1.5, most=8.0)
    assert apart == cavities
    assert repaired == []


def test_too_much_overlap_is_refused_with_its_place():
    with pytest.raises(
        InputError, match=r"the cavities 'lv' and 'rv' are -1\d\.\d+ mm apart near \(.*maximum_push = 4"
    ):
        keep_apart({"lv": ball(0.0, "lv"), "rv": ball(28.0, "rv")}, least=1.0, most=4.0)


@pytest.mark.parametrize(("least", "most", "line"), [
    (-1.0, 8.0, "least is -1.0, expected a number at least 0"),
    (1.0, np.nan, "most is nan, expected a number at least 0"),
    (1.0, np.inf, "most is inf, expected a number at least 0"),
])  # fmt: skip
def test_limits_that_are_no_lengths_are_refused(least, most, line):
    with pytest.raises(OptionError, match=line):
        keep_apart({"lv": ball(0.0, "lv")}, least=least, most=most)
