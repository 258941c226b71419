"""Progress bars on standard error, one a stage; none where the screen is not a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
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
    columns = (TextColumn("{task.description:<16}"), BarColumn(bar_width=30), TimeElapsedColumn())
    with Bars(*columns, console=console, disable=not console.is_terminal) as drawn:
        tasks = {}

        def report(stage: str, fraction: float) -> None:
            if stage not in tasks:
                tasks[stage] = drawn.add_task(stage, total=1.0)
            # A negative fraction is a sign of life from a backend that tells no progress.
            if fraction >= 0.0:
                drawn.update(tasks[stage], completed=fraction)

        yield report
