"""Progress bars on standard error, one a stage; none where the screen is not a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress as Bars

    from femprep.model import Progress


@contextmanager
def bars(quiet: bool) -> Iterator[Progress | None]:
    """A progress callable ``(stage, fraction)`` that draws a bar for each stage; None where quiet."""
    if quiet:
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    console = Console(stderr=True)
    note = TextColumn("{task.fields[note]}")
    columns = (TextColumn("{task.description:<16}"), BarColumn(bar_width=30), TimeElapsedColumn(), note)
    with Bars(*columns, console=console, disable=not console.is_terminal) as drawn, _noted(drawn):
        tasks = {}

        def report(stage: str, fraction: float) -> None:
            if stage not in tasks:
                tasks[stage] = drawn.add_task(stage, total=1.0, note="")
            # A negative fraction is a sign of life from a backend that tells no progress.
            if fraction >= 0.0:
                drawn.update(tasks[stage], completed=fraction)

        yield report


@contextmanager
def _noted(drawn: Bars) -> Iterator[None]:
    """Write beside the last bar that kernels are compiled, while they are."""
    from numba.core import event

    class Compiling(event.Listener):  # type: ignore[misc]
        depth = 0

        def on_start(self, event: object) -> None:
            self._go(1, 0, "compiling kernels, first run only")

        def on_end(self, event: object) -> None:
            self._go(-1, 1, "")

        def _go(self, step: int, outermost: int, note: str) -> None:
            # A kernel's parts are compiled while it is.
            if self.depth == outermost and drawn.task_ids:
                drawn.update(drawn.task_ids[-1], note=note, refresh=True)
            self.depth += step

    listener = Compiling()
    event.register("numba:compile", listener)
    try:
        yield
    finally:
        event.unregister("numba:compile", listener)
