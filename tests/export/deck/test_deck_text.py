"""Numbers as text: within the field width, and the same number when read back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from femprep.export.deck import text as deck_text
from femprep.export.deck.text import FIELD, lines, number, rows, wrapped


@settings(deadline=None, max_examples=500)
@given(st.floats(-1e4, 1e4))
def test_coordinates_fit_and_come_back(value: float) -> None:
    text = number(value)
    assert len(text) <= FIELD
    assert abs(float(text) - value) <= (0.0 if abs(value) >= 0.01 else 1e-15)


@settings(deadline=None, max_examples=500)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_any_float_fits_with_thirteen_digits(value: float) -> None:
    text = number(value)
    assert len(text) <= FIELD
    assert float(text) == pytest.approx(value, rel=1e-12, abs=1e-300)


def test_rows_put_columns_side_by_side() -> None:
    assert rows([1, 2], np.array([[0.5, 1.0], [2.0, -3.25]])) == "1, 0.5, 1.0\n2, 2.0, -3.25\n"


@settings(deadline=None)
@given(st.lists(st.tuples(st.floats(allow_nan=False), st.floats(-0.2, 0.2)), min_size=1, max_size=9))
def test_rows_of_floats_are_their_numbers(values: list[tuple[float, float]]) -> None:
    table = np.array(values)
    assert rows(table, separator=" ") == "".join(f"{number(x)} {number(y)}\n" for x, y in values)
    assert rows(table, width=None) == "".join(f"{x!r}, {y!r}\n" for x, y in values)


@settings(deadline=None)
@given(st.lists(st.integers(-(2**63), 2**63 - 1), max_size=40), st.integers(1, 7))
def test_whole_numbers_are_written_as_python_does(values: list[int], per_line: int) -> None:
    lines = [",".join(map(str, values[i : i + per_line])) for i in range(0, len(values), per_line)]
    assert wrapped(np.array(values, dtype=np.int64), per_line, ",", ";") == ";\n".join(lines) + "\n" * bool(lines)
    assert rows(np.array(values, dtype=np.int64), separator=",") == "".join(f"{v}\n" for v in values)


def test_wrapped_lines() -> None:
    assert wrapped([1, 2, 3], 2) == "1, 2\n3\n"
    assert wrapped([], 2) == ""


def test_lines_come_some_at_a_time_and_are_the_same(monkeypatch) -> None:
    monkeypatch.setattr(deck_text, "_ROWS", 4)
    whole, points = np.arange(30).reshape(10, 3), np.linspace(0.0, 1.0, 10)
    found = list(lines(whole, points, width=None))
    assert len(found) == 3
    assert "".join(found) == rows(whole, points, width=None)
    assert "".join(lines(whole, separator=" ", before="Tt ")) == "".join(f"Tt {a} {b} {c}\n" for a, b, c in whole)
    assert list(lines(np.empty((0, 3)))) == []
