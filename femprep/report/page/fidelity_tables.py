"""Distances of surfaces to the labels in, their part of the HTML page out: a line per surface, a line per slice."""

from __future__ import annotations

from collections.abc import Sequence

from femprep.model.markup import escape
from femprep.model.shared_records.label_fidelity import FidelityRecord
from femprep.model.shared_records.surface_fidelity import SurfaceFidelity
from femprep.report.page.subject import table


def fidelity_tables(records: Sequence[FidelityRecord], limit: float | None) -> str:
    """Tables of distances to the labels' outlines; slices beyond the limit, in pixels, stand out.

    Parameters
    ----------
    records : sequence of FidelityRecord
    limit : float or None

    Returns
    -------
    str
        HTML; a line that says so where there is nothing to compare with.
    """
    if not records:
        return "<p>Nothing to compare with.</p>"
    head = ("", "labels", "mean, pixels", "mean, mm", "greatest, pixels", "greatest, mm")
    rows = [
        (
            *(r.surface, r.labels, round(r.mean_pixels, 2), round(r.mean_mm, 2)),
            *(round(r.greatest_pixels, 2), round(r.greatest_mm, 2)),
        )
        for r in records
    ]
    numbers = sorted({s.slice for r in records for s in r.slices})
    columns = [{s.slice: s for s in r.slices} for r in records]
    lines = []
    for number in numbers:
        cells = []
        for column in columns:
            one = column.get(number)
            if one is None:
                cells.append("<td></td>")
                continue
            bad = ' class="bad"' if limit is not None and one.greatest_pixels > limit else ""
            missed = ", not reached" if one.missed else ""
            cells.append(f"<td{bad}>{one.mean_pixels:.2f} / {one.greatest_pixels:.2f}{missed}</td>")
        lines.append(f"<tr><td>{number}</td>{''.join(cells)}</tr>")
    titles = "".join(f"<th>{escape(r.surface)} against {escape(r.labels)}</th>" for r in records)
    return (
        table(rows, head)
        + "<h3>By slice: mean / greatest, pixels</h3>"
        + f"<table><tr><th>slice</th>{titles}</tr>{''.join(lines)}</table>"
    )


def given_table(records: Sequence[SurfaceFidelity]) -> str:
    """Table of distances to the surfaces that were given.

    Parameters
    ----------
    records : sequence of SurfaceFidelity

    Returns
    -------
    str
        HTML.
    """
    head = ("", "given as", "mean, mm", "95 %, mm", "greatest, mm", "at x y z, mm")
    rows = [
        (
            *(r.surface, r.given, round(r.mean_mm, 3), round(r.p95_mm, 3), round(r.greatest_mm, 2)),
            " ".join(f"{x:.1f}" for x in r.at_mm),
        )
        for r in records
    ]
    return table(rows, head)
