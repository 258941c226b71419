"""Label maps of the phases of one heart in, swept meshes of one connectivity and their displacements out."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from femprep.errors import InputError, OptionError
from femprep.export.series import write_pvd, write_xdmf_series
from femprep.image import IntensityImage, Segmentation
from femprep.model import Progress, noted
from femprep.model.stages import Stages
from femprep.options import Options, choose, takes
from femprep.pipeline import begin, mesh_segmentation
from femprep.report.folder.output_folder import whole_folder
from femprep.report.manifest import PhaseRecord, RunManifest, SequenceManifest, StageRecord, hashes
from femprep.report.methods import FILES, sequence_methods
from femprep.report.output import write_methods, written
from femprep.report.page.sequence import Phase, sequence_page
from femprep.report.run import Run
from femprep.report.volumes import cavity_volume, voxel_volume
from femprep.sweeping import displacements, template_of
from femprep.wall import phase_base_offsets
from femprep.wall.planes.phase_bases import base_moved_with_phases


@dataclass(frozen=True)
class SequenceRun:
    """Runs of the phases of one heart.

    Attributes
    ----------
    runs : tuple of Run
        In order; each mesh has ``point_data["displacement"]`` from the reference phase, mm.
    times : tuple of float
    reference : int
        Number of that phase, from 0.
    template : mapping of str to int or str
        What their connectivity follows from, see :func:`~femprep.sweeping.template_of`.
    options : Options, optional
        Those asked for; of each run, with its own base and this template.
    seconds : mapping of str to float
        Wall-clock time of each stage beside those of the runs.

    Examples
    --------
    >>> [run.quality.passed for run in found.runs]  # doctest: +SKIP
    [True, True]
    """

    runs: tuple[Run, ...]
    times: tuple[float, ...]
    reference: int
    template: Mapping[str, int | str]
    options: Options | None = None
    seconds: Mapping[str, float] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether every phase passed the quality check."""
        return all(run.quality.passed for run in self.runs)

    @property
    def ejection_fraction(self) -> float:
        """Greatest less least cavity of the meshes below their base planes, per cent of the greatest."""
        return _ejected([cavity_volume(run.mesh) for run in self.runs])

    @property
    def label_ejection_fraction(self) -> float:
        """The same of all voxels of the cavity."""
        return _ejected([run.objects["lv"].volume for run in self.runs])


@takes(Options)
def mesh_sequence(
    phases: Sequence[Segmentation],
    options: Options | None = None,
    *,
    times: Sequence[float] | None = None,
    reference: int = 0,
    progress: Progress | None = None,
    **changes: object,
) -> SequenceRun:
    """Sweep all phases of one heart with one connectivity.

    The reference phase is meshed first; its columns, rows and layers, or those given in the options, are those of all.
    The base planes leave out the same share of the labelled cavity in all phases, see
    :func:`~femprep.wall.phase_base_offsets`.

    Parameters
    ----------
    phases : sequence of Segmentation
        Label maps with ``lv`` and ``myo``, in order of time.
    options, **changes
        As for :func:`femprep.mesh_segmentation`; the mesher is the sweep.
    times : sequence of float, optional
        One per phase, increasing; their numbers where not given.
    reference : int
        Number of the phase that displacements are from.
    progress : callable, optional
        Called with ``(stage, fraction)``; stages are those of a run with the number of the phase before them.

    Returns
    -------
    SequenceRun

    Raises
    ------
    InputError, OptionError
        No phases, times that do not increase, another anatomy than the left ventricle; as for ``mesh_segmentation``.
    StageError
        A phase cannot be meshed.

    Examples
    --------
    >>> found = fp.mesh_sequence([diastole, systole], volume={"edge_length": 4.0})  # doctest: +SKIP
    >>> round(found.ejection_fraction)  # doctest: +SKIP
    58
    """
    options = choose(Options, options, changes)
    count = len(phases)
    if not 0 <= reference < count:
        raise InputError(f"reference phase {reference} asked for, but there are {count} phases, counted from 0")
    moments = tuple(float(t) for t in (range(count) if times is None else times))
    if len(moments) != count or np.any(np.diff(moments) <= 0.0):
        raise InputError(f"times of {count} phases have to be as many and increase, not {list(moments)}")
    if options.anatomy != "lv":
        raise OptionError(f"option 'anatomy' is {options.anatomy!r}; a sequence is swept, which meshes lv alone")
    options = _with(options, volume={"mesher": "sweep"})
    # Cubic voxels do not tell the stack: all phases are cut across the one of the reference.
    phases = [replace(seg, grid=replace(seg.grid, stack=phases[reference].grid.stack)) for seg in phases]
    stages = Stages(None)
    with stages("preflight of all phases"):
        offsets = phase_base_offsets(phases, options=options.wall)
        for number, seg in enumerate(phases):  # a phase that cannot be meshed is known before the first is
            try:
                begin(seg, _with(options, wall={"base_offset": offsets[number]}), Stages(None))
            except InputError as error:
                raise InputError(f"phase {number}: {error}") from error

    def run(number: int, chosen: Options) -> Run:
        report = progress or (lambda stage, fraction: None)
        own = _with(chosen, wall={"base_offset": offsets[number]})
        moved = base_moved_with_phases(offsets[number] - chosen.wall.base_offset)
        seg = replace(phases[number], info=noted(phases[number].info, *moved))
        return mesh_segmentation(seg, own, progress=lambda stage, fraction: report(f"{number} {stage}", fraction))

    first = run(reference, options)
    template = template_of(first.mesh)
    same = _with(options, sweep=dict(template))
    runs = [first if number == reference else run(number, same) for number in range(count)]
    with stages("displacements"):
        moved = displacements([one.mesh for one in runs], reference)
    runs = [replace(one, mesh=mesh) for one, mesh in zip(runs, moved)]
    return SequenceRun(tuple(runs), moments, reference, dict(template), options, stages.seconds)


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
        What was typed, for the page.
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
        files = {str(file.relative_to(folder)) for file in folder.rglob("*") if file.is_file()}
        files |= {"run.json", "report.html", *FILES}
        seconds = {**sequence.seconds, "write": time.perf_counter() - own - spent}
        manifest = SequenceManifest(
            options=sequence.options,
            reference=sequence.reference,
            template=dict(sequence.template),
            phases=[phase.record for phase in phases],
            stages=_stages(seconds),
            ejection_fraction_percent=sequence.ejection_fraction,
            label_ejection_fraction_percent=sequence.label_ejection_fraction,
            notices=_of_phases({phase.record.name: phase.manifest.notices for phase in phases}),
            files=sorted(files),
        )
        write_methods(sequence_methods(phases[sequence.reference].manifest, manifest), folder)
        (folder / "report.html").write_text(sequence_page(phases, manifest, command), encoding="utf-8")
        seconds["write"] = time.perf_counter() - own - spent
        manifest = manifest.model_copy(update={"sha256": hashes(folder, files), "stages": _stages(seconds)})
        (folder / "run.json").write_text(manifest.model_dump_json(indent=2) + "\n", encoding="utf-8")
    return manifest


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


def _stages(seconds: Mapping[str, float]) -> list[StageRecord]:
    return [StageRecord(name=name, seconds=round(value, 3)) for name, value in seconds.items()]


def phase_names(paths: Sequence[Path | None]) -> list[str]:
    """A folder name for each phase: its file's name without endings; numbered where that does not tell them apart."""
    stems = [path.name.split(".")[0] if path else "" for path in paths]
    if "" in stems or len(set(stems)) < len(stems):
        return [f"{number:03d}" + (f"_{stem}" if stem else "") for number, stem in enumerate(stems)]
    return stems


def _with(options: Options, **groups: dict[str, Any]) -> Options:
    """The options with some of a group's changed, the others as given."""
    changed = {
        name: choose(type(getattr(options, name)), getattr(options, name), values) for name, values in groups.items()
    }
    return choose(Options, options, changed)


def _of_phases(notices: Mapping[str, list[str]]) -> list[str]:
    """What is said of every phase, once; then what is said of some, with their names."""
    first = next(iter(notices.values()))
    common = [line for line in first if all(line in own for own in notices.values())]
    return common + [f"{name}: {line}" for name, own in notices.items() for line in own if line not in common]


def _ejected(volumes: Sequence[float]) -> float:
    return 100.0 * (max(volumes) - min(volumes)) / max(volumes)
