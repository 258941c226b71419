"""The phases of one heart in, their page out: volumes over time, thickening, quality of phases, a view that moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from femprep.anatomy import bulls_eye_svg
from femprep.model.markup import escape
from femprep.report.manifest import PhaseRecord, RunManifest, SequenceManifest
from femprep.report.methods import FILES, sequence_methods
from femprep.report.page.checks import check_lines
from femprep.report.pictures.colours import SCALE
from femprep.report.pictures.data_pictures import DataPictures
from femprep.report.pictures.scene import moving_scene
from femprep.report.pictures.shown import Shown
from femprep.report.templates import figure, render
from femprep.volume import QualityReport

#: Colours of a curve of the meshes and of one of the labels; places of a chart.
_CURVES: Final = {"mesh": "#b3202a", "labels": "#777777"}
_LEFT, _RIGHT, _TOP, _BOTTOM = 52.0, 690.0, 14.0, 190.0
#: Other phases than the first and those of the greatest and the least cavity that show a slice.
_SLICES: Final = 24
#: What the phases of the greatest and the least cavity are called.
_ENDS: Final = ("end-diastole", "end-systole")


@dataclass(frozen=True, eq=False)
class Phase:
    """What the page shows of one phase.

    Attributes
    ----------
    record : PhaseRecord
    manifest : RunManifest
    quality : QualityReport
    view : Shown
    data : DataPictures
    """

    record: PhaseRecord
    manifest: RunManifest
    quality: QualityReport
    view: Shown
    data: DataPictures


def sequence_page(phases: Sequence[Phase], manifest: SequenceManifest) -> str:
    """The page as text.

    Parameters
    ----------
    phases : sequence of Phase
    manifest : SequenceManifest
    """
    reference = phases[manifest.reference]
    full = max(phases, key=lambda one: one.record.cavity_ml)
    least = min(phases, key=lambda one: one.record.cavity_ml)
    names = [one.record.name for one in phases]
    view = [one.view for one in phases]
    ends = [full, least] if full is not least else [full]
    others = [one for one in phases if one not in ends]
    chosen = np.unique(np.rint(np.linspace(0, len(others) - 1, min(_SLICES, len(others)))).astype(int))
    return render(
        "sequence.html",
        title=f"{reference.record.source or 'heart'}, {len(phases)} phases",
        manifest=manifest,
        reference=reference.manifest,
        phases=[_row(one, manifest, full, least) for one in phases],
        failed=[one.record.name for one in phases if not one.record.passed],
        figures=_figures(manifest, full, least),
        curve=_chart([one.record for one in phases]),
        curves=_CURVES,
        full=full.record.name,
        least=least.record.name,
        scene=moving_scene(view, [one.quality for one in phases], names, manifest.reference),
        scale=SCALE,
        eyes=_eyes(full, least),
        data=full.data,
        ends=[(f"{one.record.name}, {words}", one.data) for one, words in zip(ends, _ENDS)],
        others=[(others[k].record.name, others[k].data.slices) for k in chosen],
        methods=sequence_methods(reference.manifest, manifest, reference.quality).plain,
        files=FILES,
        options=(manifest.options or reference.manifest.options).model_dump_json(indent=1),
    )


def _row(phase: Phase, manifest: SequenceManifest, full: Phase, least: Phase) -> dict[str, Any]:
    """A line of the table of phases."""
    lines = check_lines(phase.quality.limits, phase.manifest.options)
    lights = [str(line["light"]) for line in lines] if phase.record.passed else ["red"]
    marks = [words for one, words in zip((full, least), _ENDS) if one is phase]
    if phase is not full and phase.record is manifest.phases[manifest.reference]:
        marks.append("reference")
    wall = next((item.mesh_ml for item in phase.manifest.volumes if item.name.startswith(("wall", "lv wall"))), None)
    distance = [item.greatest_pixels for item in phase.manifest.fidelity]
    measures = phase.quality.measures
    return {
        "record": phase.record,
        "light": next((light for light in ("red", "amber") if light in lights), "green"),
        "mark": ", ".join(marks),
        "wall_ml": wall,
        "mean_ratio": measures["mean_ratio"].min if "mean_ratio" in measures else None,
        "dihedral": measures["minimum_dihedral"].min if "minimum_dihedral" in measures else None,
        "distance_pixels": max(distance, default=None),
        "seconds": sum(stage.seconds for stage in phase.manifest.stages),
    }


def _figures(manifest: SequenceManifest, full: Phase, least: Phase) -> list[tuple[str, float, float, str]]:
    """What is read off the curve: name, of the meshes, of all voxels, unit."""
    mesh = full.record.cavity_ml, least.record.cavity_ml
    totals = [phase.label_total_ml for phase in manifest.phases]
    labels = max(totals), min(totals)
    return [
        ("ejection fraction", manifest.ejection_fraction_percent, manifest.label_ejection_fraction_percent, "%"),
        ("stroke volume", mesh[0] - mesh[1], labels[0] - labels[1], "mL"),
        ("greatest cavity", mesh[0], labels[0], "mL"),
        ("least cavity", mesh[1], labels[1], "mL"),
    ]


def _chart(phases: Sequence[PhaseRecord]) -> str:
    """Volumes of the cavity over time, SVG: of the mesh, and of the voxels below the same base."""
    times = np.array([phase.time for phase in phases])
    curves = {
        "mesh": np.array([phase.cavity_ml for phase in phases]),
        "labels": np.array([phase.label_cavity_ml for phase in phases]),
    }
    marks = _round_marks(float(max(values.max() for values in curves.values())))
    span = max(float(np.ptp(times)), 1e-9)
    x = _LEFT + (_RIGHT - _LEFT) * (times - times[0]) / span
    parts = []
    for mark in marks:
        y = _height(mark, marks[-1])
        parts.append(f'<path d="M{_LEFT:g} {y:.1f}H{_RIGHT:g}" stroke="#ddd"/>')
        parts.append(f'<text x="{_LEFT - 6:g}" y="{y + 3.5:.1f}" text-anchor="end">{mark:g}</text>')
    for name in reversed(curves):
        y = _height(curves[name], marks[-1])
        path = "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x, y, strict=True))
        dashes = ' stroke-dasharray="4 3"' if name == "labels" else ""
        parts.append(f'<path d="M{path}" fill="none" stroke="{_CURVES[name]}" stroke-width="1.6"{dashes}/>')
        for phase, a, b, value in zip(phases, x, y, curves[name], strict=True):
            title = f"{escape(phase.name)}, {name}: {figure(float(value), 4)} mL"
            parts.append(
                f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3" fill="{_CURVES[name]}"><title>{title}</title></circle>'
            )
    every = max(1, len(phases) // 12)
    for phase, a in list(zip(phases, x, strict=True))[::every]:
        parts.append(f'<text x="{a:.1f}" y="{_BOTTOM + 14:g}" text-anchor="middle">{phase.time:g}</text>')
    return (
        f'<svg viewBox="0 0 720 225" width="720" role="img" aria-label="volume of the cavity over time" font-size="10">'
        f'{"".join(parts)}<text x="{0.5 * (_LEFT + _RIGHT):g}" y="{_BOTTOM + 29:g}" text-anchor="middle">time</text>'
        f'<text transform="translate(12 {0.5 * (_TOP + _BOTTOM):g}) rotate(-90)" text-anchor="middle">cavity, mL</text>'
        "</svg>"
    )


def _height(values: Any, top: float) -> Any:
    return _BOTTOM - (_BOTTOM - _TOP) * values / top


def _round_marks(top: float) -> list[float]:
    """From 0 in four to eight round steps to above the greatest value."""
    step = 10.0 ** np.floor(np.log10(max(top, 1e-9)))
    step = float(next(step * part for part in (0.1, 0.2, 0.25, 0.5, 1.0, 2.0) if top / (step * part) <= 8.0))
    return [step * k for k in range(int(np.ceil(top / step)) + 1)]


def _eyes(full: Phase, least: Phase) -> list[str]:
    """Bull's eyes of thickness with the cavity at its greatest and least, and of what it gained."""
    thick = [_segments(one.manifest.thickness_mm) for one in (full, least)]
    if any(values is None for values in thick):
        return []
    wide, narrow = (values for values in thick if values is not None)
    limits = float(np.nanmin([wide, narrow])), float(np.nanmax([wide, narrow]))
    more = 100.0 * (narrow / wide - 1.0)
    return [
        bulls_eye_svg(wide, label=f"{_ENDS[0]}, mm", text="{:.1f}", limits=limits, width=300),
        bulls_eye_svg(narrow, label=f"{_ENDS[1]}, mm", text="{:.1f}", limits=limits, width=300),
        bulls_eye_svg(more, label="thickening, %", text="{:.0f}", width=300),
    ]


def _segments(values: Mapping[str, float | None] | None) -> Any:
    return None if values is None else np.array(list(values.values()), dtype=np.float64)
