"""Sets and surfaces of a deck by name: in any case, and those of a part apart from those of others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple


class SetName(NamedTuple):
    """A name, and the first number of the part in which it is said; 0 outside of parts."""

    text: str
    scope: int


class ByName:
    """Lists by name, as a deck adds to them."""

    def __init__(self) -> None:
        self._lists: dict[tuple[str, int], list[Any]] = {}
        self._written: dict[tuple[str, int], str] = {}

    def add(self, name: SetName, members: list[Any]) -> None:
        """Add members to the list of a name."""
        key = name.text.upper(), name.scope
        self._written.setdefault(key, name.text)
        self._lists.setdefault(key, []).extend(members)

    def find(self, name: SetName) -> SetName | None:
        """The name as it is kept: that of the part, or the same outside of parts; None where there is neither."""
        found = next(
            (key for key in ((name.text.upper(), scope) for scope in (name.scope, 0)) if key in self._lists), None
        )
        return None if found is None else SetName(*found)

    def members(self, kept: SetName) -> list[Any]:
        """What is in the list of a name as it is kept."""
        return self._lists[kept]

    def shown(self, parts: Mapping[int, str]) -> Iterator[tuple[SetName, str]]:
        """Names as they are kept and as they are written; with the part before it where several have the same."""
        times = Counter(text for text, _ in self._lists)
        for (text, scope), written in self._written.items():
            alone = times[text] == 1 or scope not in parts
            yield SetName(text, scope), written if alone else f"{parts[scope]}_{written}"
