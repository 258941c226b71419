"""Percentiles by counting are those of sorted values, whatever the distribution."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from femprep.volume.quality.percentiles import percentiles

_SHARES = (0, 1, 5, 25, 50, 75, 95, 99, 100)


@pytest.mark.parametrize(
    "values",
    [
        np.random.default_rng(0).normal(size=50_001),
        np.random.default_rng(1).lognormal(0.0, 4.0, 5000),
        np.random.default_rng(2).integers(0, 5, 1000).astype(float),
        np.append(np.random.default_rng(3).normal(size=500), [1e300, -1e300]),
        np.full(7, -2.5),
    ],
    ids=["normal", "skewed", "few values", "far outliers", "equal"],
)
def test_percentiles_are_numpys(values: np.ndarray) -> None:
    assert percentiles(values, _SHARES) == pytest.approx(np.percentile(values, _SHARES).tolist(), rel=1e-13)


@settings(deadline=None)
@given(st.lists(st.floats(-1e150, 1e150), min_size=1, max_size=30))
def test_places_of_few_values(values: list[float]) -> None:
    found = percentiles(np.array(values), (0, 100))
    assert found == [min(values), max(values)]
