"""A case in; what came of it out: run in a child process of its own, within a time, and held to the contract."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

from fuzz.common import Case
from fuzz.stands import little_of_the_labels

#: Processor seconds a command may take, of a child and its children: where it meshes, and where it only reads.
LIMITS = {True: 200.0, False: 40.0}
#: Address space a command may take, bytes.
MEMORY = 8 * 2**30
#: The file that shows that a folder is there whole, by command.
_RECORDS = {"mesh": "run.json", "surface": "run.json", "annotate": "run.json", "cohort": "cohort.json"}
_TICK = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Outcome:
    """What came of a case.

    Attributes
    ----------
    kind, number, what
        Of the case.
    status : int
        Exit status; negative the signal that ended it.
    seconds : float
        Of the processor.
    line : str
        Last line of standard error.
    fault : str
        How it fell short of the contract; empty where it did not.
    meshes : bool
        Of the case: whether it may come to meshing.
    """

    kind: str
    number: int
    what: str
    status: int
    seconds: float
    line: str
    fault: str
    meshes: bool = False

    def record(self) -> dict[str, object]:
        """As JSON has it."""
        return asdict(self)


def run(case: Case, folder: Path) -> Outcome:
    """Run a case in its folder, in a fork of this process, which has loaded what it needs."""
    (folder / "tmp").mkdir()
    before = {path.name for path in folder.iterdir()}
    there = _exists(folder, case.out)
    said, printed = folder / "stderr", folder / "stdout"
    child = os.fork()
    if child == 0:
        _command(case, folder, said, printed)
    status, seconds, late = _wait(child, LIMITS[case.meshes])
    alive = _living(child)
    for pid in alive:
        os.kill(pid, signal.SIGKILL)
    text = said.read_text(errors="replace") if said.exists() else ""
    lines = [line for line in text.splitlines() if line.strip()]
    left = sorted({path.name for path in folder.iterdir()} - before - {"stderr", "stdout", case.out or "stdout"})
    if status in (0, 1):  # a deck may have files beside it
        left = [name for name in left if not name.startswith(("out.", "out_"))]
    made = not there and _exists(folder, case.out)
    fault = _fault(case, folder, status, lines, left, late, alive, made)
    said_last = lines[-1] if lines else ""
    return Outcome(case.kind, case.number, case.what, status, round(seconds, 2), said_last, fault, case.meshes)


def _exists(folder: Path, out: str) -> bool:
    try:
        return bool(out) and os.path.lexists(folder / out)
    except ValueError:  # a null in the name
        return False


def _command(case: Case, folder: Path, said: Path, printed: Path) -> None:
    """What the child does; it does not return."""
    status = 70
    try:
        os.setsid()
        os.chdir(folder)
        os.environ["TMPDIR"] = str(folder / "tmp")
        for number, path in ((1, printed), (2, said)):
            os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        sys.stdout, sys.stderr = os.fdopen(1, "w", closefd=False), os.fdopen(2, "w", closefd=False)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        import tempfile

        tempfile.tempdir = None
        from femprep.cli import main

        status = main(case.arguments)
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(status & 255)


def _wait(child: int, limit: float) -> tuple[int, float, bool]:
    """Exit status and processor seconds of a child; whether it had to be ended."""
    late, start, spent, looked = False, time.monotonic(), 0.0, 0.0
    while True:
        pid, status, usage = os.wait4(child, os.WNOHANG)
        if pid:
            return os.waitstatus_to_exitcode(status), usage.ru_utime + usage.ru_stime, late
        if time.monotonic() - start - looked > 1.0:  # to look through all processes costs more than most commands
            looked = time.monotonic() - start
            spent = sum(_seconds(one) for one in _session(child))
        if spent > limit or time.monotonic() - start > 20.0 * limit:  # a busy machine gives little
            late = True
            for one in _session(child):
                os.kill(one, signal.SIGKILL)
        time.sleep(0.01 if spent < 1.0 else 0.1)


def _living(leader: int) -> list[int]:
    """Children that live on five seconds after the command has ended."""
    alive, start = [pid for pid in _session(leader) if pid != leader], time.monotonic()
    while alive and time.monotonic() - start < 5.0:
        time.sleep(0.1)
        alive = [pid for pid in _session(leader) if pid != leader]
    return alive


def _stat(pid: int) -> list[str]:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return []


def _seconds(pid: int) -> float:
    return sum(map(int, _stat(pid)[11:15])) / _TICK


def _session(leader: int) -> list[int]:
    """Processes of the session that a child began, but those that have ended."""
    numbers = [int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit()]
    return [pid for pid in numbers if (row := _stat(pid)) and int(row[3]) == leader and row[0] != "Z"]


def _fault(
    case: Case,
    folder: Path,
    status: int,
    lines: list[str],
    left: list[str],
    late: bool,
    alive: list[int],
    made: bool,
) -> str:
    """The first way in which the contract was not kept; empty where it was."""
    errors = [line for line in lines if line.startswith("femprep: error: ")]
    record = _RECORDS.get(case.arguments[0])
    whole = made and (record is None or (folder / case.out / record).is_file())
    if late:
        return "no answer in time"
    if status < 0:
        return f"ended by signal {-status}"
    if any("Traceback" in line for line in lines):
        return "a traceback on the screen"
    if any(name.startswith("femprep-crash-") for name in left):
        return "nobody foresaw it"
    if alive:
        return "a child lives on"
    if status not in (0, 1, 2, 3):
        return f"status {status}"
    if status in (0, 1) and case.out and not whole:
        return f"status {status} without what it makes"
    if status in (2, 3) and len(errors) != 1:
        return f"{len(errors)} lines say what is wrong"
    if status in (2, 3) and len(lines) != 1:
        return f"{len(lines)} lines where one should be"
    if status in (2, 3) and made:
        return "something half made"
    if left or any((folder / "tmp").iterdir()):
        return f"left behind: {', '.join([*left, *(p.name for p in (folder / 'tmp').iterdir())])}"
    if status == 0 and case.kind in ("labels", "real labels"):
        return little_of_the_labels(case.arguments, folder / case.out)
    return ""


def fresh(folder: Path) -> Path:
    """An empty folder of that name."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder
