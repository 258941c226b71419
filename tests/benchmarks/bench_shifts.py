"""Breath-hold shifts, estimated and corrected: on phantoms and a real heart shifted by known lengths, and on ACDC.

    python tests/benchmarks/bench_shifts.py known       phantoms, and Rodero 01 where FEMPREP_DATA is set
    python tests/benchmarks/bench_shifts.py surfaces    distance of fitted surfaces to the true ones
    python tests/benchmarks/bench_shifts.py acdc        zig-zag of centroids over all maps (FEMPREP_DATA)
    python tests/benchmarks/bench_shifts.py passed --every 5    swept left ventricles that pass, without and with shifts

Residuals are the shifts less their estimate, without their constant and their slope along the stack: a heart that is
moved or sheared as a whole looks like another heart.
"""

from __future__ import annotations

import argparse
import csv
import os
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

import femprep as fp
from femprep.image import Segmentation, read_segmentation
from femprep.model import FloatArray
from femprep.phantoms import Phantom, biventricular, lv_ellipsoid
from femprep.surface.alignment import align_slices, estimate_shifts

SPACING = (1.44, 1.44, 8.0)


def random_shifts(count: int, seed: int, share: float = 1.0) -> FloatArray:
    """In-plane shifts of 1 to 4 mm in any direction, of a share of the slices."""
    rng = np.random.default_rng(seed)
    angle, length = rng.uniform(0.0, 2.0 * np.pi, count), rng.uniform(1.0, 4.0, count)
    moved = rng.random(count) < share
    return np.where(moved, length, 0.0)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def shapeless(shift: FloatArray, index: FloatArray) -> FloatArray:
    """Shifts without their constant and their slope along the stack."""
    line = np.column_stack([np.ones(len(index)), index])
    return shift - line @ np.linalg.lstsq(line, shift, rcond=None)[0]


def pushed(seg: Segmentation, shifts: FloatArray) -> tuple[Segmentation, FloatArray]:
    """A label map whose slices are moved by whole pixels, close to the shifts asked for."""
    axis = seg.stack_axis
    flat = [a for a in range(3) if a != axis]
    pixels = np.rint(shifts / seg.grid.spacing[flat]).astype(int)
    planes = np.moveaxis(seg.labels, axis, 0)
    labels = np.stack([np.roll(plane, tuple(step), axis=(0, 1)) for plane, step in zip(planes, pixels)])
    return replace(seg, labels=np.moveaxis(labels, 0, axis)), pixels * seg.grid.spacing[flat]


def hearts() -> dict[str, Phantom]:
    """Phantoms, straight and bent, tilted in the stack."""
    return {
        "LV": lv_ellipsoid(),
        "LV and RV": biventricular(),
        "small LV and RV": biventricular((14, 14, 40), (24, 24, 48), (12, 36, 42), 14),
    }


def cases(seeds: int) -> Iterator[tuple[str, Segmentation, FloatArray]]:
    """Name, shifted label map and its shifts."""
    for name, phantom in hearts().items():
        for share in (0.0, 0.3, 1.0):
            for seed in range(seeds if share else 1):
                tilt = np.radians(4.0 * (seed % 3))
                turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
                grid = phantom.grid(SPACING, direction=turn, margin=(6, 6, 1))
                shifts = random_shifts(grid.shape[2], seed, share)
                yield f"{name}, {share:.0%} of slices", phantom.segmentation(grid=grid, shifts=shifts), shifts
    if data := os.environ.get("FEMPREP_DATA"):
        path = Path(data) / "rodero01" / "rodero01_sax_4ch_1.4x1.4x8_label.nii.gz"
        whole = read_segmentation(path, structures={"lv": 1, "myo": 2, "rv": 3})
        for share in (0.0, 0.3, 1.0):
            for seed in range(seeds if share else 1):
                seg, shifts = pushed(whole, random_shifts(whole.grid.shape[whole.stack_axis], seed, share))
                yield f"Rodero 01, {share:.0%} of slices", seg, shifts


def known(seeds: int) -> None:
    """Residual per slice before and after."""
    found: dict[str, list[tuple[FloatArray, FloatArray, float]]] = {}
    for name, seg, shifts in cases(seeds):
        shift = estimate_shifts(seg)
        true = shapeless(shifts[shift.index], shift.index)
        rest = shapeless(shifts[shift.index] - shift.shift, shift.index)
        found.setdefault(name, []).append((true, rest, shift.evidence))
    print(
        f"{'':34s}{'stacks':>7s}{'rms before':>12s}{'after':>8s}{'max before':>12s}{'after':>8s}{'believed':>10s}   mm"
    )
    for name, rows in found.items():
        before, after = (np.linalg.norm(np.concatenate([row[k] for row in rows]), axis=1) for k in range(2))
        believed = sum(row[2] >= 6.0 for row in rows)
        print(
            f"{name:34s}{len(rows):7d}{np.sqrt(np.mean(before**2)):12.2f}{np.sqrt(np.mean(after**2)):8.2f}"
            f"{before.max():12.2f}{after.max():8.2f}{believed:10d}"
        )


def surfaces(seeds: int) -> None:
    """Mean distance of boundary points' fitted surfaces to the true ones: what sub-pixel offsets are worth."""
    kinds = ("shifted", "pixels", "redrawn", "offsets")
    print(f"{'mean distance to the truth, mm':34s}{'unshifted':>11s}" + "".join(f"{kind:>9s}" for kind in kinds))
    for name, phantom in hearts().items():
        rows = []
        for seed in range(seeds):
            grid = phantom.grid(SPACING, margin=(6, 6, 1))
            shifts = random_shifts(grid.shape[2], seed)
            still, moved = (phantom.segmentation(grid=grid, shifts=s) for s in (None, shifts))
            offsets = align_slices(moved)
            pixels = replace(offsets, grid=offsets.grid.regular)
            maps = (still, moved, pixels, redrawn(offsets), offsets)
            rows.append([_distance(phantom, seg, seg is not still) for seg in maps])
        means = np.mean(rows, axis=0)
        print(f"{name:34s}" + "".join(f"{value:{11 if k == 0 else 9}.3f}" for k, value in enumerate(means)))


def redrawn(seg: Segmentation) -> Segmentation:
    """A map with offsets on a regular grid: each label interpolated linearly, the largest taken."""
    from scipy import ndimage

    out = np.zeros_like(seg.labels)
    for k, offset in enumerate(seg.grid.offset_at(np.arange(seg.grid.shape[2]))):
        step = offset[:2] / seg.grid.spacing[:2]
        parts = [ndimage.shift((seg.labels[:, :, k] == n).astype(float), step, order=1) for n in (0, *seg.present)]
        out[:, :, k] = np.array((0, *seg.present))[np.argmax(parts, axis=0)]
    return replace(seg, labels=out, grid=seg.grid.regular)


def _distance(phantom: Phantom, seg: Segmentation, moved: bool) -> float:
    """Mean distance of the LV's surface to the true one between first and last slice, best in-plane shear taken out."""
    from scipy.optimize import least_squares

    from femprep.surface import fit_surface

    surface = fit_surface(seg.object("lv"), vertices=600)
    height = surface.points[:, 2]
    inner = (height > height.min() + 8.0) & (height < height.max() - 8.0)
    points = surface.points[inner]

    def away(q: FloatArray) -> FloatArray:
        shear = np.column_stack([q[0] + q[1] * points[:, 2], q[2] + q[3] * points[:, 2], np.zeros(len(points))])
        return phantom.distance("lv", points - shear)

    rest = least_squares(away, np.zeros(4)).fun if moved else away(np.zeros(4))
    return float(np.abs(rest).mean())


def one_map(path: str) -> tuple[str, float, float, float, float]:
    """Evidence, largest shift and zig-zag before and after of one map."""
    shift = estimate_shifts(read_segmentation(path, preset="acdc"))
    return Path(path).name, shift.evidence, shift.largest, *shift.zigzag


def acdc(processes: int, out: Path | None) -> None:
    """Zig-zag over all maps."""
    paths = sorted(map(str, (Path(os.environ["FEMPREP_DATA"]) / "acdc").rglob("*_gt.nii.gz")))
    with ProcessPoolExecutor(processes) as pool:
        rows = list(pool.map(one_map, paths))
    if out:
        with out.open("w", newline="") as stream:
            csv.writer(stream).writerows([("map", "evidence", "largest", "zigzag", "after"), *rows])
    evidence, largest, before, after = (np.array([row[k] for row in rows]) for k in range(1, 5))
    moved = evidence >= 6.0
    print(f"{len(rows)} maps, {moved.sum()} corrected; largest shift {np.median(largest[moved]):.1f} mm in the median")
    for name, values in (("before", before), ("after", after)):
        above = ", ".join(f"{np.count_nonzero(values > limit)} above {limit} mm" for limit in (2, 5, 8))
        print(
            f"zig-zag {name:7s} mean {values.mean():5.2f} median {np.median(values):5.2f} "
            f"max {values.max():5.2f} mm; {above}"
        )
    for row in sorted(rows, key=lambda r: -r[2])[:12]:
        print(f"  {row[0]:34s} shift up to {row[2]:5.1f} mm, zig-zag {row[3]:5.1f} -> {row[4]:5.1f} mm")


def swept(path: str) -> list[str]:
    """What a swept left ventricle comes to, slices as they are and moved back."""
    found = []
    for moved in (False, True):
        options = fp.Options(volume={"mesher": "sweep"}, image={"correct_shifts": moved})
        try:
            quality = fp.mesh_segmentation(read_segmentation(path, preset="acdc"), options).quality
        except fp.FemprepError as error:
            found.append(f"refused: {error}")
            continue
        found.append("passed" if quality.passed else f"failed: {quality.failures[0]}")
    return [Path(path).name, *found]


def passed(processes: int, every: int, out: Path | None) -> None:
    """Counts over some maps."""
    paths = sorted(map(str, (Path(os.environ["FEMPREP_DATA"]) / "acdc").rglob("*_gt.nii.gz")))[::every]
    with ProcessPoolExecutor(processes) as pool:
        rows = list(pool.map(swept, paths))
    if out:
        with out.open("w", newline="") as stream:
            csv.writer(stream).writerows([("map", "as they are", "moved back"), *rows])
    for column, name in ((1, "as they are"), (2, "moved back")):
        kinds = Counter(row[column].partition(":")[0] for row in rows)
        print(f"{len(rows)} maps, slices {name}: {', '.join(f'{n} {kind}' for kind, n in kinds.items())}")
    for row in rows:
        if row[1] != row[2]:
            print(f"  {row[0]}: {row[1][:90]} -> {row[2][:90]}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("known", "surfaces", "acdc", "passed"))
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--every", type=int, default=1, help="one in so many maps")
    parser.add_argument("--csv", type=Path)
    args = parser.parse_args()
    if args.what == "acdc":
        acdc(args.processes, args.csv)
    elif args.what == "passed":
        passed(args.processes, args.every, args.csv)
    else:
        (known if args.what == "known" else surfaces)(args.seeds)


if __name__ == "__main__":
    main()
