"""Small cohorts of phantoms, the command that meshes them, and what of its folders has to be the same byte for byte."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

from femprep.image import write_segmentation
from femprep.phantoms import lv_ellipsoid

#: What is begun in the background may have been told to pass over Ctrl-C; spawned workers begin with what follows, too.
_START = """
import signal, sys
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)
    from femprep.cli import main
    sys.exit(main())
"""
#: A swept mesh of a phantom with surfaces of 300 vertices takes a second or two.
OPTIONS = ("--preset", "acdc", "--mesher", "sweep", "--edge-length", "6", "--vertices", "300")
#: What a process does that opens an image of one of these names; see ``trap``.
TRAPS = """
import os, signal, sys, time

def trap(event, arguments):
    name = os.path.basename(str(arguments[0])) if event == "open" and arguments else ""
    if name == "crash.nii.gz":
        os.kill(os.getpid(), signal.SIGSEGV)
    elif name == "slow.nii.gz":
        time.sleep(600)
    elif name == "hog.nii.gz":
        held = b"\\1" * 2_500_000_000
        time.sleep(600)
        print(len(held))

sys.addaudithook(trap)
"""


class Quiet(NamedTuple):
    """A cohort that nothing disturbed: label maps, the folder made of them, exit status, what the command said."""

    source: Path
    out: Path
    status: int
    said: str


def phantoms(folder: Path, count: int = 3, bad: bool = True) -> Path:
    """A folder of label maps of as many hearts, each another, and of one that is none."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(count):
        endo = (24.0 + number, 24.0 + number, 56.0 + 2 * number)
        epi = (endo[0] + 9.0, endo[1] + 9.0, endo[2] + 9.0)
        seg = lv_ellipsoid(endo=endo, epi=epi).segmentation(spacing=(1.6, 1.6, 8.0))
        write_segmentation(seg, folder / f"heart{number}.nii.gz")
    if bad:
        (folder / "none.nii.gz").write_text("no image")
    return folder


def trap(folder: Path) -> dict[str, str]:
    """An environment in which Python dies, waits or takes memory where it opens an image that is called so."""
    folder.mkdir(exist_ok=True)
    (folder / "sitecustomize.py").write_text(TRAPS)
    return environment(str(folder))


def environment(*before: str) -> dict[str, str]:
    """This process' environment, its import path, and folders before it."""
    path = os.pathsep.join([*before, *(entry for entry in sys.path if entry)])
    return {**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"}


def command(
    source: Path, out: Path, *more: str, workers: int | None = 2, options: Iterable[str] = OPTIONS
) -> list[str]:
    """The command of a cohort."""
    number = () if workers is None else ("--workers", str(workers))
    return [sys.executable, "-c", _START, "cohort", str(source), "-o", str(out), "-q", *options, *number, *more]


def run(source: Path, out: Path, *more: str, **keywords: object) -> subprocess.CompletedProcess[str]:
    """Run a cohort to its end."""
    workers, options = keywords.pop("workers", 2), keywords.pop("options", OPTIONS)
    env = keywords.pop("env", None) or environment()
    made = command(source, out, *more, workers=workers, options=options)  # type: ignore[arg-type]
    return subprocess.run(made, env=env, capture_output=True, text=True, timeout=900)  # type: ignore[call-overload]


def rows(out: Path) -> dict[str, dict[str, object]]:
    """Rows of ``cohort.json`` by subject."""
    return {row["subject"]: row for row in json.loads((out / "cohort.json").read_text())["subjects"]}


def comparable(out: Path, without: Iterable[str] = ()) -> dict[str, bytes]:
    """Every file of a cohort that has to be the same whatever happened on the way.

    Apart are the pages and ``timings.tsv``, which tell dates and seconds, and of ``run.json`` the date, the seconds of
    stages and the hashes of pages.
    """
    found = {}
    for path in sorted(out.rglob("*")):
        name = path.relative_to(out).as_posix()
        if not path.is_file() or name.startswith(".cohort/") or path.suffix == ".html" or name == "timings.tsv":
            continue
        content = path.read_bytes()
        if path.name == "run.json":
            record = json.loads(content)
            for stage in record.get("stages", ()):
                del stage["seconds"]
            record.pop("date", None)
            for page in [file for file in record["sha256"] if file.endswith((".html", "run.json"))]:
                del record["sha256"][page]
            content = json.dumps(record).encode()
        found[name] = content
    return {name: content for name, content in found.items() if name not in without}


def left_behind(out: Path) -> list[str]:
    """Whatever a cohort's folder holds that is neither a table, a page, nor a whole folder of a subject."""
    known = {".cohort", "cohort.tsv", "cohort.json", "cohort.html", "timings.tsv"}
    return [
        entry.name
        for entry in out.iterdir()
        if entry.name not in known and not ((entry / "run.json").is_file() and not entry.name.startswith("."))
    ]


def wait_for(true: Callable[[], bool], seconds: float = 300.0) -> None:
    """Wait until something holds.

    Raises
    ------
    TimeoutError
        It does not within so many seconds.
    """
    end = time.monotonic() + seconds
    while not true():
        if time.monotonic() > end:
            raise TimeoutError(f"not within {seconds:g} s")
        time.sleep(0.05)
