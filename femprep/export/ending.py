"""Files that say when a parser reads on behind their end: meshio's wait there for ever for what damage took away."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, Final

#: How often a parser may find nothing more: some look once or twice.
_LOOKS: Final = 100
#: What of meshio opens files that it reads on and on: all readers by the first, but for those of their own.
_OPENING: Final = ("meshio._files", "meshio.tetgen._tetgen")


class _Counted:
    """Counts how often the end of the file was read."""

    looks = 0

    def _seen(self, found: Any, wanted: int) -> Any:
        if not found and wanted:
            self.looks += 1
            if self.looks > _LOOKS:
                raise EOFError("the file ends too soon")
        return found


class _Text(_Counted, io.TextIOWrapper):
    def readline(self, size: int = -1, /) -> str:  # type: ignore[override]
        return str(self._seen(super().readline(size), size))

    def read(self, size: int | None = -1, /) -> str:
        return str(self._seen(super().read(size), -1 if size is None else size))


class _Bytes(_Counted, io.BufferedReader):
    def readline(self, size: int | None = -1, /) -> bytes:
        return bytes(self._seen(super().readline(size), -1 if size is None else size))

    def read(self, size: int | None = -1, /) -> bytes:
        return bytes(self._seen(super().read(size), -1 if size is None else size))


def _opened(path: str | Path, mode: str = "r") -> Any:
    """What ``open`` gives, for reading; a parser that reads on behind the end meets an ``EOFError``."""
    raw = io.FileIO(path)
    return _Bytes(raw) if "b" in mode else _Text(io.BufferedReader(raw))


@contextlib.contextmanager
def ending_files() -> Iterator[None]:
    """While this lasts, the files that meshio opens end."""
    modules = [import_module(name) for name in _OPENING]
    for module in modules:
        vars(module)["open"] = _opened
    try:
        yield
    finally:
        for module in modules:
            del vars(module)["open"]
