"""A folder with ``input.npz`` in, ``output.npz`` in the same folder out: one run of fTetWild, in a process of its own.

Run as a script, never imported: ``python -P worker.py FOLDER PARENT TIME_LIMIT``. fTetWild may crash, holds
the interpreter's lock for the whole run, keeps static state and writes into the current folder.

This process must not outlive its parent. On Linux the kernel kills it when the parent ends, however that happens;
elsewhere the parent starts a watchdog (see ``guard``). Besides, a native timer ends it everywhere after the time limit.
"""

import ctypes
import errno
import faulthandler
import json
import os
import signal
import sys
import time
from pathlib import Path

_PR_SET_PDEATHSIG = 1
_GRACE = 10.0
#: Exit status where no room is left for the result, as ``guard`` has it.
_NO_ROOM = 75
_FULL = {errno.ENOSPC, errno.EFBIG, getattr(errno, "EDQUOT", errno.ENOSPC)}


def follow_parent(parent: int) -> None:
    """Ask the kernel to kill this process when the thread that started it ends (Linux)."""
    if sys.platform != "linux":
        return
    # The thread that started this process waits for it, so that its end is the end of the call.
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:  # it ended before the kernel was asked
        os._exit(1)


def peak_memory() -> int | None:
    """Greatest memory this process held, bytes; None where the system does not tell."""
    if sys.platform == "linux":
        # Not ru_maxrss: that carries over from the process this one was started from.
        for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
            if line.startswith("VmHWM:"):
                return 1024 * int(line.split()[1])
    if sys.platform == "darwin":
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return None


def main(folder: Path, parent: int, time_limit: float) -> None:
    """Read the input, run fTetWild, write its result."""
    follow_parent(parent)
    # Ctrl-C and faults act at once, without the interpreter, whose lock fTetWild holds.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    faulthandler.dump_traceback_later(time_limit + _GRACE, exit=True)
    os.chdir(folder)

    import numpy as np
    import pytetwild

    with np.load("input.npz") as data:
        given = {name: data[name] for name in data.files}
    Path("input.npz").unlink()  # little is left behind if both processes are killed
    settings = json.loads(str(given.pop("settings")))
    points, cells = pytetwild.tetrahedralize(
        given.pop("points"), given.pop("triangles").astype(np.uint32), vtk_ordering=True, **settings, **given
    )
    record = {"peak_bytes": peak_memory(), "processor_seconds": time.process_time()}
    for left in Path().glob("__*"):  # fTetWild leaves its surface, larger than what is written now
        left.unlink()
    # Written whole or not at all: the parent never sees half of it.
    try:
        np.savez("part.npz", points=points, cells=cells, record=json.dumps(record))
    except OSError as error:
        if error.errno in _FULL:
            sys.exit(_NO_ROOM)
        raise
    Path("part.npz").replace("output.npz")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]))
