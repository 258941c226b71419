"""What a cohort costs beside its subjects: seconds outside of stages, one worker against two, memory over many.

    python tests/benchmarks/bench_cohort.py stages [--maps FOLDER --pattern GLOB --count 8] [-- OPTIONS OF THE COHORT]
    python tests/benchmarks/bench_cohort.py workers [--count 8 ...]      an idle machine of two cores or more
    python tests/benchmarks/bench_cohort.py memory [--count 1000]

``stages``: a cohort with one worker; of each row, its seconds less the sum of its stages' in ``run.json``.

``workers``: the same cohort by one worker and by two, by the clock of the whole command, start-up and tables
included.

``memory``: phantoms drawn at random, of which closed surfaces of few vertices are made (``--surfaces``: the cheapest
job that there is; scheduler and client see of any job a message and a row of a table). Scheduler, client and worker are
processes of their own; what each holds (resident memory) is looked at every few seconds. Told is the slope of a
straight line through what was seen after the first fifth of the subjects, MB a thousand subjects, and the range.

Without ``--maps`` the first two run on phantoms.
"""

from __future__ import annotations

import argparse
import csv
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import psutil

import femprep as fp
from femprep.phantoms import lv_ellipsoid

#: Options of the cohorts of ``stages`` and ``workers`` where none are given, and of ``memory``.
OPTIONS = ("--preset", "acdc", "--mesher", "sweep", "--edge-length", "3", "--fibres")
CHEAP = ("--structure", "lv=3", "--vertices", "150", "--surfaces")
#: Seconds between two looks at the memory.
PULSE = 2.0
#: Subjects after which they are told.
STEP = 100


def phantoms(folder: Path, count: int, spacing: tuple[float, float, float] = (1.6, 1.6, 8.0), seed: int = 0) -> Path:
    """Label maps of left ventricles of random size, thickness and place."""
    draw = np.random.default_rng(seed)
    folder.mkdir()
    for number in range(count):
        radius, wall, length = draw.uniform(18.0, 32.0), draw.uniform(7.0, 12.0), draw.uniform(45.0, 65.0)
        heart = lv_ellipsoid((radius, radius, length), (radius + wall, radius + wall, length + wall))
        seg = heart.moved(origin=draw.uniform(-50.0, 50.0, 3)).segmentation(spacing=spacing)
        fp.write_segmentation(seg, folder / f"heart{number:04d}.nii.gz")
    return folder


def some_of(maps: Path, pattern: str, count: int, folder: Path) -> Path:
    """A table of some label maps of a folder, evenly spread."""
    found = sorted(maps.glob(pattern))
    chosen = [found[k] for k in np.unique(np.linspace(0, len(found) - 1, count).astype(int))]
    lines = [f"{path.name.partition('.')[0]}\t{path.resolve()}" for path in chosen]
    (folder / "subjects.tsv").write_text("subject\timage\n" + "\n".join(lines) + "\n")
    return folder / "subjects.tsv"


def command(source: Path, out: Path, *options: str) -> list[str]:
    """The command of a cohort."""
    return [sys.executable, "-m", "femprep", "cohort", str(source), "-o", str(out), "-q", "--fresh", *options]


def timings(out: Path) -> list[dict[str, float]]:
    """Rows of ``timings.tsv`` whose stages are known."""
    with (out / "timings.tsv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file, delimiter="\t") if row["stages_seconds"] != "n/a"]
    return [{"seconds": float(row["seconds"]), "stages": float(row["stages_seconds"])} for row in rows]


def stages(source: Path, folder: Path, options: list[str]) -> None:
    """Seconds of rows beside those of their stages."""
    subprocess.run(command(source, folder / "out", "--workers", "1", *options), check=False)
    rows = timings(folder / "out")
    outside = [row["seconds"] - row["stages"] for row in rows]
    middle = statistics.median(row["seconds"] for row in rows)
    print(f"{len(rows)} subjects, one worker; seconds of a subject: median {middle:.2f}")
    print(f"outside of its stages, s: median {statistics.median(outside):.3f}, most {max(outside):.3f}")


def workers(source: Path, folder: Path, options: list[str]) -> None:
    """The same cohort by one worker and by two."""
    took = {}
    for count in (1, 2):
        start = time.perf_counter()
        subprocess.run(command(source, folder / f"out{count}", "--workers", str(count), *options), check=False)
        took[count] = time.perf_counter() - start
        rows = timings(folder / f"out{count}")
        work = sum(row["seconds"] for row in rows)
        print(f"{count} worker(s): {len(rows)} subjects in {took[count]:.1f} s, {work:.1f} s of work")
    print(f"two workers: {took[1] / took[2]:.2f} times as quick, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")


@contextmanager
def dask() -> Iterator[tuple[str, psutil.Process, psutil.Process]]:
    """A scheduler and a worker: its address, and both processes."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = str(probe.getsockname()[1])
    address = f"tcp://127.0.0.1:{port}"
    run = [sys.executable, "-m"]
    begin = [*run, "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard"]
    work = [*run, "distributed.cli.dask_worker", address, "--nthreads", "1", "--memory-limit", "0", "--no-dashboard"]
    scheduler = subprocess.Popen(begin, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    worker = subprocess.Popen(work, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield address, psutil.Process(scheduler.pid), psutil.Process(worker.pid)
    finally:
        family = psutil.Process(worker.pid).children(recursive=True)
        for process in (worker, scheduler):
            process.kill()
            process.wait()
        for child in family:
            child.kill()


def memory(source: Path, folder: Path, count: int) -> None:
    """What scheduler, client and worker hold while many subjects are made."""
    out = folder / "out"
    seen: list[tuple[float, ...]] = []
    with dask() as (address, scheduler, nanny):
        asked = [*CHEAP, "--scheduler", address, "--memory-limit", "4"]
        client = subprocess.Popen(command(source, out, *asked))
        watched = {"scheduler": scheduler, "client": psutil.Process(client.pid)}
        while client.poll() is None:
            time.sleep(PULSE)
            done = sum(1 for _ in out.glob("heart*")) if out.is_dir() else 0
            try:
                held = {name: process.memory_info().rss / 1e6 for name, process in watched.items()}
                own = [child.memory_info().rss / 1e6 for child in nanny.children(recursive=True)]
            except psutil.Error:
                continue  # one of them has just ended
            if done and min(held.values()) > 0.0:  # a process that has ended holds nothing
                if done // STEP > (seen[-1][0] if seen else 0) // STEP:
                    told = ", ".join(f"{name} {value:.0f} MB" for name, value in held.items())
                    print(f"{done} subjects: {told}", flush=True)
                seen.append((done, held["scheduler"], held["client"], max(own, default=float("nan"))))
    table = np.array([row for row in seen if row[0] >= count / 5])
    print(f"{len(timings(out))} of {count} subjects, {len(table)} looks after the first fifth of them")
    for name, column in zip(("scheduler", "client", "worker"), table[:, 1:].T, strict=True):
        slope = np.polyfit(table[:, 0], column, 1)[0]
        print(
            f"{name}: {column.min():.0f} to {column.max():.0f} MB, slope {1000.0 * slope:+.1f} MB a thousand subjects"
        )


def main() -> None:
    """Read the arguments and measure."""
    own, _, options = " ".join(sys.argv[1:]).partition(" -- ")
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("stages", "workers", "memory"))
    parser.add_argument("--maps", type=Path)
    parser.add_argument("--pattern", default="**/*_gt.nii.gz")
    parser.add_argument("--count", type=int)
    asked = parser.parse_args(own.split())
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        if asked.what == "memory":
            count = asked.count or 1000
            memory(phantoms(folder / "in", count, (3.0, 3.0, 10.0)), folder, count)
            return
        count = asked.count or 8
        source = some_of(asked.maps, asked.pattern, count, folder) if asked.maps else phantoms(folder / "in", count)
        {"stages": stages, "workers": workers}[asked.what](source, folder, options.split() or list(OPTIONS))


if __name__ == "__main__":
    main()
