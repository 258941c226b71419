"""Columns and rows in, tables on the screen out, whose figures are never cut off: what is too wide goes below."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from rich.cells import cell_len
from rich.console import Console
from rich.markup import escape
from rich.table import Table

#: Columns of this many characters or more are text, whose lines may be broken between words.
_TEXT = 32
#: Empty characters between columns.
_GAP = 2


def print_table(console: Console, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table in as many parts, one below the other, as the width asks for; each begins with the first column.

    Parameters
    ----------
    console : Console
        Its width is that of the terminal, or of ``COLUMNS``, or 80.
    title : str
    columns : sequence of str
        Headings; they are broken between words.
    rows : sequence of sequence of str
        One string for each column.
    """
    widths = [_width([column, *(row[i] for row in rows)], column) for i, column in enumerate(columns)]
    parts: list[list[int]] = [[]]
    for i in range(1, len(columns)):
        # Rich counts a gap behind the last column too.
        taken = sum(widths[j] + _GAP for j in (0, *parts[-1], i))
        if parts[-1] and taken > console.width:
            parts.append([])
        parts[-1].append(i)
    for number, chosen in enumerate(parts):
        table = Table(
            title=title if number == 0 else None,
            title_justify="left",
            title_style="bold",
            box=None,
            pad_edge=False,
            padding=(0, _GAP, 0, 0),
        )
        shown = (0, *chosen)
        rest = console.width - sum(widths[i] + _GAP for i in shown)
        for i in shown:
            # Whole headings, and longer lines of text, as far as there is room.
            wanted = max(cell_len(columns[i]), *(cell_len(row[i]) for row in rows), 0)
            more = max(0, min(rest, wanted - widths[i]))
            rest -= more
            side: Literal["left", "right"] = "left" if i == 0 or widths[i] >= _TEXT else "right"
            table.add_column(columns[i], justify=side, header_style="dim", width=widths[i] + more, overflow="fold")
        for row in rows:
            table.add_row(*(escape(row[i]) for i in shown))
        console.print(table)


def _width(cells: list[str], heading: str) -> int:
    """Characters a column needs: the longest cell, but of a heading, or of text, the longest word."""
    longest = max(cell_len(cell) for cell in cells if cell is not heading) if len(cells) > 1 else 0
    words = max((cell_len(word) for word in heading.split()), default=0)
    return max(min(longest, _TEXT), words)
