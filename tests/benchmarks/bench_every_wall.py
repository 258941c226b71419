"""A mesh for every accepted wall: hearts no training map shows, made from such maps, and thin phantoms; counts.

    FEMPREP_DATA=... python tests/benchmarks/bench_every_wall.py --count 40
    python tests/benchmarks/bench_every_wall.py --only phantom --count 10

Each heart is drawn from its number alone, so that one that fails can be run again (``--first 17 --count 1``): a map or
an ellipsoid, whose cavity is dilated into the wall until as little as a pixel of it is left, whose slices are shifted
by some millimetres each, or both. "Accepted" are hearts that no stage refuses with status 2. Where the wall is thinner
on average than edges are long, they are as long as the refusal advises. Seconds are of the processor, those of attempts
of the mesher that gave nothing among them: of the run that ended with a mesh, and with the runs that were refused for
their edges before it.
"""

from __future__ import annotations

import argparse
import os
import re
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rows import keep, shown
from scipy.ndimage import distance_transform_edt

import femprep as fp
from femprep.image import Segmentation
from femprep.phantoms import lv_ellipsoid

#: What is left of a wall at least, pixels, and the farthest a slice is shifted, mm.
LEAST, SHIFT = (1.0, 3.0), 4.0


def heart(number: int, only: str | None) -> tuple[str, Segmentation]:
    """The heart of a number, and words for it."""
    rng = np.random.default_rng(number)
    kind = only or ("phantom" if number % 4 == 3 else "map")
    if kind == "phantom":
        thickness, slim = rng.uniform(1.2, 4.0), rng.uniform(14.0, 32.0)
        endo = (slim, slim * rng.uniform(0.9, 1.1), rng.uniform(1.6, 2.6) * slim)
        epi = tuple(axis + thickness for axis in endo)
        body = lv_ellipsoid(endo, epi, 0.35 * endo[2])  # type: ignore[arg-type]
        return f"ellipsoid {thickness:.1f} mm", body.segmentation(spacing=(1.0, 1.0, 6.0))
    data = Path(os.environ["FEMPREP_DATA"]) / "acdc" / "training"
    maps = sorted(data.glob("*/*_gt.nii.gz"))
    path = maps[int(rng.integers(len(maps)))]
    seg = fp.read_segmentation(path, preset="acdc")
    words = path.name.removesuffix("_gt.nii.gz")
    change = int(rng.integers(3))
    if change != 1:
        left = rng.uniform(*LEAST)
        seg, words = dilated(seg, left), f"{words}, wall {left:.1f} pixels"
    if change != 0:
        far = rng.uniform(1.0, SHIFT)
        seg, words = shifted(seg, far, rng), f"{words}, slices within {far:.1f} mm"
    return words, seg


def dilated(seg: Segmentation, left: float) -> Segmentation:
    """The cavity grown into the wall slice by slice until so many pixels of the wall are left."""
    labels = np.moveaxis(np.array(seg.labels), seg.grid.stack_axis, 0)
    (lv,), (myo,) = seg.structures["lv"], seg.structures["myo"]
    for plane in labels:
        inside = (plane == lv) | (plane == myo)
        if (plane == lv).any():
            plane[inside & (distance_transform_edt(inside) > left)] = lv
    return replace(seg, labels=np.ascontiguousarray(np.moveaxis(labels, 0, seg.grid.stack_axis)))


def shifted(seg: Segmentation, far: float, rng: np.random.Generator) -> Segmentation:
    """Each slice shifted in its plane by whole pixels, up to so far, mm."""
    axis = seg.grid.stack_axis
    labels = np.moveaxis(np.array(seg.labels), axis, 0)
    spacing = np.delete(seg.grid.spacing, axis)
    for plane in labels:
        steps = np.round(rng.uniform(-far, far, 2) / spacing).astype(int)
        plane[:] = np.roll(plane, tuple(steps), (0, 1))
    return replace(seg, labels=np.ascontiguousarray(np.moveaxis(labels, 0, axis)))


def one(number: int, edge: float, vertices: int, only: str | None) -> dict[str, Any]:
    """Mesh one heart; how it ended."""
    words, seg = heart(number, only)
    row: dict[str, Any] = {"number": number, "heart": words}
    start = time.process_time()
    size = edge
    for _ in range(3):
        last = time.process_time()
        try:
            run = fp.mesh_segmentation(seg, preset="acdc", surface={"vertices": vertices}, volume={"edge_length": size})
        except fp.OptionError as error:
            row.update(status="refused", outcome=str(error))
            advised = re.search(r"choose at most ([\d.]+)", str(error))
            if advised:
                size = float(advised[1])
                continue
        except fp.InputError as error:
            row.update(status="refused", outcome=str(error))
        except fp.FemprepError as error:
            row.update(status="without a mesh", outcome=str(error))
        else:
            info, measures = run.mesh.info, run.quality.measures
            runs = info["attempts"]
            way = "swept" if info["mesher"] == "sweep" else runs[-1]["way"]
            row.update(status="meshed", way=way, runs=len(runs), elements=run.mesh.n_cells)
            row["seconds_mesher"] = sum(entry.get("processor_seconds", 0.0) for entry in runs)
            row["dihedral"] = measures["minimum_dihedral"].min
            row["mean_ratio"] = measures["mean_ratio"].mean
            row["thinnest"] = run.wall.info["thickness"]["minimum_mm"] if "thickness" in run.wall.info else ""
            row["outcome"] = "; ".join(told(entry) for entry in runs)
        row["edge"] = size
        break
    end, mesher = time.process_time(), row.get("seconds_mesher", 0.0)
    row.update(seconds_run=end - last + mesher, seconds=end - start + mesher)
    return row


def told(run: dict[str, Any]) -> str:
    """One run of the mesher in words: what came of it, and what of it was asked."""
    seconds = f"{run['processor_seconds']:.1f} s" if "processor_seconds" in run else "no seconds told"
    return f"{run['status']} in {seconds} ({run['way']}, stop energy {run['stop_energy']:g})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0, help="number of the first heart")
    parser.add_argument("--count", type=int, default=1000, help="hearts to run")
    parser.add_argument("--edge", type=float, default=3.0, help="edge length, mm")
    parser.add_argument("--vertices", type=int, default=500, help="of each surface")
    parser.add_argument("--only", choices=("phantom", "map"), help="kind of heart")
    parser.add_argument("--csv", type=Path, help="file for a line per heart")
    given = parser.parse_args()
    one(3, given.edge, given.vertices, "phantom")  # no kernel is compiled while the clock runs
    rows = []
    for number in range(given.first, given.first + given.count):
        rows.append(one(number, given.edge, given.vertices, given.only))
        print(shown(rows[-1]), flush=True)
        if given.csv:
            keep(rows, given.csv)
    accepted = [row for row in rows if row["status"] != "refused"]
    without = [row for row in accepted if row["status"] == "without a mesh"]
    print(f"\n{len(rows)} hearts, {len(accepted)} accepted, {len(without)} of them without a mesh")
    for way, count in Counter(row["way"] for row in accepted if "way" in row).most_common():
        print(f"{count:5d}  {way}")
    for words, key in (("of the run that ended with it", "seconds_run"), ("with refused ones before it", "seconds")):
        seconds = np.array([row[key] for row in accepted])
        if len(seconds):
            median = float(np.median(seconds))
            print(f"processor seconds {words}: median {median:.1f}, slowest {seconds.max():.1f}, ", end="")
            print(f"{np.count_nonzero(seconds > 5.0 * median)} beyond five times the median")
    for row in without:
        print(f"  {row['number']}: {row['heart']}: {row['outcome']}")


if __name__ == "__main__":
    main()
