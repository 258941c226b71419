"""Finished runs of the phases of one heart in, one folder out: a folder of each, time series, run.json, report.html."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from femprep.errors import InputError
from femprep.export.series import write_pvd, write_xdmf_series
from femprep.image import IntensityImage
from femprep.model import Progress
from femprep.report.folder.output_folder import whole_folder
from femprep.report.folder.record import files_with, stage_records, write_record
from femprep.report.manifest import PhaseRecord, RunManifest, SequenceManifest
from femprep.report.methods import FILES, sequence_methods
from femprep.report.output import write_methods, written
from femprep.report.page.sequence import Phase, sequence_page
from femprep.report.run import Run, SequenceRun
from femprep.report.volumes import cavity_volume, voxel_volume


def write_sequence(
    sequence: SequenceRun,
    out: str | Path,
    *,
    sources: Sequence[str | Path] | None = None,
    names: Sequence[str] | None = None,
    images: Sequence[IntensityImage] | None = None,
    command: str = "",
    progress: Progress | None = None,
) -> SequenceManifest:
    """Write the folder of a sequence, whole or not at all.

    ``phases/<name>/`` is the folder of each phase's run; ``sequence.pvd`` and ``sequence.xdmf`` are the time series
    with the displacement of each node from the reference phase; ``run.json`` tells each phase's quality and volumes,
    ``report.html`` shows them.

    Parameters
    ----------
    sequence : SequenceRun
    out : path
        Folder to make.
    sources : sequence of path, optional
        The label map of each phase.
    names : sequence of str, optional
        Names of the phases, and of their folders; those of their files where not given.
    images : sequence of IntensityImage, optional
        The image that each was drawn on, for the pages.
    command : str
        What was typed, for ``run.json`` and the page.
    progress : callable, optional
        Called with ``(stage, fraction)``.

    Raises
    ------
    FileError
        As for :func:`femprep.write_run`.
    InputError
        Images are not as many as phases, or do not lie where their labels do.

    Examples
    --------
    >>> fp.write_sequence(found, "out")  # doctest: +SKIP
    """
    paths = [Path(source) for source in sources] if sources is not None else [None] * len(sequence.runs)
    names = phase_names(paths) if names is None else list(names)
    shown = list(images) if images is not None else [None] * len(sequence.runs)
    if len(shown) != len(sequence.runs):
        raise InputError(f"{len(shown)} images given for {len(sequence.runs)} phases; one for each is needed, or none")
    own, phases, spent = time.perf_counter(), [], 0.0
    with whole_folder(Path(out)) as folder:
        (folder / "phases").mkdir()
        for name, path, run, moment, image in zip(names, paths, sequence.runs, sequence.times, shown, strict=True):
            start = time.perf_counter()
            kept = written(run, folder / "phases" / name, source=path, image=image, command=command, progress=progress)
            spent += time.perf_counter() - start
            record = _record(run, kept.manifest, name, path, moment)
            phases.append(Phase(record, kept.manifest, run.quality, kept.view, kept.data))
        write_pvd(folder / "sequence.pvd", [f"phases/{name}/mesh.vtu" for name in names], sequence.times)
        write_xdmf_series([run.mesh for run in sequence.runs], folder, "sequence", sequence.times)
        seconds = {**sequence.seconds, "write": time.perf_counter() - own - spent}
        manifest = SequenceManifest(
            command=command or None,
            options=sequence.options,
            reference=sequence.reference,
            template=dict(sequence.template),
            phases=[phase.record for phase in phases],
            stages=stage_records(seconds),
            ejection_fraction_percent=sequence.ejection_fraction,
            label_ejection_fraction_percent=sequence.label_ejection_fraction,
            notices=_of_phases({phase.record.name: phase.manifest.notices for phase in phases}),
            files=files_with(folder, "report.html", *FILES),
        )
        first = phases[sequence.reference]
        write_methods(sequence_methods(first.manifest, manifest, first.quality), folder)
        (folder / "report.html").write_text(sequence_page(phases, manifest), encoding="utf-8")
        return write_record(manifest, folder, sequence.seconds, own + spent)


def _record(run: Run, manifest: RunManifest, name: str, path: Path | None, moment: float) -> PhaseRecord:
    """What the sequence's record tells of one phase."""
    moved = np.linalg.norm(run.mesh.point_data["displacement"], axis=1)
    cavity = run.objects["lv"]
    return PhaseRecord(
        name=name,
        source=path.name if path else None,
        sha256=manifest.input.sha256,
        image=manifest.image,
        time=moment,
        passed=run.quality.passed,
        failures=list(run.quality.failures),
        cavity_ml=cavity_volume(run.mesh) / 1000.0,
        label_cavity_ml=voxel_volume(cavity, run.wall.planes.values()) / 1000.0,
        label_total_ml=cavity.volume / 1000.0,
        base_offset_mm=run.options.wall.base_offset,
        displacement_mean_mm=float(moved.mean()),
        displacement_maximum_mm=float(moved.max()),
    )


def phase_names(paths: Sequence[Path | None]) -> list[str]:
    """A folder name for each phase: its file's name without endings; numbered where that does not tell them apart."""
    stems = [path.name.split(".")[0] if path else "" for path in paths]
    if "" in stems or len(set(stems)) < len(stems):
        return [f"{number:03d}" + (f"_{stem}" if stem else "") for number, stem in enumerate(stems)]
    return stems


def _of_phases(notices: Mapping[str, list[str]]) -> list[str]:
    """What is said of every phase, once; then what is said of some, with their names."""
    first = next(iter(notices.values()))
    common = [line for line in first if all(line in own for own in notices.values())]
    return common + [f"{name}: {line}" for name, own in notices.items() for line in own if line not in common]
