"""The record of a cohort in, its page out: counts, a table, outliers, distributions, pictures. One file, no network."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

import numpy as np
from markupsafe import Markup

from femprep.model import FloatArray
from femprep.report.templates import render

#: Beyond this robust z a heart is marked.
OUTLIER: Final = 3.5
#: Fewer hearts have no distribution.
_LEAST: Final = 5
#: Standard deviations of a normal distribution in one median absolute deviation.
_NORMAL: Final = 1.4826
#: Colour of the light of each status.
_LIGHTS: Final = {"meshed": "green", "check failed": "amber", "refused": "red", "failed": "red", "set aside": "red"}
#: Status of a heart with a folder.
_MADE: Final = ("meshed", "check failed")
#: Columns of the table that are text; the rest are figures.
_TEXT: Final = ("subject", "status", "reason", "message")
#: Fields of a row that are no figure of its own.
_LEFT_OUT: Final = {"kind", "exit_status", "images", "sha256", "thickness_mm", "notices", "solved", *_TEXT}
#: What the slices of all hearts may take with their images, characters.
_MOST_PICTURES: Final = 3_500_000
#: One SVG of a slice on the page of a heart.
_SLICE: Final = re.compile(r'<svg [^>]*aria-label="slice (\d+)">.*?</svg>', re.DOTALL)


def cohort_page(
    record: Mapping[str, Any],
    timings: Iterable[Mapping[str, Any]],
    reasons: Sequence[Mapping[str, Any]],
    descriptions: Mapping[str, str],
    out: Path,
    *,
    title: str,
    command: str = "",
) -> str:
    """The page as text.

    Parameters
    ----------
    record : mapping
        What ``cohort.json`` holds.
    timings : iterable of mapping
        Rows of ``timings.tsv``.
    reasons : sequence of mapping
        Code, status, what and remedy of those that occur.
    descriptions : mapping of str to str
        What each figure is.
    out : Path
        Folder of the cohort, in which the pages of the hearts are looked for.
    title, command : str
    """
    took = {row["subject"]: row for row in timings}
    rows = [_row(subject, took.get(subject["subject"], {})) for subject in record["subjects"]]
    names = [name for name in (rows[0] if rows else ()) if not name.startswith("_") and name not in _TEXT]
    names = [name for name in names if any(row[name] is not None for row in rows)]
    links = {row["subject"]: _link(row, out) for row in rows}
    # What a subject took that was refused at once is no figure of a heart.
    made = [row for row in rows if row["status"] in _MADE]
    scores = {
        name: robust_z(np.array([row[name] if row in made and row[name] is not None else np.nan for row in rows]))
        for name in names
    }
    outliers = []
    for number, row in enumerate(rows):
        row["_link"] = links[row["subject"]]
        row["_out"] = [name for name in names if abs(scores[name][number]) > OUTLIER]
        for name in row["_out"]:
            median = float(np.median([other[name] for other in made if other[name] is not None]))
            outliers.append(
                {
                    "subject": row["subject"],
                    "link": row["_link"],
                    "title": _title(name),
                    "value": row[name],
                    "median": median,
                    "z": float(scores[name][number]),
                }
            )
    columns = [
        {"field": name, "title": _title(name), "number": name not in _TEXT, "what": descriptions.get(name, "")}
        for name in (*_TEXT, *names)
    ]
    return render(
        "cohort.html",
        title=title,
        record=record,
        reasons=[{**one, "count": record["reasons"][one["code"]], "light": _LIGHTS[one["status"]]} for one in reasons],
        limit=OUTLIER,
        outliers=sorted(outliers, key=lambda one: -abs(one["z"])),
        plots=[_plot(name, made) for name in names if sum(row[name] is not None for row in made) >= _LEAST],
        pictures=_pictures(rows, out),
        rows=[{**row, "message": row["message"][:300]} for row in rows],
        columns=columns,
        date=time.strftime("%Y-%m-%d %H:%M %Z"),
        command=command,
        options=json.dumps(record["options"], indent=1),
    )


def robust_z(values: FloatArray) -> FloatArray:
    """Distance of each value from the median, in standard deviations estimated by the median absolute deviation.

    Parameters
    ----------
    values : (n,) array
        NaN where there is none.

    Returns
    -------
    (n,) array
        0 where there are too few values, or more than half of them are the same.
    """
    known = values[np.isfinite(values)]
    if len(known) < _LEAST:
        return np.zeros(len(values))
    spread = _NORMAL * float(np.median(np.abs(known - np.median(known))))
    if spread <= 1e-9 * max(1.0, float(np.abs(known).max())):
        return np.zeros(len(values))
    return np.asarray(np.nan_to_num((values - np.median(known)) / spread))


def _row(subject: Mapping[str, Any], took: Mapping[str, Any]) -> dict[str, Any]:
    """Cells of the table: text, figures, thickness of the segments, what it took."""
    row: dict[str, Any] = {name: subject[name] for name in _TEXT}
    row |= {name: value for name, value in subject.items() if name not in _LEFT_OUT}
    # Of a heart that was not made nobody knows what it needs.
    row["repaired"] = len(subject["notices"]) if subject["status"] in _MADE else None
    row |= {f"thickness_aha_{k}_mm": value for k, value in enumerate(subject["thickness_mm"] or (), start=1)}
    row |= {f"thickness_aha_{k}_mm": row.get(f"thickness_aha_{k}_mm") for k in range(1, 18)}
    return row | {name: took.get(name) for name in ("seconds", "peak_memory_mb")}


def _title(name: str) -> str:
    """A column's name as a heading, its unit behind a comma."""
    stem, _, unit = name.rpartition("_")
    units = {"ml": "mL", "mm": "mm", "g": "g", "percent": "%", "pixels": "pixels", "degrees": "degrees", "mb": "MB"}
    return f"{stem.replace('_', ' ')}, {units[unit]}" if stem and unit in units else name.replace("_", " ")


def _link(row: Mapping[str, Any], out: Path) -> str:
    """Where the page of a heart is, below the folder; nothing where this run made none."""
    if row["status"] not in _MADE:
        return ""
    page = _page(out / row["subject"])
    return "" if page is None else quote(page.relative_to(out).as_posix())


def _page(folder: Path) -> Path | None:
    """The page of a heart, or of the first phase of one."""
    pages = [folder / "report.html", *sorted(folder.glob("phases/*/report.html"))]
    return next((page for page in pages if page.is_file()), None)


def _plot(name: str, rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """A figure of all hearts as dots along a line, those of one place above each other."""
    known = sorted((row for row in rows if row[name] is not None), key=lambda row: float(row[name]))
    values = [float(row[name]) for row in known]
    low, high = values[0], values[-1]
    places = [10.0 + 300.0 * ((value - low) / (high - low) if high > low else 0.5) for value in values]
    median = float(np.median(values))
    stacks: dict[int, int] = {}
    dots = []
    for row, value, x in zip(known, values, places, strict=True):
        column = int(x // 6)
        stacks[column] = stacks.get(column, 0) + 1
        y = 74.0 - 5.0 * ((stacks[column] - 1) % 13)
        dot = {"x": round(x, 1), "y": round(y, 1), "value": value, "out": name in row["_out"]}
        dots.append({**dot, "subject": row["subject"], "link": row["_link"]})
    at = 10.0 + 300.0 * ((median - low) / (high - low) if high > low else 0.5)
    return {"title": _title(name), "low": low, "high": high, "median": median, "median_x": round(at, 1), "dots": dots}


def _pictures(rows: Iterable[Mapping[str, Any]], out: Path) -> list[dict[str, Any]]:
    """The middle slice of each heart, as its own page draws it; without images where these are too many for a page."""
    found = []
    for row in rows:
        page = _page(out / row["subject"]) if row["_link"] else None
        svg = "" if page is None else _middle_slice(page.read_text(encoding="utf-8"))
        if svg:
            light = _LIGHTS[row["status"]]
            found.append({"subject": row["subject"], "link": row["_link"], "light": light, "svg": svg})
    lit = sum(len(one["svg"]) for one in found) <= _MOST_PICTURES
    return [{**one, "svg": Markup(one["svg"] if lit else _unlit(one["svg"]))} for one in found]


def _middle_slice(page: str) -> str:
    """The middle one of the slices of a page; of a sequence, whose page shows some phases, of the first of them."""
    found: list[str] = []
    numbers: list[int] = []
    for match in _SLICE.finditer(page):
        if numbers and int(match[1]) <= numbers[-1]:
            break
        numbers.append(int(match[1]))
        found.append(match[0])
    return found[len(found) // 2] if found else ""


def _unlit(svg: str) -> str:
    """A slice without the image under it."""
    return re.sub(r'<g class="image">.*?</g>', "", svg, flags=re.DOTALL).replace(' class="lit"', "", 1)
