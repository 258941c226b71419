"""A Notice: what a stage repaired, assumed, extrapolated or left out unasked, as it stands in every ``info``.

Whoever does such a thing says it where it does it: the record goes under ``notices`` of the ``info`` (or report) of
what is made, and travels with it. At the end of a run they are gathered from everything that was made, whatever the
anatomy and the mesher, for ``run.json``, the screen and ``report.html``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, SupportsFloat

from pydantic import Field

from femprep.model.record import Record

#: Key of an ``info`` under which its notices stand.
NOTICES = "notices"

Kind = Literal["assumed", "extrapolated", "left out", "moved", "not reached", "repaired"]
Unit = Literal["mm", "mL", "%", "voxels", "elements", "edges"]

#: Digits of an amount in words, by unit; counts have none.
_DIGITS = {"mm": 1, "mL": 1}


class Notice(Record):
    """Something that was done to the data, or taken for granted, without being asked for."""

    kind: Kind = Field(description="What was done.")
    what: str = Field(description="The same in words, with amount and place.")
    amount: float | None = Field(None, description="How much.")
    unit: Unit | None = Field(None, description="Unit of the amount.")
    place: tuple[float, float, float] | None = Field(None, description="Where, or where it is worst, mm LPS.")

    @classmethod
    def of(
        cls,
        kind: Kind,
        words: str,
        *,
        amount: SupportsFloat | None = None,
        unit: Unit | None = None,
        place: Sequence[float] | Any = None,
    ) -> Notice:
        """A notice whose words name its amount and place, so that both are written once.

        Parameters
        ----------
        kind : str
        words : str
            One clause; ``{amount}`` and ``{place}`` stand for what follows. A place that the words do not name is
            added at their end.
        amount : float, optional
        unit : str, optional
            The amount's.
        place : (3,) array, optional
            mm LPS.
        """
        at = None if place is None else tuple(round(float(x), 3) + 0.0 for x in place)
        shown = "" if at is None else spot(at)
        if at is not None and "{place}" not in words:
            words += ", near {place}"
        what = words.replace("{amount}", _in_words(amount, unit)).replace("{place}", shown)
        return cls(kind=kind, what=what, amount=None if amount is None else float(amount), unit=unit, place=at)


def _in_words(amount: SupportsFloat | None, unit: Unit | None) -> str:
    if amount is None:
        return ""
    digits = _DIGITS.get(unit or "", 0)
    # Half a tenth of a millimetre is something, "0.0 mm" is not.
    value = float(amount)
    digits += digits > 0 and 0.0 < abs(value) < 0.5 * 10.0**-digits
    one = digits == 0 and round(value) == 1 and unit is not None
    return f"{value:.{digits}f}" + (f" {unit.removesuffix('s') if one else unit}" if unit else "")


def records(*notices: Notice) -> list[dict[str, Any]]:
    """Notices as they stand in an ``info``: JSON-ready."""
    return [notice.model_dump(mode="json") for notice in notices]


def noted(info: Mapping[str, Any], *notices: Notice) -> dict[str, Any]:
    """A copy of an ``info`` with further notices."""
    if not notices:
        return dict(info)
    return {**info, NOTICES: [*info.get(NOTICES, ()), *records(*notices)]}


def spot(point: Sequence[float] | Any) -> str:
    """A point as words have it."""
    return "({:.1f}, {:.1f}, {:.1f})".format(*point)
