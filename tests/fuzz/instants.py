"""End runs into a folder at random instants, by SIGKILL and SIGINT, and count what was lost.

    python tests/fuzz/instants.py --instants 50 --seed 1

The folder holds an earlier run. After each end it must hold that one, or the new one, whole; no process may live on;
and the next run must come to its end and leave nothing beside the folder. Instants count from when Python has loaded
the command line: an interrupt before is Python's own to answer.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import femprep as fp
from femprep.phantoms import lv_ellipsoid
from femprep.report.manifest import hashes

#: What is begun in the background may have been told to pass over Ctrl-C.
_START = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from femprep.cli import main
print("begun", flush=True)
sys.exit(main())
"""


@dataclass
class Tried:
    """What came of the instants.

    Attributes
    ----------
    ended, late : int
        Runs that were ended, and those that were done all the same.
    lost : list of str
        What was not as it should be.
    """

    ended: int = 0
    late: int = 0
    lost: list[str] = field(default_factory=list)


def begin(heart: Path, out: Path, edge: float) -> subprocess.Popen[str]:
    """Begin a run in a session of its own; it has begun when this returns."""
    given = ["--preset", "acdc", "--mesher", "sweep", "--edge-length", f"{edge:g}", "--vertices", "300", "--quiet"]
    command = [sys.executable, "-c", _START, "mesh", str(heart), "-o", str(out), *given]
    env = {**os.environ, "TMPDIR": str(heart.parent)}
    pipe = subprocess.PIPE
    run = subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, start_new_session=True, env=env)
    assert run.stdout is not None
    run.stdout.readline()
    return run


def broken(out: Path) -> list[str]:
    """Files that are not what the record of their folder says."""
    record = json.loads((out / "run.json").read_bytes())["sha256"]
    found = hashes(out, [name for name in record if (out / name).is_file()])
    return [name for name, own in record.items() if found.get(name) != own]


def living(leader: int) -> list[int]:
    """Processes of a session."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                row = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            if int(row[3]) == leader and row[0] != "Z":
                found.append(int(entry.name))
    return found


def try_instants(folder: Path, instants: int, seed: int) -> Tried:
    """End as many runs, each at another instant, and look at what is there."""
    random, tried = np.random.default_rng(seed), Tried()
    heart, out = folder / "tmp" / "heart.nii.gz", folder / "made" / "out"
    for place in (heart.parent, out.parent):
        place.mkdir()
    fp.write_segmentation(lv_ellipsoid().segmentation((2.5, 2.5, 8.0)), heart)
    run = begin(heart, out, 8.0)
    start = time.monotonic()
    said = run.communicate()[1]
    if run.returncode or broken(out):
        raise RuntimeError(f"the first run is not whole: {run.returncode} {said}")
    whole = time.monotonic() - start
    for number in range(instants):
        there = {out, heart, *out.parent.iterdir(), *heart.parent.iterdir()}  # what the run killed before has left, too
        sent = (signal.SIGKILL, signal.SIGINT)[number % 2]
        run = begin(heart, out, 9.0 - number % 2)
        instant = float(random.uniform(0.0, whole))
        time.sleep(instant)
        run.send_signal(sent)
        said = run.communicate()[1]
        tried.ended += run.returncode in (-sent, 130)
        tried.late += run.returncode == 0  # done before, or while the signal was under way
        wrong = list(broken(out))
        deadline = time.monotonic() + 10.0
        while living(run.pid) and time.monotonic() < deadline:
            time.sleep(0.1)
        wrong += [f"process {pid}" for pid in living(run.pid)]
        if sent == signal.SIGINT:
            wrong += [path.name for path in (*out.parent.iterdir(), *heart.parent.iterdir()) if path not in there]
            wrong += ["a traceback"] * ("Traceback" in said)
        tried.lost += [f"{sent.name} at {instant:.2f} s of {whole:.2f}: {one}" for one in wrong]
    last = begin(heart, out, 8.5)
    said = last.communicate()[1]
    wrong = [*broken(out), *(path.name for path in out.parent.iterdir() if path != out)]
    tried.lost += [f"the next run: {one}" for one in (*wrong, *([said] if last.returncode else []))]
    return tried


def main() -> None:
    """Command line of this script."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--instants", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="instants-") as name:
        tried = try_instants(Path(name), given.instants, given.seed)
    print(
        f"{given.instants} instants: {tried.ended} runs ended, {tried.late} were done all the same; "
        f"lost: {len(tried.lost)}"
    )
    print("\n".join(tried.lost))


if __name__ == "__main__":
    main()
