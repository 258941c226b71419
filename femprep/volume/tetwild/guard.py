"""A surface and parameters in, fTetWild's tetrahedra out: run in a child process with limits of time and memory.

Whatever happens to the child (crash, hang, too much memory) becomes one line; whatever happens to this process, the
child does not outlive it.

- An exception in this thread, Ctrl-C and one raised by ``progress`` included, kills the child and removes its folder.
- When this process is killed outright, SIGKILL included: on Linux the kernel kills the child at once
  (``PR_SET_PDEATHSIG``). Everywhere a watchdog process, which waits for the end of a pipe that this process holds
  open, kills the child if need be and removes its folder.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.spawn import get_executable
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
import numpy.typing as npt

from femprep.errors import DiskFullError, MissingDependencyError, ResourceError, StageError, cannot_write
from femprep.model import FloatArray, IntArray
from femprep.volume.room import REMEDY, is_full, require_room, temporary

#: The script the child runs.
WORKER: Final = Path(__file__).with_name("worker.py")

#: Exit status of the child where no room is left for its result, as the script has it.
NO_ROOM: Final = 75

#: Seconds between two looks at the child.
PULSE: Final = 0.2
#: The time limit is of processor time, so that other work on the machine fails no run. A child that hangs uses next to
#: none: it is ended after so many times as long by the clock, where it used less than that share of it, and by its own
#: timer, whatever it used, much later.
_PATIENCE: Final = 5.0
_IDLE: Final = 0.02
_LATEST: Final = 100.0

#: Reads the child's number from a pipe until the pipe ends, which is when the process that holds it does.
_WATCHDOG = """
import os, shutil, signal, sys, time
signal.signal(signal.SIGINT, signal.SIG_IGN)
pids = [int(line) for line in sys.stdin.buffer]
for pid in pids:
    try:
        os.kill(pid, getattr(signal, "SIGKILL", signal.SIGTERM))
    except OSError:
        pass
for _ in range(100):
    shutil.rmtree(sys.argv[1], ignore_errors=True)
    if not os.path.exists(sys.argv[1]):
        break
    time.sleep(0.1)
"""


class RunError(StageError):
    """The mesher gave nothing.

    Attributes
    ----------
    seconds, processor_seconds : float or None
        What the run took all the same, where that is known: by the clock, and of the processor.
    """

    seconds: float | None = None
    processor_seconds: float | None = None

    def after(self, seconds: float, processor_seconds: float) -> Self:
        """The same error, with what the run took."""
        self.seconds, self.processor_seconds = seconds, processor_seconds
        return self


class TooLongError(RunError):
    """The mesher was ended by its time limit."""


@dataclass(frozen=True)
class TetwildRun:
    """What one run of the mesher gave.

    Attributes
    ----------
    points : (n, 3) array
        mm.
    cells : (m, 4) array
        Tetrahedra in VTK's order.
    seconds : float
        Wall-clock time of the child.
    peak_bytes : int or None
        Its peak memory, where the system tells.
    processor_seconds : float
        Its processor time, which other work on the machine does not lengthen.
    """

    points: FloatArray
    cells: IntArray
    seconds: float
    peak_bytes: int | None
    processor_seconds: float


def run_tetwild(
    points: FloatArray,
    triangles: IntArray,
    settings: Mapping[str, Any],
    *,
    arrays: Mapping[str, npt.NDArray[Any]] | None = None,
    time_limit: float,
    memory_limit: float,
    least_room: float = 0.0,
    pulse: Callable[[float], None] | None = None,
) -> TetwildRun:
    """Run fTetWild once, in a child process.

    Parameters
    ----------
    points : (n, 3) array
    triangles : (m, 3) array
        A surface that has been validated: fTetWild checks nothing.
    settings : mapping
        Further arguments of ``pytetwild.tetrahedralize``.
    arrays : mapping of str to array, optional
        Those of its arguments that are arrays.
    time_limit : float
        Processor time, s, where the system tells (Linux); five times as much by the clock for a child that is idle.
    memory_limit : float
        GB; watched while it runs on Linux.
    least_room : float
        Bytes without which in the folder for temporary files nothing is begun.
    pulse : callable, optional
        Called with the seconds gone, about five times a second; what it raises ends the run.

    Raises
    ------
    TooLongError
        The mesher ran into the time limit.
    RunError
        It crashed, or failed.
    ResourceError
        It took more memory than the limit.
    MissingDependencyError
        pytetwild cannot be imported.
    DiskFullError
        The folder for temporary files is full.
    FileError
        There is none that can be written.
    """
    start = time.perf_counter()
    with _watched_folder() as (name, watchdog):
        folder = Path(name)
        content: dict[str, Any] = {"points": points, "triangles": triangles, **(arrays or {})}
        require_room(folder, least_room + sum(np.asarray(array).nbytes for array in content.values()))
        try:
            np.savez(folder / "input.npz", settings=json.dumps(dict(settings)), **content)
            log = (folder / "log.txt").open("wb")
        except OSError as error:
            raise cannot_write(temporary(folder), error, REMEDY) from None
        with log:
            # -P keeps the script's own folder off the import path; this process' path goes to the child as it is.
            child = subprocess.Popen(
                [os.fsdecode(get_executable()), "-P", str(WORKER), name, str(os.getpid()), str(_LATEST * time_limit)],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                cwd=name,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
            )
            try:
                watch(watchdog, child.pid)
                used = _wait(child, start, time_limit, memory_limit, pulse)
            finally:
                child.kill()
                child.wait()
        seconds = time.perf_counter() - start
        if child.returncode == NO_ROOM or (child.returncode != 0 and is_full(folder)):
            raise DiskFullError(f"{temporary(folder)} became full while the mesher ran; free some space, or {REMEDY}")
        _require_success(child.returncode, seconds, used, _last_line(folder / "log.txt"))
        with np.load(folder / "output.npz") as data:
            record = json.loads(str(data["record"]))
            return TetwildRun(
                np.asarray(data["points"], dtype=np.float64),
                np.asarray(data["cells"], dtype=np.int64),
                seconds,
                record["peak_bytes"],
                record["processor_seconds"],
            )


@contextmanager
def _watched_folder() -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A temporary folder that goes when the block ends, or when this process does, and the watchdog that sees to it."""
    try:
        made = tempfile.TemporaryDirectory(prefix="femprep-tetwild-", ignore_cleanup_errors=True)
    except OSError as error:
        raise cannot_write("a temporary folder", error, REMEDY) from None
    with made as name:
        watchdog = start_watchdog(name)
        try:
            yield name, watchdog
        finally:
            watchdog.kill()
            watchdog.wait()
            if watchdog.stdin is not None:
                watchdog.stdin.close()


def start_watchdog(folder: str) -> subprocess.Popen[bytes]:
    """Start a process that removes a folder when this process ends: it reads a pipe that only this process holds open.

    Signals to this process's group, as a terminal sends them, do not reach it.
    """
    return subprocess.Popen(
        [os.fsdecode(get_executable()), "-I", "-S", "-c", _WATCHDOG, folder],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def watch(watchdog: subprocess.Popen[bytes], pid: int) -> None:
    """Have a watchdog kill the process ``pid`` first."""
    if watchdog.stdin is not None:
        watchdog.stdin.write(f"{pid}\n".encode())
        watchdog.stdin.flush()


def _wait(
    child: subprocess.Popen[bytes],
    start: float,
    time_limit: float,
    memory_limit: float,
    pulse: Callable[[float], None] | None,
) -> float:
    """Wait for the child, watching its time and memory; the processor time it had used when last looked at, s."""
    used = 0.0
    while True:
        try:
            child.wait(timeout=PULSE)
            return used
        except subprocess.TimeoutExpired:
            pass
        gone, used = time.perf_counter() - start, _processor_seconds(child.pid) or used
        hangs = gone > _PATIENCE * time_limit and used < _IDLE * gone
        if used > time_limit or hangs:
            raise TooLongError(
                f"the mesher did not finish within {time_limit:g} s; "
                "choose a larger edge_length, a larger stop_energy or a longer time_limit"
            ).after(gone, used)
        held = _resident_gigabytes(child.pid)
        if held is not None and held > memory_limit:
            raise ResourceError(
                f"the mesher took {held:.1f} GB, more than {memory_limit:g} GB (option memory_limit); "
                "choose a larger edge_length or a larger memory_limit"
            )
        if pulse is not None:
            pulse(gone)


def _resident_gigabytes(pid: int) -> float | None:
    """Memory a process holds, where the system tells (Linux)."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    except (OSError, IndexError, ValueError):
        return None
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e9


def _processor_seconds(pid: int) -> float | None:
    """Processor time a process has used, where the system tells (Linux)."""
    try:
        # The name, which may hold blanks, ends with the last parenthesis; user and system time are fields 14 and 15.
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    except (OSError, IndexError, ValueError):
        return None


def _require_success(status: int, seconds: float, used: float, last: str) -> None:
    """Turn the child's exit status into an error, if it is one."""
    if status == 0:
        return
    if status < 0:
        try:
            cause = f"was ended by {signal.Signals(-status).name}"
        except ValueError:
            cause = f"was ended by signal {-status}"
    elif status > 0xFFFF:
        cause = f"crashed with status {status:#x}"
    elif "pytetwild" in last and ("ModuleNotFoundError" in last or "ImportError" in last):
        raise MissingDependencyError(f"pytetwild cannot be imported ({last}); install it with pip install pytetwild")
    else:
        cause = f"failed with status {status}"
    detail = f": {last}" if last else ""
    raise RunError(
        f"the mesher {cause} after {seconds:.1f} s{detail}; choose another edge_length or envelope, or remesh the wall"
    ).after(seconds, used)


def _last_line(path: Path) -> str:
    """Last line that is not empty of what the child printed, cut to 200 characters."""
    lines = [line.strip() for line in path.read_text(encoding="utf-8", errors="replace").splitlines() if line.strip()]
    return lines[-1][:200] if lines else ""
