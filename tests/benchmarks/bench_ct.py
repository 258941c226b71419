"""What a label map of a CT costs: seconds and greatest memory of reading it, its surfaces, and the whole way to a mesh.

Phantoms drawn at half a millimetre, as many voxels along each side as asked for::

    python tests/benchmarks/bench_ct.py 300 512

Each step runs in a process of its own, whose greatest resident memory is what is told; processor seconds are those of
the mesher too, which it starts.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

STEPS = ("read", "lv", "biv")


def draw(side: int, path: Path) -> None:
    """A biventricular phantom in the middle of a cube of half-millimetre voxels, which it fills to 0.9 at most."""
    import femprep as fp
    from femprep.phantoms import biventricular

    seg = biventricular().segmentation(spacing=(0.5, 0.5, 0.5))
    shape = np.array(seg.labels.shape)
    box = np.zeros((side, side, side), seg.labels.dtype)
    low = np.maximum((side - shape) // 2, 0)
    cut = np.maximum((shape - side) // 2, 0)
    part = seg.labels[tuple(slice(c, c + side) for c in cut)]
    box[tuple(slice(a, a + n) for a, n in zip(low, part.shape))] = part
    origin = seg.grid.to_world([cut - low])[0]
    fp.write_segmentation(
        fp.Segmentation(box, fp.Grid(box.shape, (0.5,) * 3, origin, seg.grid.direction), seg.structures), path
    )


def step(name: str, path: Path) -> None:
    """One step, and what it cost, as JSON."""
    import femprep as fp

    start = time.perf_counter()
    seg = fp.read_segmentation(path, preset="acdc")
    told = {}
    if name != "read":
        run = fp.mesh_segmentation(seg, anatomy=name, volume={"edge_length": 3.0})
        told = {
            "stages": {key: round(value, 1) for key, value in run.seconds.items()},
            "failures": list(run.quality.failures),
            "elements": run.mesh.n_cells,
        }
    seconds = time.perf_counter() - start
    own, children = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    busy = sum(one.ru_utime + one.ru_stime for one in (own, children))
    figures = {"seconds": round(seconds, 1), "processor_seconds": round(busy, 1)}
    print(json.dumps({**figures, "peak_gb": round(own.ru_maxrss / 1e6, 2), **told}))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sides", type=int, nargs="*", default=[300, 512])
    parser.add_argument("--step", choices=STEPS, help=argparse.SUPPRESS)
    parser.add_argument("--file", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.step:
        step(arguments.step, arguments.file)
        return
    with tempfile.TemporaryDirectory() as folder:
        for side in arguments.sides:
            path = Path(folder) / f"{side}.nii.gz"
            draw(side, path)
            print(f"## {side} x {side} x {side} voxels of .5 mm, {path.stat().st_size / 1e6:.1f} MB", flush=True)
            for name in STEPS:
                command = [sys.executable, __file__, "--step", name, "--file", str(path)]
                done = subprocess.run(command, capture_output=True, text=True, check=False)
                print(f"{name}: {done.stdout.strip() or done.stderr.strip().splitlines()[-1]}", flush=True)


if __name__ == "__main__":
    main()
