"""A subject in, its folder and its row out: what a worker does. It stays up from subject to subject, and its kernels,
templates and libraries with it."""

from __future__ import annotations

import time
import traceback
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from femprep.cohort.done import is_done
from femprep.cohort.reasons import Reason, reason, reason_of
from femprep.cohort.records import SubjectRecord, Timing
from femprep.cohort.row import row_of_folder, stage_seconds
from femprep.cohort.state import Note, read_note, remove_failure, remove_note, write_failure, write_note
from femprep.cohort.subjects import Subject
from femprep.cohort.watch import Watch
from femprep.errors import DiskFullError, FemprepError, cannot_write
from femprep.image import read_segmentation
from femprep.image.reading.long_axis import require_one_phase
from femprep.image.underlay import read_under
from femprep.model.stages import Stages
from femprep.pipeline import fit_surfaces, mesh_segmentation
from femprep.report.output import write_run, write_surfaces
from femprep.report.sequence_output import write_sequence
from femprep.sequence import mesh_sequence

#: A subject that ended its worker so often is set aside.
ATTEMPTS: Final = 2


@dataclass(frozen=True)
class Job:
    """What a worker is told.

    Attributes
    ----------
    subject : Subject
    out : Path
        Folder of the cohort.
    run : str
        Name of the cohort's run.
    fresh : bool
        Whether an earlier folder of the subject counts for nothing.
    seconds, gigabytes : float, optional
        What a subject may take.
    """

    subject: Subject
    out: Path
    run: str
    fresh: bool = False
    seconds: float | None = None
    gigabytes: float | None = None


@dataclass(frozen=True)
class SubjectOutcome:
    """What a worker gives back."""

    record: SubjectRecord
    timing: Timing


def run_subject(job: Job) -> SubjectOutcome:
    """Make the folder of a subject, whole or not at all.

    Parameters
    ----------
    job : Job

    Returns
    -------
    SubjectOutcome
        Whatever happens: an error is a row with its reason.
    """
    subject, start = job.subject, time.perf_counter()
    note = read_note(job.out, subject.name, job.run)
    if note.reason or note.attempts >= ATTEMPTS:
        return set_aside(job, note)
    peak, stages = 0.0, None
    note = replace(note, attempts=note.attempts + 1)
    try:
        write_note(job.out, subject.name, note)

        def tell(code: str, words: str) -> None:
            write_note(job.out, subject.name, replace(note, reason=code, words=words))

        with Watch(job.seconds, job.gigabytes, tell) as watch:
            try:
                record, stages = _made(job, again=note.attempts > 1)
            finally:
                peak = watch.peak
    except (Exception, SystemExit) as error:  # libraries leave by themselves, too
        record = _row(job, _known(error))
    remove_note(job.out, subject.name)
    timing = Timing(
        subject=subject.name,
        seconds=round(time.perf_counter() - start, 3),
        stages_seconds=stages,
        peak_memory_mb=round(peak / 1e6, 1),
        attempts=note.attempts,
    )
    return SubjectOutcome(record, timing)


def set_aside(job: Job, note: Note) -> SubjectOutcome:
    """The row of a subject that ended its worker."""
    code = note.reason or "worker-lost"
    words = note.words or f"its worker was ended {note.attempts} times while at work on it"
    remove_note(job.out, job.subject.name)
    record = _failed(job, reason(code), f"{words}; {reason(code).remedy[:1].lower()}{reason(code).remedy[1:]}", 3)
    return SubjectOutcome(record, Timing(subject=job.subject.name, seconds=0.0, attempts=note.attempts))


def _made(job: Job, *, again: bool) -> tuple[SubjectRecord, float]:
    """Row, and seconds of all stages, of a subject whose folder is made now, or was by a worker that was then lost."""
    subject, folder = job.subject, job.out / job.subject.name
    if job.fresh or not (again and is_done(subject, folder)):
        _make(subject, folder)
    remove_failure(job.out, subject.name)
    return row_of_folder(subject, folder), stage_seconds(folder)


def _make(subject: Subject, folder: Path) -> None:
    """The folder of a subject, as the commands ``mesh``, ``mesh --sequence`` and ``surface`` make it."""
    options = subject.options
    stages = Stages(None)
    require_one_phase(options.image.long_axis + options.image.contours, len(subject.images))
    with stages("read"):
        maps = [read_segmentation(path, options.structures, options.preset, options.image) for path in subject.images]
        shown = [] if subject.kind == "surfaces" else [read_under(*one, options) for one in zip(maps, subject.shown)]
    if subject.kind == "sequence":
        found = mesh_sequence(maps, options)
        found = replace(found, seconds={**stages.seconds, **found.seconds})
        write_sequence(found, folder, sources=subject.images, images=shown or None)
    elif subject.kind == "surfaces":
        fitted = fit_surfaces(maps[0], options.objects, options)
        fitted = replace(fitted, seconds={**stages.seconds, **fitted.seconds})
        write_surfaces(fitted, folder, source=subject.images[0])
    else:
        run = mesh_segmentation(maps[0], options)
        run = replace(run, seconds={**stages.seconds, **run.seconds})
        write_run(run, folder, source=subject.images[0], image=shown[0] if shown else None)


def _known(error: BaseException) -> BaseException:
    """An error of the system's own that means a full disk, as what it is."""
    if isinstance(error, OSError) and not isinstance(error, FemprepError):
        full = cannot_write("what was to be written", error, "write to another disk")
        if isinstance(full, DiskFullError):
            return full
    return error


def _row(job: Job, error: BaseException) -> SubjectRecord:
    """The row of a subject that ended in an error."""
    why = reason_of(error)
    if isinstance(error, FemprepError):
        return _failed(job, why, " ".join(str(error).split()), error.exit_status)
    if isinstance(error, MemoryError):
        return _failed(job, why, f"memory ran out {error}".strip(), 3)
    write_failure(job.out, job.subject.name, "".join(traceback.format_exception(error)))
    return _failed(job, why, " ".join(f"{type(error).__name__}: {error}".split()), 3)


def _failed(job: Job, why: Reason, words: str, status: int) -> SubjectRecord:
    subject = job.subject
    return SubjectRecord(
        subject=subject.name,
        kind=subject.kind,
        status=why.status if why.status == "set aside" else "refused" if status == 2 else "failed",
        exit_status=status,
        reason=why.code,
        message=words,
        images=[image.name for image in subject.images],
    )
