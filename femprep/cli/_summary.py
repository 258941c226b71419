"""Tables on the screen at the end of a command."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import typer
from rich.console import Console
from rich.markup import escape

from femprep.cli._tables import print_table
from femprep.model import VolumeMesh


def _number(value: float | None, digits: int = 3) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


def print_summary(run: Any, manifest: Any, out: Path) -> None:
    """Volumes, wall, quality, seconds, notices of one run."""
    console = Console(highlight=False)
    _print_volumes(console, manifest)
    thickness = manifest.details.get("wall", {}).get("thickness", {})
    if "minimum_mm" in thickness:
        console.print(f"least wall thickness {thickness['minimum_mm']:.2f} mm")
    _print_fidelity(console, manifest.fidelity)
    _print_given(console, manifest.given_fidelity)
    _print_tissues(console, manifest.tissues)
    print_quality(run.quality, console)
    _print_solution(console, manifest.solution)
    _print_stages(console, manifest)
    console.print(f"[bold]{escape(str(out))}[/bold]: " + escape(", ".join(manifest.files)))


def _print_solution(console: Console, record: Any) -> None:
    """Status and cavities of an inflation; the reason is among the failures or the notices."""
    if record is not None:
        colour = {"solved": "green", "doubtful": "yellow", "failed": "red"}[record.status]
        console.print(f"inflation by CalculiX, {record.material}: [{colour}]{record.status}[/{colour}]")
        if record.converged:
            console.print(
                f"greatest displacement {record.greatest_displacement_mm:.3g} mm, strain of 99 % of the wall below "
                f"{record.strain:.2g} (valid up to {record.strain_limit:g})"
            )
        rows = [(c.name, *(_number(x, 4) for x in (c.pressure_kpa, c.rest_ml, c.inflated_ml))) for c in record.cavities]
        print_table(console, "Cavities", ("", "pressure, kPa", "before, mL", "inflated, mL"), rows)


def _print_tissues(console: Console, record: Any) -> None:
    """Volumes of scar and other tissue, and how far through the wall it goes."""
    if record is None:
        return
    columns = ("", "labels in the wall, mL", "shares, mL", "region, mL", "nearest voxel, mL", "transmurality, %")
    rows = [
        (
            one.name,
            *(_number(v, 4) for v in (one.wall_ml, one.shares_ml, one.region_ml, one.nearest_voxel_ml)),
            _number(one.transmurality_percent),
        )
        for one in record.tissues
    ]
    print_table(console, "Tissue", columns, rows)


def print_surfaces(fitted: Any, manifest: Any, out: Path) -> None:
    """Surfaces with their quality, seconds, notices."""
    console = Console(highlight=False)
    _print_volumes(console, manifest)
    rows = []
    for name in fitted.surfaces:
        item = manifest.details["surfaces"][name]
        figures = (item["quality_mean"], item["quality_min"], item.get("residual_rms"))
        rows.append([name, str(item["vertices"]), str(item["triangles"]), *map(_number, figures)])
    columns = ("", "vertices", "triangles", "Q mean", "Q min", "residual, mm")
    print_table(console, "Surfaces", columns, rows)
    _print_fidelity(console, manifest.fidelity)
    for failure in fitted.failures:
        console.print(f"[red]failed:[/red] {escape(failure)}")
    _print_stages(console, manifest)
    console.print(f"[bold]{escape(str(out))}[/bold]: " + escape(", ".join(manifest.files)))


def print_sequence(manifest: Any, out: Path) -> None:
    """Volumes, displacements and verdict of each phase of a sequence, and the ejection fraction."""
    console = Console(highlight=False)
    columns = ("", "cavity, mL", "labels, mL", "moved, mean mm", "greatest, mm", "check")
    rows = [
        (
            phase.name,
            _number(phase.cavity_ml, 4),
            _number(phase.label_total_ml, 4),
            _number(phase.displacement_mean_mm),
            _number(phase.displacement_maximum_mm),
            "passed" if phase.passed else "; ".join(phase.failures),
        )
        for phase in manifest.phases
    ]
    print_table(console, "Phases", columns, rows)
    console.print(
        f"ejection fraction {manifest.ejection_fraction_percent:.1f} %, of the labels "
        f"{manifest.label_ejection_fraction_percent:.1f} %"
    )
    _print_notices(console, manifest)
    console.print(f"[bold]{escape(str(out))}[/bold]: sequence.pvd, sequence.xdmf, phases/, run.json")


def print_methods(name: str, found: Any) -> None:
    """Methods of fitting one object, side by side."""
    console = Console(highlight=False)
    columns = (
        "mean, mm",
        "95 %",
        "greatest",
        "normals, deg",
        "in slices, mm",
        "triangles",
        "Q mean",
        "Q min",
        "sound",
        "s",
    )
    rows = []
    for item in found:
        if item.failure is not None:
            rows.append([item.method, *[""] * len(columns)])
            continue
        distances = map(_number, (item.mean, item.p95, item.max, item.normals, item.in_slice))
        quality = (_number(item.q_mean), _number(item.q_min), "yes" if item.sound else "no")
        rows.append([item.method, *distances, str(item.triangles), *quality, _number(item.seconds)])
    print_table(console, f"{name} by every method", ("", *columns), rows)
    for item in found:
        if item.failure is not None:
            console.print(f"{escape(item.method)}: {escape(item.failure)}")


def print_annotation(found: Any, manifest: Any, out: Path) -> None:
    """Names of facets and regions with how sure they are, quality, seconds, notices of an annotated mesh."""
    console = Console(highlight=False)
    for title, records, unit in (("Facets", manifest.facets, "mm2"), ("Regions", manifest.regions, "mm3")):
        rows = [(one.name, f"{100 * one.sure:.0f} %", _number(one.amount, 4), one.because) for one in records]
        print_table(console, title, ("", "sure", unit, "told by"), rows)
    print_quality(found.quality, console)
    _print_stages(console, manifest)
    console.print(f"[bold]{escape(str(out))}[/bold]: " + escape(", ".join(manifest.files)))


def print_transfer(record: Any) -> None:
    """What the fields of a transfer lose there and back."""
    console = Console(highlight=False)
    rows = [
        (
            f"{one.name} ({one.on})",
            one.kind,
            *(_number(value) for value in (one.back_mean, one.back_95, one.back_largest)),
            one.unit or f"of {_number(one.span)}" if one.unit or one.span is not None else "",
        )
        for one in record.fields
    ]
    if record.place_back_mean_mm is not None:
        off = (record.place_back_mean_mm, record.place_back_95_mm, record.place_back_largest_mm)
        rows.append(("place", f"edges of {record.source_edge_mm:.3g} mm", *map(_number, off), "mm"))
    print_table(console, "There and back", ("", "", "mean", "95 %", "largest", ""), rows)


def print_quality(report: Any, console: Console | None = None, *, worst: int = 0) -> None:
    """Counts, element measures with histograms, limits and verdict of a quality report, and the worst elements."""
    console = console or Console(highlight=False)
    console.print(f"{report.n_points} points, " + ", ".join(f"{n} {kind}" for kind, n in report.cells.items()))
    rows, ascii_only = [], console.options.ascii_only
    for name, item in report.measures.items():
        values = (item.min, item.mean, item.median, item.max)
        rows.append([name.replace("_", " "), *map(_number, values), _bars(item.histogram.counts, ascii_only)])
    print_table(console, "Quality", ("", "min", "mean", "median", "max", "histogram"), rows)
    console.print(f"limits: {escape(report.limits_from)}")
    console.print(f"stable time step of explicit dynamics {report.time_step:.3g} microseconds")
    if worst:
        _print_worst(report, console, worst)
    if report.passed:
        console.print(f"[green]{report.success}[/green]")
    for failure in report.failures:
        console.print(f"[red]failed:[/red] {escape(failure)}")


def _bars(counts: Any, ascii_only: bool) -> str:
    """A histogram in one line; bins with anything in them show, however little."""
    top, heights = max(*counts, 1), " .:-=+*#@" if ascii_only else " ▁▂▃▄▅▆▇█"
    return "".join(heights[0 if n == 0 else max(1, round(8 * n / top))] for n in counts)


def _print_worst(report: Any, console: Console, count: int) -> None:
    """The worst elements by each measure, with their places."""
    rows = []
    for item in report.worst_few(count):
        place, name = " ".join(f"{x:.1f}" for x in item.centroid), item.measure.replace("_", " ")
        rows.append([name, _number(item.value), str(item.element), item.type, item.region, place])
    columns = ("", "value", "element", "type", "region", "centroid x y z, mm LPS")
    print_table(console, "Worst elements", columns, rows)


def print_comparison(record: Any) -> None:
    """All figures of a comparison of two surfaces with their units, group by group."""
    console = Console(highlight=False)
    for group in type(record).model_fields:
        if (values := getattr(record, group)) is not None:
            console.print(f"[bold]{group.replace('_', ' ')}[/bold]: " + escape(_figures(values)))


def _figures(record: Any) -> str:
    """Nested figures in one line, with the units that their fields' descriptions end with."""
    parts = []
    for name, field in type(record).model_fields.items():
        value = getattr(record, name)
        unit = re.search(r"(?:^|, )(mm[23]?|degrees)(?=[.;:])", field.description or "")
        if value is not None:
            text = f"({_figures(value)})" if hasattr(value, "model_fields_set") else _figure(value)
            parts.append(" ".join(filter(None, (name.replace("_", " "), text, unit and unit[1]))))
    return ", ".join(parts)


def _figure(value: Any) -> str:
    if isinstance(value, tuple):
        return " ".join(_figure(item) for item in value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _print_volumes(console: Console, manifest: Any) -> None:
    rows = [
        (
            item.name,
            _number(item.mesh_ml, 4),
            _number(item.segmentation_ml if item.given_ml is None else item.given_ml, 4),
            _number(item.difference_percent, 2),
            _number(item.whole_ml, 4),
            _number(item.extrapolated_ml or None, 3),
        )
        for item in manifest.volumes
    ]
    beside = "surfaces given, mL" if manifest.input.surfaces else "labels, mL"
    columns = ("", "mesh, mL", beside, "difference, %", "labels in all, mL", "extrapolated, mL")
    parts = ", ".join(dict.fromkeys(item.part for item in manifest.volumes if item.part != "in all"))
    print_table(console, f"Volumes {parts}".strip(), columns, rows)


def _print_fidelity(console: Console, records: Any) -> None:
    """Distances of surfaces to the labels' outlines in the slices."""
    if not records:
        return
    rows = []
    for item in records:
        worst = max(item.slices, key=lambda one: one.greatest_mm)
        values = (item.mean_pixels, item.mean_mm, item.greatest_pixels, item.greatest_mm)
        rows.append([f"{item.surface} - {item.labels}", *(f"{value:.2f}" for value in values), str(worst.slice)])
    columns = ("", "mean, pixels", "mean, mm", "greatest, pixels", "greatest, mm", "slice")
    print_table(console, "Distance to the labels", columns, rows)


def _print_given(console: Console, records: Any) -> None:
    """Distances of facets to the surfaces that were given."""
    if not records:
        return
    rows = [
        [f"{item.surface} - {item.given}", *(f"{value:.2f}" for value in (item.mean_mm, item.p95_mm, item.greatest_mm))]
        for item in records
    ]
    print_table(console, "Distance to the surfaces given", ("", "mean, mm", "95 %, mm", "greatest, mm"), rows)


def _print_stages(console: Console, manifest: Any) -> None:
    console.print("seconds: " + ", ".join(f"{stage.name} {stage.seconds:.1f}" for stage in manifest.stages))
    _print_notices(console, manifest)


def print_left_out(mesh: VolumeMesh) -> None:
    """What was not read of anyone else's file."""
    from femprep.report.notices import lines

    for line in lines(mesh.info) if "source" in mesh.info else []:
        typer.echo(f"note: {line}")


def print_losses(mesh: VolumeMesh, format: str) -> None:
    """What the file of a format leaves out of a mesh, and names that it has otherwise."""
    from femprep.export.deck.names import renamed
    from femprep.export.losses import losses

    for notice in [*losses(mesh, format), *renamed(mesh)]:
        typer.echo(f"note: {notice.what}")


def _print_notices(console: Console, manifest: Any) -> None:
    for notice in manifest.notices:
        console.print(f"[yellow]note:[/yellow] {escape(notice)}")


def print_cohort(cohort: Any, out: Path) -> None:
    """How many subjects ended how, and why."""
    from femprep.cohort.reasons import reason

    console = Console(highlight=False)
    record = cohort.record
    rows = [(str(count), code, reason(code).status, reason(code).what) for code, count in record.reasons.items()]
    print_table(console, f"{len(record.subjects)} subjects", ("", "reason", "status", "what"), rows)
    if record.solved is not None:
        console.print(
            f"solved by CalculiX, within what the material is valid for: {record.solved} of {len(record.subjects)}"
        )
    console.print(f"written to {escape(str(out))}")
