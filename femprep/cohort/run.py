"""Subjects in, a folder of each and the tables over all out; begun again, it goes on where it stopped."""

from __future__ import annotations

import asyncio
import uuid
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from femprep.cohort.cluster import connected, default_memory, default_workers, require_distributed
from femprep.cohort.done import is_done
from femprep.cohort.reasons import reason
from femprep.cohort.records import CohortRecord, SubjectRecord, Timing
from femprep.cohort.row import row_of_folder, timing_of_folder
from femprep.cohort.state import Note, clear_leftovers, only_one, read_note, replace_file
from femprep.cohort.subjects import Subject
from femprep.cohort.table import Table
from femprep.errors import DiskFullError, OptionError, StageError
from femprep.model import Progress
from femprep.options import Options
from femprep.report.page.cohort import cohort_page

#: A subject whose worker is lost before it is even begun is handed out again so often.
_HANDED_OUT: Final = 5


@dataclass(frozen=True)
class Cohort:
    """What became of a cohort.

    Attributes
    ----------
    record : CohortRecord
        What ``cohort.json`` holds.
    timings : list of Timing
        What each row took.
    """

    record: CohortRecord
    timings: list[Timing]


def run_cohort(
    subjects: Sequence[Subject],
    out: Path,
    options: Options,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    memory_limit: float | None = None,
    time_limit: float | None = None,
    fresh: bool = False,
    command: str = "",
    progress: Progress | None = None,
) -> Cohort:
    """Make the folder of every subject, and the tables over all.

    Parameters
    ----------
    subjects : sequence of Subject
    out : path
        Folder to make, or to go on in: a subject whose folder there has the input, options and version asked for is
        not made again.
    options : Options
        Those of all, for the record.
    workers : int, optional
        Processes of this machine; one for each core where not given.
    scheduler : str, optional
        Address of a scheduler that is there, in place of processes of this machine. Its workers see images and ``out``
        under the same names.
    memory_limit : float, optional
        GB that a worker and the mesher it runs may take; an even share of the machine where not given.
    time_limit : float, optional
        Seconds by the clock that a subject may take.
    fresh : bool
        Make all anew.
    command : str
        What was typed, for the page.
    progress : callable, optional
        Called with ``("cohort", fraction)``.

    Returns
    -------
    Cohort

    Raises
    ------
    OptionError, FileError, MissingDependencyError
        The scheduler does not answer, another cohort is at work in the folder, dask is not installed.
    DiskFullError
        There is no room; whole folders stay.
    StageError
        The scheduler went away.
    """
    require_distributed()
    if workers is not None and workers < 1:
        raise OptionError(f"--workers is {workers}; at least 1 is needed")
    if scheduler is not None and workers is not None:
        raise OptionError("--workers are processes of this machine, --scheduler has workers of its own; leave one out")
    count = workers or default_workers()
    if memory_limit is None and scheduler is None:
        memory_limit = default_memory(count)
    out = out.absolute()
    report = progress or (lambda stage, fraction: None)
    with only_one(out):
        table = Table(out, options, len(subjects))
        todo = []
        for subject in subjects:
            folder = out / subject.name
            if not fresh and is_done(subject, folder):
                table.keep(row_of_folder(subject, folder), timing_of_folder(subject, folder))
            else:
                todo.append(subject)
        at_work = ExitStack()
        # First of all: where nobody answers nothing is left behind.
        client = at_work.enter_context(connected(scheduler, min(count, len(todo)))) if todo else None
        try:
            with at_work:
                table.write()
                report("cohort", len(table) / len(subjects))
                if client is not None:
                    from femprep.cohort.work import Job

                    run = uuid.uuid4().hex
                    jobs = [Job(_absolute(one), out, run, fresh, time_limit, memory_limit) for one in todo]
                    _work(client, jobs, table, lambda: report("cohort", len(table) / len(subjects)))
        except KeyboardInterrupt:
            done = f"{len(table)} of {len(subjects)} subjects are done; the same command goes on"
            raise KeyboardInterrupt(done) from None
        finally:
            clear_leftovers(out)
            record = table.write()
            replace_file(out, "cohort.html", page(record, table.timings, out, command))
    return Cohort(record, table.timings)


def page(record: CohortRecord, timings: Sequence[Timing], out: Path, command: str = "") -> str:
    """The page of a cohort, from its records and the folders of its subjects."""
    return cohort_page(
        record.model_dump(mode="json"),
        [timing.model_dump() for timing in timings],
        [reason(code)._asdict() for code in record.reasons],
        {name: field.description or "" for name, field in SubjectRecord.model_fields.items()},
        out,
        title=out.name,
        command=command,
    )


def _absolute(subject: Subject) -> Subject:
    shown = tuple(image._replace(path=image.path.absolute()) for image in subject.shown)
    return replace(subject, images=tuple(image.absolute() for image in subject.images), shown=shown)


def _work(client: Any, jobs: Sequence[Any], table: Table, tell: Any) -> None:
    """Hand all jobs out and take their rows in as they end."""
    from distributed import as_completed

    from femprep.cohort.work import run_subject

    def hand_out(job: Any, number: int) -> Any:
        return client.submit(run_subject, job, key=f"femprep-{job.subject.name}-{job.run}-{number}", pure=False)

    with _scheduler_there(table):
        futures = {hand_out(job, 0): (job, 0) for job in jobs}
        waiting = as_completed(list(futures), loop=client.loop)
        for future in waiting:
            job, number = futures.pop(future)
            status = future.status
            if status == "cancelled":
                raise CancelledError
            if status == "lost":
                # Its worker died, by another subject, before the row was fetched: dask makes it anew.
                futures[future] = (job, number)
                waiting.add(future)
                continue
            outcome = _lost(job, number, future.exception()) if status == "error" else future.result()
            if outcome is None:
                again = hand_out(job, number + 1)
                futures[again] = (job, number + 1)
                waiting.add(again)
                continue
            future.release()
            table.add(outcome.record, outcome.timing)
            tell()
            if outcome.record.reason == "disk-full":
                raise DiskFullError(f"{outcome.record.message}; the same command goes on then")


@contextmanager
def _scheduler_there(table: Table) -> Iterator[None]:
    """Say in one line that the scheduler went away, however dask tells it: by a status or while a result is fetched."""
    from distributed.comm import CommClosedError

    try:
        yield
    except (CommClosedError, CancelledError, asyncio.CancelledError) as error:
        raise StageError(
            f"the scheduler went away, {len(table)} subjects are done; run the same command again, it goes on"
        ) from error


def _lost(job: Any, number: int, error: BaseException) -> Any:
    """The row of a job of which dask says that its workers died; None where it is to be handed out again.

    Dask counts those in line at a worker that died with the one it was at; only our notes tell which that was.
    """
    from distributed import KilledWorker

    from femprep.cohort.work import ATTEMPTS, set_aside

    note = read_note(job.out, job.subject.name, job.run)
    if isinstance(error, KilledWorker):
        if note.reason or note.attempts >= ATTEMPTS or number + 1 >= _HANDED_OUT:
            return set_aside(job, note)
        return None
    words = " ".join(f"the worker could not run it: {type(error).__name__}: {error}".split())
    return set_aside(job, Note(job.run, note.attempts, "worker-lost", words))
