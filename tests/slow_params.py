"""Parameters of a test in, the same out, those marked slow that the quick run leaves to continuous integration."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def slow_but(quick: Iterable[Any], values: Iterable[Any]) -> list[Any]:
    """All values; slow are those that are not among the quick ones."""
    kept = list(quick)
    rows = [value if isinstance(value, tuple) else (value,) for value in values]
    return [
        pytest.param(*row) if row in kept or row[0] in kept else pytest.param(*row, marks=pytest.mark.slow)
        for row in rows
    ]
