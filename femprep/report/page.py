"""The HTML page of one run: pictures, figures, what was repaired, and words for a paper. One file, no network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from femprep.report.manifest import RunManifest
from femprep.report.methods import FILES, methods

#: Style sheet of femprep's pages.
STYLE = """
body{font:15px/1.5 system-ui,sans-serif;max-width:980px;margin:2em auto;padding:0 1em;color:#222}
h1{font-size:1.5em}h2{font-size:1.15em;margin-top:2em;border-bottom:1px solid #ddd}
table{border-collapse:collapse}td,th{padding:.2em .8em .2em 0;text-align:left;border-bottom:1px solid #eee}
td.n{text-align:right;font-variant-numeric:tabular-nums}
.grid{display:flex;flex-wrap:wrap;gap:8px}svg{background:#fff;border:1px solid #eee}
img{max-width:100%}.bad{color:#b3202a;font-weight:600}.good{color:#1d7a3a;font-weight:600}
"""


def histogram(edges: Sequence[float], counts: Sequence[int], caption: str) -> str:
    """SVG histogram: counts between edges, with a caption below."""
    top = max(*counts, 1)
    step, unit = 280.0 / len(counts), 75.0 / top
    bars = "".join(
        f'<rect x="{10 + i * step:.1f}" y="{90 - n * unit:.1f}" width="{step - 0.6:.1f}" height="{n * unit:.1f}"/>'
        for i, n in enumerate(counts)
    )
    return (
        f'<svg viewBox="0 0 300 120" width="300" role="img" aria-label="{escape(caption)}"><g fill="#4a78a8">{bars}</g>'
        f'<text x="10" y="103" font-size="9">{edges[0]:.3g}</text>'
        f'<text x="290" y="103" font-size="9" text-anchor="end">{edges[-1]:.3g}</text>'
        f'<text x="10" y="116" font-size="9.5">{escape(caption)}</text></svg>'
    )


def table(rows: Sequence[tuple[Any, ...]], head: Sequence[str] = ()) -> str:
    """HTML table; numbers stand right."""
    lines = []
    if head:
        lines.append("<tr>" + "".join(f"<th>{escape(cell)}</th>" for cell in head) + "</tr>")
    for row in rows:
        cells = "".join(
            f'<td class="n">{cell:.6g}</td>'
            if isinstance(cell, int | float) and not isinstance(cell, bool)
            else f"<td>{escape('' if cell is None else str(cell))}</td>"
            for cell in row
        )
        lines.append(f"<tr>{cells}</tr>")
    return "<table>" + "".join(lines) + "</table>"


_VOLUMES = ("", "mesh, mL", "segmentation, mL", "difference, %", "of it extrapolated beyond the labels, mL")


def report_page(
    manifest: RunManifest,
    *,
    passed: bool,
    failures: Sequence[str],
    figures: Sequence[tuple[Any, ...]],
    histograms: Sequence[str],
    details: str,
    fidelity: str,
    slices: Sequence[str],
    bulls_eyes: Sequence[str],
    colours: Mapping[str, str],
    picture: str | None,
) -> str:
    """The page as text.

    Parameters
    ----------
    manifest : RunManifest
    passed, failures
        Whether the mesh reached its limits, and where it did not.
    figures : rows of (name, value...)
        Counts and quality.
    histograms, slices, bulls_eyes : sequences of SVG
    details : str
        Limits and worst elements, HTML.
    fidelity : str
        Distances to the labels, HTML.
    colours : mapping
        Line colour by surface name.
    picture : str, optional
        ``data:`` address of the picture of the mesh.
    """
    title = manifest.input.path or "mesh"
    verdict = (
        '<p class="good">Every check passed.</p>'
        if passed
        else '<p class="bad">Checks failed:</p><ul>'
        + "".join(f"<li>{escape(item)}</li>" for item in failures)
        + "</ul>"
    )
    notices = "".join(f"<li>{escape(item)}</li>" for item in manifest.notices) or "<li>Nothing.</li>"
    legend = ", ".join(f'<span style="color:{colour}">{escape(name)}</span>' for name, colour in colours.items())
    drawn = (
        f'<img src="{picture}" alt="The mesh, and a cut through it">'
        if picture
        else "<p>No picture: VTK could not render.</p>"
    )
    segments = f'<h2>AHA segments</h2><div class="grid">{"".join(bulls_eyes)}</div>' if bulls_eyes else ""
    volumes = [
        (v.name, v.mesh_ml, v.segmentation_ml, v.difference_percent, v.extrapolated_ml or None)
        for v in manifest.volumes
    ]
    return f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{escape(title)} - femprep</title><style>{STYLE}</style></head><body>
<h1>{escape(title)}</h1>
{verdict}
<h2>The mesh</h2>{drawn}
<h2>The data with the mesh drawn over it</h2><p>{legend}; red dots where it leaves the labels</p>
<div class="grid">{"".join(slices)}</div>
<h2>Distance of the mesh to the labels' outlines</h2>{fidelity}
<h2>Volumes</h2>{table(volumes, _VOLUMES)}
<h2>Quality</h2>{table(figures)}<div class="grid">{"".join(histograms)}</div>
{details}
{segments}
<h2>What was repaired, guessed or extrapolated</h2><ul>{notices}</ul>
<h2>Time</h2>{table([(s.name, round(s.seconds, 2)) for s in manifest.stages], ("stage", "s"))}
<h2>For a paper</h2><p>{escape(methods(manifest).plain)}</p>
<p>The same with citation keys is in {FILES[0]}, the references in {FILES[1]}.</p>
</body></html>
"""
