"""Notices: amounts in words."""

from __future__ import annotations

import pytest

from femprep.model import Notice
from femprep.model.notice import Unit


@pytest.mark.parametrize(
    ("amount", "unit", "words"),
    [(1, "voxels", "1 voxel"), (2, "voxels", "2 voxels"), (1, "elements", "1 element"), (1.0, "mm", "1.0 mm")],
)
def test_one_of_something_is_no_plural(amount: float, unit: Unit, words: str) -> None:
    assert Notice.of("left out", "{amount} left", amount=amount, unit=unit).what == f"{words} left"
