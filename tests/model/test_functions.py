"""Functions made of sums and products against those of Python's own library, and what has to be exact."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from femprep.model import functions

pytestmark = pytest.mark.bytes

ULP = 2.0**-52
NUMBERS = st.floats(-1e4, 1e4)


@given(NUMBERS)
def test_sine_and_cosine(angle):
    sine, cosine = functions.sine_cosine(angle)
    assert abs(sine - math.sin(angle)) <= 2 * ULP
    assert abs(cosine - math.cos(angle)) <= 2 * ULP


@given(NUMBERS, NUMBERS)
def test_arc_tangent(y, x):
    expected = math.atan2(y, x) if (x, y) != (0.0, 0.0) else 0.0
    # Signed zeros: y = -0 beside a negative x is no other direction.
    if y == 0.0:
        expected = abs(expected)
    assert float(functions.arctan2(y, x)) == pytest.approx(expected, rel=4 * ULP, abs=1e-300)


@given(st.floats(-600.0, 600.0))
def test_exponential(x):
    assert float(functions.exponential(x)) == pytest.approx(math.exp(x), rel=3 * ULP)


@given(st.floats(1e-300, 1e300))
def test_logarithm(x):
    assert float(functions.logarithm(x)) == pytest.approx(math.log(x), rel=3 * ULP, abs=1e-300)


@given(st.floats(-30.0, 30.0))
def test_growth(x):
    assert float(functions.growth(x)) == pytest.approx(math.expm1(x), rel=8 * ULP, abs=1e-300)


def test_what_is_exact():
    assert functions.exponential(0.0) == 1.0
    assert functions.logarithm(1.0) == 0.0
    assert functions.growth(0.0) == 0.0
    assert functions.arctan2(0.0, 0.0) == 0.0
    assert [float(a) for a in functions.sine_cosine(0.0)] == [0.0, 1.0]
    assert functions.arctan2(1.0, 1.0) == np.pi / 4.0
