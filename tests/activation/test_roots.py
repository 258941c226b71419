"""Roots of bundle branches: high on the septum, or where they are given."""

from __future__ import annotations

import numpy as np
import pytest

from femprep.activation.roots import find_root
from femprep.anatomy import VentricularAxes
from femprep.errors import InputError

#: An endocardium 40 mm high and 15 mm wide, seen from its cavity; the septum lies at +x.
POINTS = np.array([[15.0, 0.0, 0.0], [15.0, 3.0, 40.0], [15.0, -3.0, 40.0], [-15.0, 3.0, 20.0], [-15.0, -3.0, 0.0]])
AXES = VentricularAxes(apex=np.zeros(3), base=np.array([0.0, 0.0, 45.0]), septal=np.array([1.0, 0.0, 0.0]))
TO_CAVITY, AWAY = np.array([[0, 2, 1]]), np.array([[0, 1, 2]])


def test_the_root_lies_high_on_the_septal_side() -> None:
    root = find_root(POINTS, TO_CAVITY, AXES, "lv", None)
    assert root.point[2] == 40.0
    np.testing.assert_allclose(root.direction, [0.0, 0.0, -1.0], atol=1e-12)
    assert root.trunk == pytest.approx(0.15 * 40.0)
    given = find_root(POINTS, TO_CAVITY, AXES, "lv", (16.0, 0.0, 1.0))
    np.testing.assert_array_equal(given.point, POINTS[0])
    assert given.trunk == root.trunk


def test_a_root_that_is_nowhere_near_is_refused() -> None:
    with pytest.raises(InputError, match=r"^root_lv is 100000, 0, 0, 99985 mm from the endocardium of the lv"):
        find_root(POINTS, TO_CAVITY, AXES, "lv", (100000.0, 0.0, 0.0))


def test_without_a_septal_side_the_root_has_to_be_given_and_is_taken() -> None:
    with pytest.raises(InputError, match="name the root \\(root_lv\\)"):
        find_root(POINTS, AWAY, AXES, "lv", None)
    root = find_root(POINTS, AWAY, AXES, "lv", (15.0, 3.0, 39.0))
    np.testing.assert_array_equal(root.point, POINTS[1])
    assert root.trunk == pytest.approx(0.15 * 40.0)
