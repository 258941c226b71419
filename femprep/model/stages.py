"""The stages of a run, timed, their progress passed on."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager

from femprep.model.progress import Progress

_log = logging.getLogger(__name__)


class Stages:
    """Times the stages of a run and passes their progress on."""

    def __init__(self, progress: Progress | None) -> None:
        self.seconds: dict[str, float] = {}
        self._progress = progress

    @contextmanager
    def __call__(self, name: str) -> Iterator[Progress]:
        """One stage: announced at its start and at its end, and timed."""
        report = self._progress or (lambda stage, fraction: None)
        report(name, 0.0)
        start = time.perf_counter()
        yield lambda _, fraction: report(name, fraction)
        taken = time.perf_counter() - start
        self.seconds[name] = self.seconds.get(name, 0.0) + taken
        _log.info("%s: %.1f s", name, taken)
        report(name, 1.0)
