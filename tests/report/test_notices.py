"""What was repaired, assumed or extrapolated is gathered from everything a run made, once."""

from __future__ import annotations

import pytest

from femprep.model import Notice, noted, records
from femprep.report.notices import gather, lines


def told(words: str, kind: str = "repaired") -> list[dict[str, object]]:
    return records(Notice.of(kind, words))


def test_notices_are_gathered_from_all_depths_once() -> None:
    report = {"a": {"notices": told("one") + told("two")}, "b": [{"c": {"notices": told("two") + told("three")}}]}
    assert lines({"notices": told("zero")}, report) == ["zero", "one", "two", "three"]
    assert lines({"notes": "no list"}, {}) == []


def test_a_notice_names_its_amount_and_its_place_in_words() -> None:
    words = "the epicardium was extrapolated by {amount} near {place}"
    found = Notice.of("extrapolated", words, amount=8.36, unit="mm", place=[1.04, -0.0, 2])
    assert found.what == "the epicardium was extrapolated by 8.4 mm near (1.0, 0.0, 2.0)"
    assert (found.kind, found.amount, found.unit, found.place) == ("extrapolated", 8.36, "mm", (1.04, 0.0, 2.0))


def test_a_place_the_words_do_not_name_is_added() -> None:
    assert Notice.of("moved", "it was moved", place=(1, 2, 3)).what == "it was moved, near (1.0, 2.0, 3.0)"


@pytest.mark.parametrize(
    ("amount", "unit", "shown"),
    [(0.03, "mm", "0.03 mm"), (0.0, "mm", "0.0 mm"), (12, "voxels", "12 voxels"), (99.6, "%", "100 %")],
)
def test_amounts_in_words(amount: float, unit: str, shown: str) -> None:
    assert Notice.of("repaired", "by {amount}", amount=amount, unit=unit).what == f"by {shown}"


def test_a_record_gives_the_notice_back() -> None:
    one = Notice.of("assumed", "a wall of {amount}", amount=3.0, unit="mm", place=(1.0, 2.0, 3.0))
    assert gather(noted({"radius": 1.0}, one)) == [one]
    assert noted({"radius": 1.0}) == {"radius": 1.0}
