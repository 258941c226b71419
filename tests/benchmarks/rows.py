"""Rows of figures, one a case, as the benchmarks print and keep them."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any


def shown(row: dict[str, Any]) -> str:
    """A row as one line."""
    return " ".join(f"{k}={v:.4g}" if isinstance(v, float) else f"{k}={v}" for k, v in row.items())


def keep(rows: Sequence[dict[str, Any]], path: Path) -> None:
    """Write rows as CSV, with a column for every name that occurs in one of them."""
    with path.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, list(dict.fromkeys(name for row in rows for name in row)))
        writer.writeheader()
        writer.writerows(rows)
