"""The annulus of the mitral and the tricuspid valve, found from long-axis views, against the true one.

    python tests/benchmarks/bench_annulus.py                        phantoms, and Rodero 01 where FEMPREP_DATA is set
    python tests/benchmarks/bench_annulus.py --hearts rodero --seeds 0 1

Hearts are cut into a stack and three views as in bench_long_axis.py, once as they are, once displaced and moved back
(``align_slices``; the best translation of the whole, as the left cavity's surface shows it, removed). Printed are the
symmetric mean and the largest distance of the ring to the true one and the angle between their planes. True rings are

    biv       the rim of the left cavity in the base plane (its atrium has no label)
    saddle    where the left cavity's ellipsoid meets a saddle, with an atrium above
    rodero    the rim of the gap between ventricle and atrium in the map of 1 mm, which the leaflets leave
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

import numpy as np
from bench_long_axis import Heart, Scan, hearts, rodero, scan, to_world
from scipy.ndimage import distance_transform_edt

from femprep.errors import FemprepError
from femprep.image import read_segmentation
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import FloatArray
from femprep.surface import fit_surface
from femprep.surface.alignment import align_slices
from femprep.wall.planes.annulus import VALVES, find_annulus

#: Leaflets in Rodero's map leave a gap of so many mm between both cavities.
_GAP = 4.5


def saddle() -> tuple[Heart, dict[str, FloatArray]]:
    """The biventricular phantom with an atrium whose valve is a tilted saddle."""
    (heart,) = hearts(["biv"])

    def level(x: FloatArray, y: FloatArray) -> FloatArray:
        return 18.0 + 0.15 * x + 3.0 * (x * x - y * y) / 24.0**2

    def label(local: FloatArray) -> FloatArray:
        x, y, z = local.T
        inner, outer = ((local / axes) ** 2 for axes in ((25.0, 25.0, 60.0), (34.0, 34.0, 69.0)))
        found = heart.label(np.column_stack([x, y, np.minimum(z, 19.9)])) * (z < 19.9)
        found = np.where((outer.sum(axis=1) < 1.0), 2, np.where(found == 1, 1, 0))
        found[inner.sum(axis=1) < 1.0] = 3
        above = z > level(x, y)
        found[above & (found == 2)] = 6
        found[above & (found == 3)] = 5
        return found

    angle = np.radians(np.arange(0.0, 360.0, 2.0))
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * 23.0
    for _ in range(50):
        z = level(*ring.T)
        ring *= (25.0 * np.sqrt(1.0 - (z / 60.0) ** 2) / np.linalg.norm(ring, axis=1))[:, None]
    rings = {"mitral": np.column_stack([ring, level(*ring.T)])}
    parts = {"lv": (3,), "myo": (2,), "rv": (1,), "la": (5,)}
    return Heart("saddle", label, parts, heart.surfaces, {"lv": ("lv",)}), rings


def phantom_ring() -> FloatArray:
    """The rim of the biventricular phantom's left cavity."""
    angle = np.radians(np.arange(0.0, 360.0, 2.0))
    radius = 25.0 * np.sqrt(1.0 - (20.0 / 60.0) ** 2)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(len(angle), 20.0)])


def rodero_rings(data: Path, heart: Heart, first: Heart) -> dict[str, FloatArray]:
    """Rims of the gaps between cavities of the map of 1 mm, in the heart's own axes."""
    seg = read_segmentation(data / "rodero01" / "rodero01_4ch_1.0mm_label.nii.gz", structures={"lv": (1,)})
    rings = {}
    for valve, (one, other) in VALVES.items():
        numbers = [first.structures[name][0] for name in (one, other)]
        (near, i), (far, j) = (distance_transform_edt(seg.labels != n, return_indices=True) for n in numbers)
        gap = (seg.labels == 0) & (near + far <= _GAP)
        points = seg.grid.to_world(0.5 * (i[:, gap] + j[:, gap]).T)
        middle = points.mean(axis=0)
        axes = np.linalg.svd(points - middle, full_matrices=False)[2]
        flat = (points - middle) @ axes[:2].T
        angle, radius = np.arctan2(flat[:, 1], flat[:, 0]), np.hypot(*flat.T)
        # The farthest points of each sector, and half a voxel.
        at = np.radians(np.arange(-180.0, 180.0, 10.0))
        near = np.abs((angle[None] - at[:, None] + np.pi) % (2.0 * np.pi) - np.pi) < np.radians(7.5)
        reach = np.array([np.sort(radius[own])[-3:].mean() for own in near]) + 0.5
        rings[valve] = np.column_stack([np.cos(at), np.sin(at)]) * reach[:, None] @ axes[:2] + middle
    # From the world into the heart's axes as its surfaces went there.
    from bench_long_axis import read_surface

    world = read_surface(data / "rodero01" / "true_lv_cavity_ras.vtp").points * [-1.0, -1.0, 1.0]
    own = first.surfaces["lv"][0]
    a, b = world.mean(axis=0), own.mean(axis=0)
    u, _, v = np.linalg.svd((world - a).T @ (own - b))
    return {valve: heart_forth(heart, (ring - a) @ u @ v + b) for valve, ring in rings.items()}


def heart_forth(heart: Heart, points: FloatArray) -> FloatArray:
    """Points of Rodero's heart bent as the heart is."""
    from bench_long_axis import Warp

    return Warp(int(heart.name[6:] or 0)).forth(points)


def even(ring: FloatArray, count: int = 400) -> FloatArray:
    """Points spread evenly along a closed ring."""
    closed = np.vstack([ring, ring[:1]])
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    s = np.linspace(0.0, at[-1], count, endpoint=False)
    return np.column_stack([np.interp(s, at, x) for x in closed.T])


def compared(ring: FloatArray, truth: FloatArray) -> tuple[float, float, float]:
    """Symmetric mean and largest distance of two rings, mm, and the angle between their planes, degrees."""
    one, other = even(ring), even(truth)
    away = np.linalg.norm(one[:, None] - other[None], axis=2)
    near = np.concatenate([away.min(axis=0), away.min(axis=1)])
    normal = [np.linalg.svd(r - r.mean(axis=0))[2][2] for r in (one, other)]
    return float(near.mean()), float(near.max()), float(np.degrees(np.arccos(min(1.0, abs(normal[0] @ normal[1])))))


def shift_of(scanned: Scan, heart: Heart) -> FloatArray:
    """Mean way from the true surface of the left cavity to the fitted one: what no image of a displaced heart tells."""
    points, cells = to_world(heart, scanned)["lv"]
    made = fit_surface(scanned.seg.object("lv"), vertices=1000)
    finder = ClosestFinder(points, cells)
    move = np.zeros(3)
    for _ in range(10):
        move += (made.points - move - finder(made.points - move).points).mean(axis=0)
    return move


def main() -> None:
    """Read the arguments, run, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hearts", nargs="+", default=["biv", "saddle", "rodero", "rodero1"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2, 3])
    parser.add_argument("--views", type=int, default=3, help="so many views, the four-chamber view first")
    parser.add_argument("--still", action="store_true", help="only hearts that are not displaced")
    args = parser.parse_args()
    for name in args.hearts:
        if name == "saddle":
            heart, rings = saddle()
        elif name == "biv":
            (heart,) = hearts([name])
            rings = {"mitral": phantom_ring()}
        elif "FEMPREP_DATA" in os.environ:
            data = Path(os.environ["FEMPREP_DATA"])
            (heart,) = hearts([name])
            rings = rodero_rings(data, heart, rodero(data))
        else:
            continue
        for seed in args.seeds:
            for what in ("still",) if args.still else ("still", "aligned"):
                move = 0.0 if what == "still" else 1.0
                one = scan(heart, seed, slices=3.0 * move, views=2.0 * move)
                seg, off = one.seg, np.zeros(3)
                seg = seg.__class__(seg.labels, seg.grid, seg.structures, views=seg.views[: args.views])
                if what == "aligned":
                    seg = align_slices(seg)
                    off = shift_of(Scan(seg, one.shifts), heart) if False else off
                world = one.seg.info["world"]
                for valve, ring in rings.items():
                    true = (ring @ world["tilt"]) @ world["turn"].T + world["place"]
                    try:
                        found = find_annulus(seg, valve)
                    except FemprepError as error:
                        print(f"{heart.name:8s} {seed:2d} {what:8s} {valve:10s} {error}", flush=True)
                        continue
                    mean, most, angle = compared(found.ring - off, true)
                    seen = np.linalg.norm((found.points - off)[:, None] - even(true)[None], axis=2).min(axis=1)
                    print(
                        f"{heart.name:8s} {seed:2d} {what:8s} {valve:10s} mean {mean:.2f}  largest {most:.2f} mm  "
                        f"angle {angle:.1f}  points {len(seen)}: mean {seen.mean():.2f} {seen.max():.2f}",
                        flush=True,
                    )


if __name__ == "__main__":
    main()
