"""Groups that share elements in, the one that names each element's region out: a mesh of ours has one for each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femprep.model import IntArray
from femprep.model.notice import Notice


def naming_groups(groups: Sequence[tuple[str, IntArray]], count: int) -> tuple[IntArray, list[Notice]]:
    """Which group names each element: the first one that holds it, those of all elements last.

    Parameters
    ----------
    groups : sequence of (str, (n,) array)
        Names and elements, in the order in which they count.
    count : int
        Number of elements.

    Returns
    -------
    (count,) array
        Number of the group, -1 for an element that is in none.
    list of Notice
        What says which groups lack elements by that; empty where none does.
    """
    found, lost = np.full(count, -1, dtype=np.int64), []
    for number in sorted(range(len(groups)), key=lambda number: len(groups[number][1]) == count):
        name, own = groups[number]
        free = own[found[own] < 0]
        found[free] = number
        if free.size < own.size < count:
            lost.append(name)
    words = f"an element has one region: groups {', '.join(lost)[:200]} lack those that are in another group as well"
    return found, [Notice.of("left out", words)] if lost else []
