"""What the epicardium ought to follow beside a right ventricle whose wall is assumed."""

from __future__ import annotations

import numpy as np
import pytest

from femprep.wall.anatomies import _rounded
from femprep.wall.chambers.envelope import _joined


@pytest.mark.parametrize(("blend", "lift"), [(9.0, 0.47), (9.0, 0.17), (3.0, 0.1)])
def test_the_joint_lifts_it_by_no_more_than_that_from_there_on(blend, lift):
    away = _rounded(blend, lift)
    assert 0.0 < away < blend
    none = np.zeros((1, 3))
    value, _ = _joined((np.zeros(1), none), (np.array([away]), none), blend)
    assert value[0] == pytest.approx(-lift)


def test_where_the_joint_lifts_it_by_less_everywhere_the_whole_outline_counts():
    assert _rounded(4.0, 1.0) == 0.0
