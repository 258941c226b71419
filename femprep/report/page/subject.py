"""The HTML page of one run: pictures, figures, what was repaired, and words for a paper. One file, no network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from femprep.model.markup import escape
from femprep.report.manifest import RunManifest, VolumeRecord
from femprep.report.methods import FILES, methods
from femprep.report.page.checks import check_lines
from femprep.report.pictures.colours import SCALE
from femprep.report.templates import asset, render

if TYPE_CHECKING:
    from femprep.report.pictures.data_pictures import DataPictures
    from femprep.volume.quality.report import QualityReport

#: Worst elements of each measure on a page.
_WORST: Final = 5

#: Style sheet of femprep's pages.
STYLE = asset("pages.css")


def histogram(edges: Sequence[float], counts: Sequence[int], caption: str) -> str:
    """SVG histogram: counts between edges, with a caption below, in two lines where it has a colon."""
    top = max(*counts, 1)
    step, unit = 280.0 / len(counts), 75.0 / top
    title, _, rest = caption.partition(": ")
    bars = "".join(
        f'<rect x="{10 + i * step:.1f}" y="{90 - n * unit:.1f}" width="{step - 0.6:.1f}" height="{n * unit:.1f}"/>'
        for i, n in enumerate(counts)
    )
    return (
        f'<svg viewBox="0 0 300 132" width="300" role="img" aria-label="{escape(caption)}"><g fill="#4a78a8">{bars}</g>'
        f'<text x="10" y="103" font-size="9">{edges[0]:.3g}</text>'
        f'<text x="290" y="103" font-size="9" text-anchor="end">{edges[-1]:.3g}</text>'
        f'<text x="10" y="116" font-size="9.5">{escape(title)}</text>'
        f'<text x="10" y="127" font-size="9.5">{escape(rest)}</text></svg>'
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


def report_page(
    manifest: RunManifest,
    quality: QualityReport,
    *,
    figures: Sequence[tuple[Any, ...]],
    histograms: Sequence[str],
    fidelity: str,
    data: DataPictures,
    bulls_eyes: Sequence[str],
    colours: Mapping[str, str],
    picture: str | None,
    scene: Mapping[str, Any],
) -> str:
    """The page as text.

    Parameters
    ----------
    manifest : RunManifest
    quality : QualityReport
        Limits, failures, worst elements.
    figures : rows of (name, value...)
        Counts and quality.
    histograms, bulls_eyes : sequences of SVG
    data : DataPictures
        Slices and cuts along the long axis.
    fidelity : str
        Distances to the labels, HTML.
    colours : mapping
        Colour of each facet tag, by name.
    picture : str, optional
        ``data:`` address of the picture of the mesh.
    scene : mapping
        What the 3-D view shows.
    """
    given = bool(manifest.input.surfaces)
    volumes: list[tuple[Any, ...]] = [
        (v.name, v.mesh_ml, v.given_ml, v.difference_percent)
        if given
        else (v.name, v.mesh_ml, v.segmentation_ml, v.difference_percent, v.whole_ml, v.extrapolated_ml or None)
        for v in manifest.volumes
    ]
    return render(
        "run.html",
        title=manifest.input.path or "mesh",
        manifest=manifest,
        passed=quality.passed,
        failures=quality.failures,
        limits_from=quality.limits_from,
        purpose=quality.options.purpose,
        checks=check_lines(quality.limits, manifest.options),
        solution=manifest.solution,
        worst=_worst(quality),
        figures=table(figures),
        volumes=table([tuple(map(_rounded, row)) for row in volumes], volume_columns(manifest.volumes, given)),
        stages=table([(s.name, round(s.seconds, 2)) for s in manifest.stages], ("stage", "s")),
        histograms=histograms,
        fidelity=fidelity,
        data=data,
        bulls_eyes=bulls_eyes,
        colours=colours,
        picture=picture,
        scene=scene,
        scale=SCALE,
        methods=methods(manifest, quality).plain,
        files=FILES,
        options=manifest.options.model_dump_json(indent=1),
    )


def volume_columns(records: Sequence[VolumeRecord], given: bool) -> tuple[str, ...]:
    """Heads of the table of volumes: which part of what is compared with what."""
    part = " " + records[0].part if records and records[0].part != "in all" else ""
    if given:
        return "", f"mesh{part}, mL", f"surfaces given{part}, mL", "difference, %"
    more = "labels in all, mL", "of the mesh: extrapolated beyond the labels at the apex, mL"
    return "", f"mesh{part}, mL", f"labels{part}, mL", "difference, %", *more


def _rounded(value: Any) -> Any:
    """A volume or a share in as many digits as voxels tell."""
    return round(value, 1) if isinstance(value, float) else value


def _worst(quality: QualityReport) -> list[dict[str, Any]]:
    """The worst elements of each measure, with their places."""
    return [
        {
            "measure": item.measure.replace("_", " "),
            "value": item.value,
            "region": item.region,
            "element": f"{item.type} {item.element}",
            "place": list(item.centroid),
            "shown": " ".join(f"{x:.1f}" for x in item.centroid),
        }
        for item in quality.worst_few(_WORST)
    ]
