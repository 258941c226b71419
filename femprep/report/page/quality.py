"""A quality report in, its part of an HTML page out, or a page of its own: limits, histograms, worst elements."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from femprep.model.markup import escape
from femprep.report.page.shared import write_page
from femprep.report.page.subject import STYLE, histogram, table

if TYPE_CHECKING:
    from femprep.volume.quality.report import QualityReport

#: Measures that are drawn, with their titles.
CHARTS: Final = {
    "mean_ratio": "mean ratio",
    "scaled_jacobian": "scaled Jacobian",
    "minimum_dihedral": "smallest dihedral angle, degrees",
    "characteristic_length": "characteristic length, mm",
}
#: Worst elements of each measure on a page.
_WORST: Final = 5


def quality_charts(report: QualityReport) -> list[str]:
    """Histograms of the main measures, SVG."""
    charts = []
    for name, title in CHARTS.items():
        item = report.measures[name]
        caption = f"{title}: min {item.min:.3g}, mean {item.mean:.3g}, max {item.max:.3g}"
        charts.append(histogram(item.histogram.edges, item.histogram.counts, caption))
    return charts


def quality_tables(report: QualityReport) -> str:
    """Limits with what was found, and the worst elements with their places, HTML."""
    limits = [
        (item.name.replace("_", " "), f"{item.kind} {item.limit:g}", item.value, "met" if item.passed else "missed")
        for item in report.limits
    ]
    worst = []
    for item in report.worst_few(_WORST):
        place = " ".join(f"{x:.1f}" for x in item.centroid)
        worst.append((item.measure.replace("_", " "), item.value, f"{item.type} {item.element}", item.region, place))
    return (
        f"<h3>Limits for the purpose: {escape(report.options.purpose)}</h3>"
        f"<p>Limits: {escape(report.limits_from)}</p>"
        + table(limits, ("", "asked", "found", ""))
        + "<h3>Worst elements</h3>"
        + table(worst, ("", "value", "element", "region", "centroid x y z, mm LPS"))
    )


def write_quality_page(report: QualityReport, path: Path, *, title: str, before: str = "") -> None:
    """Write the report of one mesh as a page: one file, no network; ``before`` is HTML that stands before it.

    Raises
    ------
    FileError
        The file cannot be written.
    """
    verdict = f'<p class="good">{report.success[0].upper()}{report.success[1:]}.</p>'
    if not report.passed:
        lines = "".join(f"<li>{escape(line)}</li>" for line in report.failures)
        verdict = f'<p class="bad">Checks failed:</p><ul>{lines}</ul>'
    measures = [
        (name.replace("_", " "), item.min, item.mean, item.median, item.max) for name, item in report.measures.items()
    ]
    page = f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{escape(title)} - femprep</title><style>{STYLE}</style></head>
<body>
<h1>{escape(title)}</h1>
{verdict}
<p>{report.n_points} points, {", ".join(f"{count} {escape(kind)}" for kind, count in report.cells.items())}</p>
{before}
<h2>Quality</h2>{table(measures, ("", "min", "mean", "median", "max"))}
<div class="grid">{"".join(quality_charts(report))}</div>
{quality_tables(report)}
</body></html>
"""
    write_page(path, page, "choose another with --html")
