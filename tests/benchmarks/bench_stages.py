"""Seconds and peak memory of each stage of the main job; prints a table.

    python tests/benchmarks/bench_stages.py [IMAGE] [--preset acdc] [--edge 2.5 1.5] [--repeat 3] [--table no]

Without an image it runs on the phantom of ``femprep demo``. The first run of all, which compiles the kernels and fills
the stores, is not counted. Peak memory is that of this process (Linux), the mesher's child beside it.

In the table "volume" is without fTetWild, which stands by itself.

The line "everything but fTetWild" is the command ``femprep mesh`` as a whole, from its start to its end, start-up of
Python included, less the seconds that fTetWild's own process took (``--table no`` measures that line alone). It reads
modules as an installed package does, compiled by an earlier run, also where ``PYTHONDONTWRITEBYTECODE`` is set.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import femprep as fp

#: Formats each run writes beside the folder's own files.
FORMATS = ("abaqus", "dolfinx")


class Peaks:
    """A progress callable that notes the seconds and the peak memory of each stage."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.megabytes: dict[str, float] = {}
        self._start = 0.0

    def __call__(self, stage: str, fraction: float) -> None:
        if fraction == 0.0 and stage not in self.seconds:
            self._start = time.perf_counter()
            # Resets the high-water mark of this process's memory.
            Path("/proc/self/clear_refs").write_text("5")
            self.seconds[stage] = 0.0
        elif fraction == 1.0:
            self.seconds[stage] = time.perf_counter() - self._start
            self.megabytes[stage] = peak_memory()


def peak_memory() -> float:
    """High-water mark of this process's memory since it was last reset, MB."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return float(line.split()[1]) / 1024.0
    return float("nan")


def one_run(image: Path, preset: str, edge: float) -> tuple[Peaks, Any]:
    """The main job once, into a temporary folder."""
    peaks = Peaks()
    peaks("read", 0.0)
    seg = fp.read_segmentation(image, preset=preset)
    peaks("read", 1.0)
    run = fp.mesh_segmentation(seg, preset=preset, volume={"edge_length": edge}, formats=FORMATS, progress=peaks)
    with tempfile.TemporaryDirectory() as folder:
        fp.write_run(run, Path(folder) / "out", source=image, progress=peaks)
    return peaks, run


def whole_command(image: Path, preset: str, edge: float) -> tuple[float, float]:
    """Seconds of ``femprep mesh`` in a process of its own without those of fTetWild's, and its tetrahedra."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        program = [sys.executable, "-c", "import sys; from femprep.cli import main; sys.exit(main())"]
        command = [*program, "mesh", str(image), "-o", str(out), "--preset", preset, "--quiet"]
        command += ["--edge-length", str(edge), "--format", "abaqus", "--format", "dolfinx"]
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        start = time.perf_counter()
        done = subprocess.run(command, env=environment, check=False)
        seconds = time.perf_counter() - start
        if done.returncode not in (0, 1):
            raise SystemExit(f"femprep mesh ended with status {done.returncode}")
        volume = json.loads((out / "run.json").read_text(encoding="utf-8"))["details"]["volume"]
        cells = json.loads((out / "quality.json").read_text(encoding="utf-8"))["cells"]
    return seconds - sum(attempt["seconds"] for attempt in volume["attempts"]), sum(cells.values())


def report_command(image: Path, preset: str, edge: float, repeat: int) -> None:
    """Print what everything but fTetWild takes, the whole command."""
    runs = [whole_command(image, preset, edge) for _ in range(repeat)]
    seconds = sorted(run[0] for run in runs)
    print(
        f"\neverything but fTetWild, whole command with start-up, {edge:g} mm, {runs[-1][1]:.0f} tetrahedra: "
        f"{statistics.median(seconds):.2f} s (median of {repeat}, {seconds[0]:.2f} to {seconds[-1]:.2f})",
        flush=True,
    )


def mesher_seconds(run: Any) -> float:
    """What fTetWild's own process took."""
    return float(sum(attempt["seconds"] for attempt in run.mesh.info["attempts"]))


def main(arguments: list[str] | None = None) -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("image", nargs="?", type=Path)
    parser.add_argument("--preset", default="acdc")
    parser.add_argument("--edge", nargs="+", type=float, default=[2.5, 1.5])
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--table", choices=("yes", "no"), default="yes", help="whether to measure each stage too")
    given = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        image = given.image
        if image is None:
            from femprep.phantoms import lv_ellipsoid

            image = Path(folder) / "phantom.nii.gz"
            fp.write_segmentation(lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0)), image)
        whole_command(image, given.preset, 6.0)
        for edge in given.edge:
            report_command(image, given.preset, edge, given.repeat)
            if given.table == "no":
                continue
            runs = [one_run(image, given.preset, edge) for _ in range(given.repeat)]
            last = runs[-1][1]
            print(f"\n{image.name}, {edge:g} mm: {last.mesh.n_cells} tetrahedra, median of {given.repeat} runs\n")
            print("| stage | s | peak MB |\n|---|---|---|")
            for stage in runs[0][0].seconds:
                seconds = [peaks.seconds[stage] for peaks, _ in runs]
                if stage == "volume":  # what follows the mesher, run by run
                    seconds = [total - mesher_seconds(run) for total, (_, run) in zip(seconds, runs)]
                memory = statistics.median(peaks.megabytes[stage] for peaks, _ in runs)
                print(f"| {stage} | {statistics.median(seconds):.2f} | {memory:.0f} |")
            child = max(attempt["peak_bytes"] for attempt in last.mesh.info["attempts"]) / 2**20
            mesher = statistics.median(mesher_seconds(run) for _, run in runs)
            print(f"| fTetWild's child | {mesher:.2f} | {child:.0f} |")


if __name__ == "__main__":
    main()
