"""What the stages of a run made in; what they repaired, assumed, extrapolated out: :mod:`femprep.model.notice`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from femprep.model.notice import NOTICES, Notice


def gather(*reports: Any) -> list[Notice]:
    """Every notice of nested records, once each, in order.

    Parameters
    ----------
    *reports : mapping or list
        What stages report: an ``info``, or anything that holds some.
    """
    found: dict[str, Notice] = {}
    for report in reports:
        for notice in _notices(report):
            found.setdefault(notice.what, notice)
    return list(found.values())


def lines(*reports: Any) -> list[str]:
    """The same in words."""
    return [notice.what for notice in gather(*reports)]


def _notices(value: Any) -> Iterator[Notice]:
    if isinstance(value, Mapping):
        for key, item in value.items():
            if key == NOTICES:
                yield from (one if isinstance(one, Notice) else Notice(**one) for one in item)
            else:
                yield from _notices(item)
    elif isinstance(value, list | tuple):
        for item in value:
            yield from _notices(item)
