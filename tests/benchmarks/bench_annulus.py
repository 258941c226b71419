"""The annulus of the mitral and the tricuspid valve found in long-axis views, and the apex, against the true ones.

    python tests/benchmarks/bench_annulus.py                        phantoms, and Rodero 01 where FEMPREP_DATA is set
    python tests/benchmarks/bench_annulus.py --hearts rodero --seeds 0 1

Hearts are cut into a stack without its apical slice and three views as in bench_long_axis.py, once as they are
(``still``), once displaced and moved back (``aligned``: the mean distance of the left cavity's surface from the true
one along each axis, which no image of a displaced heart shows, is removed). Printed are the symmetric mean and the
largest distance of the ring to the true one, mm, the angle between their planes, degrees, and the mean distance of the
points seen. With --apex: by how much the tips of endocardium and epicardium lie too deep, mm, of the stack alone (with
the epicardium extrapolated) and with views. True rings are

    biv       the rim of the left cavity in the base plane (its atrium has no label)
    saddle    where the left cavity's ellipsoid meets a tilted saddle, with an atrium above
    rodero    the rim of the gap that the leaflets leave between ventricle and atrium in the map of 1 mm
"""

from __future__ import annotations

import argparse
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
from bench_long_axis import Heart, Warp, hearts, rodero, scan, to_world
from scipy.ndimage import distance_transform_edt

from femprep.errors import FemprepError
from femprep.image import Segmentation, read_segmentation
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import FloatArray, IntArray
from femprep.surface import fit_surface, read_surface
from femprep.surface.alignment import align_slices
from femprep.wall import extend_apex
from femprep.wall.planes.annulus import VALVES, find_annulus

#: Leaflets in Rodero's map leave a gap of so many mm between both cavities.
GAP = 4.5


def level(x: FloatArray, y: FloatArray) -> FloatArray:
    """Height of the saddle."""
    return 16.0 + 0.1 * x + 2.5 * (x * x - y * y) / 24.0**2


def saddle() -> Heart:
    """The biventricular phantom with an atrium whose valve is a tilted saddle."""
    (heart,) = hearts(["biv"])

    def label(local: FloatArray) -> IntArray:
        x, y, z = local.T
        inner, outer = (((local / axes) ** 2).sum(axis=1) < 1.0 for axes in ((25.0, 25.0, 60.0), (34.0, 34.0, 69.0)))
        below = z < level(x, y)
        body = np.where(inner, np.where(below, 3, 5), np.where(below, 2, 6))
        return np.where(outer, body, np.where(heart.label(local) == 1, 1, 0))

    structures = {"lv": (3,), "myo": (2,), "rv": (1,), "la": (5,)}
    return replace(heart, name="saddle", label=label, structures=structures)


def phantom_ring(name: str) -> FloatArray:
    """Where the left cavity of a phantom ends, in the heart's own axes."""
    angle = np.radians(np.arange(0.0, 360.0, 2.0))
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    for _ in range(50):
        z = level(*ring.T) if name == "saddle" else np.full(len(ring), 20.0)
        ring *= (25.0 * np.sqrt(1.0 - (z / 60.0) ** 2) / np.linalg.norm(ring, axis=1))[:, None]
    return np.column_stack([ring, z])


def rodero_rings(data: Path, name: str) -> dict[str, FloatArray]:
    """Rims of the gaps between cavities of the map of 1 mm, in the axes of the heart of that name."""
    first = rodero(data)
    seg = read_segmentation(data / "rodero01" / "rodero01_4ch_1.0mm_label.nii.gz", structures={"lv": (1,)})
    # From the world into the heart's axes as its surfaces went there.
    world = read_surface(data / "rodero01" / "true_lv_cavity_ras.vtp").points * [-1.0, -1.0, 1.0]
    own = first.surfaces["lv"][0]
    a, b = world.mean(axis=0), own.mean(axis=0)
    u, _, v = np.linalg.svd((world - a).T @ (own - b))
    rings = {}
    for valve, sides in VALVES.items():
        numbers = [first.structures[side][0] for side in sides]
        (near, i), (far, j) = (distance_transform_edt(seg.labels != n, return_indices=True) for n in numbers)
        gap = (seg.labels == 0) & (near + far <= GAP)
        points = seg.grid.to_world(0.5 * (i[:, gap] + j[:, gap]).T)
        middle = points.mean(axis=0)
        axes = np.linalg.svd(points - middle, full_matrices=False)[2]
        x, y = axes[:2] @ (points - middle).T
        # The farthest points of each sector, and half a voxel.
        at = np.radians(np.arange(-180.0, 180.0, 10.0))
        aside = np.abs((np.arctan2(y, x)[None] - at[:, None] + np.pi) % (2.0 * np.pi) - np.pi)
        reach = [np.sort(np.hypot(x, y)[sector])[-3:].mean() + 0.5 for sector in aside < np.radians(7.5)]
        ring = (np.column_stack([np.cos(at), np.sin(at)]) * np.array(reach)[:, None]) @ axes[:2] + middle
        rings[valve] = Warp(int(name[6:] or 0)).forth((ring - a) @ u @ v + b)
    return rings


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


def moved_by(seg: Segmentation, truth: tuple[FloatArray, IntArray]) -> FloatArray:
    """Mean way from the true surface of the left cavity to the fitted one."""
    made = fit_surface(seg.object("lv"), vertices=1000)
    finder, move = ClosestFinder(*truth), np.zeros(3)
    for _ in range(10):
        found = finder(made.points - move)
        move += (made.points - move - found.points).mean(axis=0)
    return move


def tips(seg: Segmentation, truth: dict[str, tuple[FloatArray, IntArray]], out: FloatArray) -> list[float]:
    """By how much the tips of endocardium and epicardium lie farther along a direction than the true ones, mm."""
    endo = fit_surface(seg.object("lv"), vertices=1500)
    body = seg.object("lv", "myo", name="epi")
    epi = fit_surface(body, boundary=extend_apex(seg, body, endo=endo), vertices=1500)
    made = {"lv": endo.points, "epi": epi.points}
    return [float((points @ out).max() - (truth[name][0] @ out).max()) for name, points in made.items()]


def main() -> None:
    """Read the arguments, run, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hearts", nargs="+", default=["biv", "saddle", "rodero", "rodero1"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2, 3])
    parser.add_argument("--variants", nargs="+", default=["still", "aligned"])
    parser.add_argument("--apex", action="store_true")
    args = parser.parse_args()
    for name in args.hearts:
        if name in ("biv", "saddle"):
            heart = saddle() if name == "saddle" else hearts([name])[0]
            rings = {"mitral": phantom_ring(name)}
        elif "FEMPREP_DATA" in os.environ:
            (heart,) = hearts([name])
            rings = rodero_rings(Path(os.environ["FEMPREP_DATA"]), name)
        else:
            continue
        for seed in args.seeds:
            for what in args.variants:
                one = scan(heart, seed, **({"slices": 0.0, "views": 0.0} if what == "still" else {}))
                truth, world = to_world(heart, one), one.seg.info["world"]
                seg = replace(one.seg, info={})
                seg = align_slices(seg) if what == "aligned" else seg
                off = moved_by(seg, truth["lv"]) if what == "aligned" and name != "saddle" else np.zeros(3)
                row = f"{name:8s} {seed:2d} {what:8s}"
                for valve, ring in rings.items():
                    true = (ring @ world["tilt"]) @ world["turn"].T + world["place"]
                    try:
                        found = find_annulus(seg, valve)
                    except FemprepError as error:
                        print(row, valve, error, flush=True)
                        continue
                    mean, most, angle = compared(found.ring - off, true)
                    seen = np.linalg.norm((found.points - off)[:, None] - even(true)[None], axis=2).min(axis=1).mean()
                    shown = (
                        f"mean {mean:.2f}  largest {most:.2f}  angle {angle:.1f}  {len(found.points)} points {seen:.2f}"
                    )
                    print(row, valve, shown, flush=True)
                if args.apex:
                    out = world["turn"] @ world["tilt"].T @ np.array([0.0, 0.0, -1.0])
                    for words, those in (("alone", replace(seg, views=())), ("views", seg)):
                        endo, epi = tips(those, truth, out)
                        print(row, f"apex {words}  lv {endo:+.2f}  epi {epi:+.2f}", flush=True)


if __name__ == "__main__":
    main()
