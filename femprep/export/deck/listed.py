"""A keyword of a deck in; an error where by it nodes or elements are others than the deck lists."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from femprep.errors import FileError


def require_listed(path: Path, keyword: str, making: Collection[str]) -> None:
    """Refuse a keyword that moves, copies, merges or makes nodes or elements.

    Raises
    ------
    FileError
        It is one of those.
    """
    if keyword in making:
        raise FileError(
            f"{str(path)!r}: *{keyword.lstrip('*')} is not read; by it nodes or elements are others than those listed: "
            "let the program that knows it write them out"
        )
