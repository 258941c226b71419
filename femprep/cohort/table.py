"""Rows of a cohort as they end in; ``cohort.tsv``, ``cohort.json``, ``timings.tsv`` out: sorted, whole at any time."""

from __future__ import annotations

import csv
import io
import time
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from femprep.cohort.reasons import REASONS
from femprep.cohort.records import CohortRecord, SubjectRecord, Timing
from femprep.cohort.state import replace_file
from femprep.options import Options

#: Segments of the left ventricle.
_SEGMENTS: Final = 17
#: What stands for a figure that there is none of.
NONE: Final = "n/a"
#: A table is written again after so many times what writing it took, and this many seconds.
_PATIENCE: Final = (20.0, 1.0)


class Table:
    """The rows of a cohort so far.

    Parameters
    ----------
    out : Path
        Folder of the cohort.
    options : Options
    asked : int
        Subjects asked for.
    """

    def __init__(self, out: Path, options: Options, asked: int) -> None:
        self._out, self._options, self._asked = out, options, asked
        self._rows: dict[str, SubjectRecord] = {}
        self._timings: dict[str, Timing] = {}
        self._earlier = _read_timings(out / "timings.tsv")
        self._written, self._took = 0.0, 0.0

    def __len__(self) -> int:
        return len(self._rows)

    def add(self, record: SubjectRecord, timing: Timing) -> None:
        """Take a row in, and write the tables unless that was done just now."""
        self._rows[record.subject] = record
        self._timings[record.subject] = timing
        times, least = _PATIENCE
        if time.monotonic() - self._written > max(times * self._took, least):
            self.write()

    def keep(self, record: SubjectRecord, otherwise: Timing) -> None:
        """Take in the row of a folder that counts, with what making it took, as far as that is known."""
        self._rows[record.subject] = record
        self._timings[record.subject] = self._earlier.get(record.subject, otherwise)

    @property
    def record(self) -> CohortRecord:
        """What ``cohort.json`` holds."""
        rows = [self._rows[name] for name in sorted(self._rows)]
        reasons = Counter(row.reason for row in rows)
        asked_to_solve = any(row.solved is not None for row in rows)
        return CohortRecord(
            options=self._options,
            asked=self._asked,
            counts=dict(sorted(Counter(row.status for row in rows).items())),
            reasons={reason.code: reasons[reason.code] for reason in REASONS if reasons[reason.code]},
            solved=sum(row.solved is True for row in rows) if asked_to_solve else None,
            subjects=rows,
        )

    @property
    def timings(self) -> list[Timing]:
        """What each row took, by name."""
        return [self._timings[name] for name in sorted(self._timings)]

    def write(self) -> CohortRecord:
        """Write the tables.

        Raises
        ------
        FileError, DiskFullError
            They cannot be written; the earlier ones stay.
        """
        start = time.monotonic()
        record = self.record
        replace_file(self._out, "cohort.tsv", table_text(COLUMNS, map(cells, record.subjects)))
        replace_file(self._out, "cohort.json", record.model_dump_json(indent=2) + "\n")
        replace_file(
            self._out, "timings.tsv", table_text(list(Timing.model_fields), map(Timing.model_dump, self.timings))
        )
        self._written = time.monotonic()
        self._took = self._written - start
        return record


def cells(record: SubjectRecord) -> dict[str, Any]:
    """A row as the cells of a table, by column."""
    found: dict[str, Any] = {}
    for name in SubjectRecord.model_fields:
        value = getattr(record, name)
        if name == "thickness_mm":
            values = value or [None] * _SEGMENTS
            found |= {f"thickness_aha_{number}_mm": one for number, one in enumerate(values, start=1)}
        else:
            found[name] = "; ".join(value) if isinstance(value, list) else value
    return found


#: Columns of ``cohort.tsv``.
COLUMNS: Final = [
    column
    for name in SubjectRecord.model_fields
    for column in ([f"thickness_aha_{k}_mm" for k in range(1, _SEGMENTS + 1)] if name == "thickness_mm" else [name])
]


def table_text(columns: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> str:
    """Rows as tab-separated text with a line of names first."""
    file = io.StringIO()
    writer = csv.writer(file, delimiter="\t", lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        writer.writerow([_text(row[column]) for column in columns])
    return file.getvalue()


def _text(value: Any) -> str:
    if value is None:
        return NONE
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, float) else " ".join(str(value).split())


def _read_timings(path: Path) -> dict[str, Timing]:
    """Timings of an earlier run; those that cannot be read are lost, and no harm done."""
    found = {}
    with suppress(OSError, ValueError, csv.Error), path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file, delimiter="\t"):
            with suppress(ValueError):
                timing = Timing.model_validate({name: None if text == NONE else text for name, text in row.items()})
                found[timing.subject] = timing
    return found
