"""Percentiles by weight are those of values repeated as often as they weigh."""

from __future__ import annotations

import numpy as np
import pytest

from femprep.mesh.measures.weighted import weighted_percentile


@pytest.mark.parametrize("percent", [5.0, 50.0, 95.0, 100.0])
def test_whole_weights_count_values_so_often(percent: float) -> None:
    rng = np.random.default_rng(3)
    values, weight = rng.normal(size=40), rng.integers(0, 5, 40).astype(float)
    every = np.repeat(values, weight.astype(int))
    assert weighted_percentile(values, weight, percent) == np.percentile(every, percent, method="inverted_cdf")


def test_a_value_that_ends_just_at_a_share_is_taken() -> None:
    values, weight = np.array([3.0, 1.0, 2.0]), np.array([1.0, 2.0, 1.0])
    assert [weighted_percentile(values, weight, percent) for percent in (50.0, 75.0, 100.0)] == [1.0, 2.0, 3.0]
    assert weighted_percentile(np.arange(100.0), np.ones(100), 95.0) == 94.0
