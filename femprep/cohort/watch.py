"""A worker at work in, its peak memory out; where it takes more time or memory than it may, it is ended at once.

Kernels and libraries cannot be interrupted, so the process ends with what it was at; its nanny starts another. What is
watched is the whole family: the process and its children, of which the mesher is one.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import Final, Self

import psutil

#: Seconds between two looks.
PULSE: Final = 0.2
#: Exit status of a worker that was ended here.
ENDED: Final = 76


class Watch:
    """Looks at this process and its children while a block runs.

    Parameters
    ----------
    seconds, gigabytes : float, optional
        What the block may take by the clock, and the family of memory; None sets no limit.
    tell : callable
        Called with a reason code and words before the process ends.

    Attributes
    ----------
    peak : float
        Greatest memory of the family so far, bytes.
    """

    def __init__(self, seconds: float | None, gigabytes: float | None, tell: Callable[[str, str], None]) -> None:
        self.peak = 0.0
        self._seconds, self._gigabytes, self._tell = seconds, gigabytes, tell
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._look, name="femprep-watch", daemon=True)

    def __enter__(self) -> Self:
        self._start = time.monotonic()
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._over.set()
        self._thread.join()

    def _look(self) -> None:
        own = psutil.Process()
        while True:
            used = memory(own)
            self.peak = max(self.peak, used)
            gone = time.monotonic() - self._start
            if self._seconds is not None and gone > self._seconds:
                self._end("time-limit", f"not done after {self._seconds:g} s (--subject-time-limit)")
            if self._gigabytes is not None and used > 1e9 * self._gigabytes:
                self._end("memory-limit", f"its worker took more than {self._gigabytes:g} GB (--memory-limit)")
            if self._over.wait(PULSE):
                return

    def _end(self, code: str, words: str) -> None:
        self._tell(code, words)
        end_family(os.getpid(), itself=False)
        os._exit(ENDED)


def memory(process: psutil.Process) -> float:
    """Memory that a process and its children hold, bytes."""
    total = 0.0
    with suppress(psutil.Error):
        total = float(process.memory_info().rss)
        for child in process.children(recursive=True):
            with suppress(psutil.Error):
                total += child.memory_info().rss
    return total


def end_family(pid: int, *, itself: bool = True) -> None:
    """Kill the children of a process, and theirs, and the process itself first, so that it starts no others."""
    with suppress(psutil.Error):
        process = psutil.Process(pid)
        children = process.children(recursive=True)
        if itself:
            process.kill()
        for child in children:
            with suppress(psutil.Error):
                child.kill()
