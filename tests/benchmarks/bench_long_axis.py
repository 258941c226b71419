"""Short-axis stacks with displaced slices and long-axis views of hearts whose surfaces are known.

    python tests/benchmarks/bench_long_axis.py                        phantoms, and Rodero 01 where FEMPREP_DATA is set
    python tests/benchmarks/bench_long_axis.py --hearts rodero --seeds 0 1 --variants views stack
    python tests/benchmarks/bench_long_axis.py --hearts biv four rodero_01_fullheart_1.5mm.vtu --methods
    python tests/benchmarks/bench_long_axis.py --hearts biv --methods "femprep, smooth + views" my_module:my_function

With --methods, methods are compared instead of variants, each on the displaced slices and views: those of
sliced_methods.py, among them what others use, and any function of your own (docs/benchmark-surfaces.md). A heart whose
name ends in .vtu is the mesh of the wheel ansys-health-heart (wheel_heart.py), which anyone can download.

A heart is cut into a stack of 1.4 x 1.4 x 8 mm, every slice displaced at random in its plane (3 mm rms), the apical
slice missing, and into three views (2-, 3- and 4-chamber) through the long axis, 60 degrees apart, with pixels of
1.4 mm and slices 6 mm thick, each displaced at random: 2 mm rms in its plane (--turns and --through add rotations and
motion across it). Printed are, for each heart, seed and variant, the residual shift of the slices (rms, mm; the mean
removed, and in brackets a straight line along the stack, which a tilt of the whole heart looks like), the expected
residual, and the symmetric mean distance of each surface to the truth over the whole surface, in mm, the best rigid
motion of all surfaces together removed. Variants:

    aligned    slices and views not displaced, stack alone
    still      slices and views not displaced, three views, taken to be where they are
    as-is      displaced, nothing corrected
    stack      displaced, shifts estimated from the stack alone
    views      displaced, three views
    4ch        displaced, the four-chamber view alone
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from rows import keep
from sliced_methods import DEFAULT, OBJECTS, arrays, method_of
from wheel_heart import read_wheel_heart

from femprep.errors import FemprepError
from femprep.image import Grid, PlaneView, Segmentation, read_segmentation
from femprep.mesh.polygons import isosurface, taubin
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import volume
from femprep.model import FloatArray, IntArray
from femprep.phantoms import Phantom, biventricular, four_chambers
from femprep.surface import fit_surface, read_surface
from femprep.surface.alignment import align_slices, estimate_shifts

PIXEL, DISTANCE, THICK = 1.4, 8.0, 6.0
#: Points of a voxel along each axis whose labels are counted; the majority is the voxel's.
SUB = 3


@dataclass(frozen=True)
class Heart:
    """A heart in its own axes: z along the long axis to the base, x to the right ventricle, mm."""

    name: str
    label: Callable[[FloatArray], IntArray]
    structures: dict[str, tuple[int, ...]]
    surfaces: dict[str, tuple[FloatArray, IntArray]]
    objects: dict[str, tuple[str, ...]]

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        points = np.concatenate([p for p, _ in self.surfaces.values()])
        return points.min(axis=0) - 12.0, points.max(axis=0) + 12.0


@dataclass(frozen=True)
class Scan:
    """A stack and views of a heart, and how its slices were displaced."""

    seg: Segmentation
    shifts: FloatArray


def rodero(data: Path, warp: int = 0) -> Heart:
    """A heart from CT, by its label maps; other numbers of ``warp`` make other hearts."""
    structures = {"lv": (1,), "myo": (2,), "rv": (3,), "la": (5,), "ra": (7,)}
    seg = read_segmentation(data / "rodero01" / "rodero01_4ch_1.0mm_label.nii.gz", structures=structures)
    surfaces = {}
    for name in ("lv", "rv", "la", "ra"):
        ras = read_surface(data / "rodero01" / f"true_{name}_cavity_ras.vtp")
        surfaces[name] = (ras.points * [-1.0, -1.0, 1.0], np.asarray(ras.triangles))
    return from_labels(f"rodero{warp or ''}", seg, surfaces, warp)


def from_labels(name: str, seg: Segmentation, surfaces: dict[str, tuple[FloatArray, IntArray]], warp: int = 0) -> Heart:
    """A heart of fine labels and true cavities; numbers of ``warp`` bend, twist and stretch it into other hearts."""
    surfaces = {**surfaces, "epi": surface_of(seg, ("lv", "myo"))}
    centre = {name: seg.grid.to_world(np.argwhere(seg.mask(name))).mean(axis=0) for name in ("lv", "rv", "la")}
    points = surfaces["lv"][0]
    base = centre["lv"] + 0.3 * (centre["la"] - centre["lv"])
    far = np.linalg.norm(points - base, axis=1)
    z = base - points[far >= np.percentile(far, 99)].mean(axis=0)
    z /= np.linalg.norm(z)
    x = centre["rv"] - centre["lv"]
    x -= (x @ z) * z
    x /= np.linalg.norm(x)
    axes = np.column_stack([x, np.cross(z, x), z])
    bend = Warp(warp)

    def label(local: FloatArray) -> IntArray:
        index = seg.grid.to_index(bend.back(local) @ axes.T + centre["lv"])
        return seg.grid.values_at(seg.labels, index).astype(np.int64)

    moved = {name: (bend.forth((p - centre["lv"]) @ axes), t) for name, (p, t) in surfaces.items()}
    return Heart(name, label, dict(seg.structures), moved, {**{n: (n,) for n in centre}, **OBJECTS})


class Warp:
    """A smooth map of space that makes another heart: stretched, bent and twisted along z."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(1000 + seed)
        self.stretch = np.exp(rng.normal(0.0, 0.12, 3)) if seed else np.ones(3)
        self.bend = rng.normal(0.0, 0.0018, 2) if seed else np.zeros(2)
        self.twist = float(rng.normal(0.0, 0.004)) if seed else 0.0

    def forth(self, points: FloatArray) -> FloatArray:
        x, y, z = points.T
        c, s = np.cos(self.twist * z), np.sin(self.twist * z)
        return (
            np.column_stack([c * x - s * y + self.bend[0] * z * z, s * x + c * y + self.bend[1] * z * z, z])
            * self.stretch
        )

    def back(self, points: FloatArray) -> FloatArray:
        x, y, z = (points / self.stretch).T
        x, y = x - self.bend[0] * z * z, y - self.bend[1] * z * z
        c, s = np.cos(self.twist * z), np.sin(self.twist * z)
        return np.column_stack([c * x + s * y, -s * x + c * y, z])


def surface_of(seg: Segmentation, parts: tuple[str, ...]) -> tuple[FloatArray, IntArray]:
    """The surface of a fine label map's structures, smoothed by less than its voxels."""
    from scipy.ndimage import gaussian_filter

    mask = np.pad(seg.mask(*parts), 3).astype(np.float64)
    points, cells = isosurface(gaussian_filter(mask, 0.8) - 0.5, 0.0)
    pieces = trimesh.Trimesh(taubin(points, cells, 10, 0.1), cells, process=False).split(only_watertight=False)
    largest = max(pieces, key=lambda piece: len(piece.faces))
    world = seg.grid.to_world(np.asarray(largest.vertices) - 3.0)
    cells = np.asarray(largest.faces)
    return world, cells if volume(world, cells) > 0 else cells[:, ::-1]


def phantom(kind: Phantom, name: str) -> Heart:
    """A phantom in its own axes."""
    ball = trimesh.creation.icosphere(subdivisions=5)
    objects = {n: parts for n, parts in OBJECTS.items() if n in kind.regions}
    surfaces = {}
    for n in objects:
        points, cells = kind.exact_surface(n, np.asarray(ball.vertices)), np.asarray(ball.faces)
        surfaces[n] = (points, cells if volume(points, cells) > 0 else cells[:, ::-1])
    structures = {region.structure: (region.label,) for region in kind.regions.values()}

    def label(local: FloatArray) -> IntArray:
        found = np.zeros(len(local), dtype=np.int64)
        for n, region in kind.regions.items():
            found[kind.inside(n, local)] = region.label
        return found

    return Heart(name, label, structures, surfaces, objects)


def scan(
    heart: Heart,
    seed: int,
    *,
    slices: float = 3.0,
    views: float = 2.0,
    turns: float = 0.0,
    through: float = 0.0,
    pixel: float = PIXEL,
    distance: float = DISTANCE,
    thick: float = THICK,
) -> Scan:
    """Cut a heart into a stack and views, displaced by so many mm rms (and degrees); it is tilted under both."""
    rng = np.random.default_rng(seed)
    tilt = trimesh.transformations.euler_matrix(*rng.normal(scale=np.radians(5.0), size=3))[:3, :3]
    low, high = heart.box
    count = np.ceil((high - low) / [pixel, pixel, distance]).astype(int)
    origin = 0.5 * (low + high) - 0.5 * (count - 1) * [pixel, pixel, distance] + rng.uniform(-0.5, 0.5, 3) * distance
    shifts = np.zeros((count[2], 3))
    shifts[:, :2] = rng.normal(scale=slices / np.sqrt(2.0), size=(count[2], 2))
    ij = np.stack(np.meshgrid(*(np.arange(n) for n in count[:2]), indexing="ij"), axis=-1).reshape(-1, 2)
    planes = []
    for k in range(count[2]):
        points = np.column_stack([ij, np.full(len(ij), k)]) * [pixel, pixel, distance] + origin - shifts[k]
        planes.append(heart.label(points @ tilt.T).reshape(count[0], count[1]))
    labels = np.stack(planes, axis=2)
    body = np.isin(labels, [n for name in ("lv", "myo") for n in heart.structures.get(name, ())])
    labels[:, :, : np.flatnonzero(body.any(axis=(0, 1)))[0] + 1] = 0
    # Somewhere in the world.
    turn = trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3]
    place = rng.normal(scale=50.0, size=3)
    grid = Grid(labels.shape, [pixel, pixel, distance], turn @ origin + place, turn)
    made = []
    apex_base = tilt.T @ np.array([0.0, 0.0, 1.0])
    names = ("4ch", "2ch", "3ch")
    for name, angle in zip(names, (0.0, 60.0, -60.0)):
        a = np.radians(angle + rng.normal(scale=4.0))
        across = tilt.T @ np.array([np.cos(a), np.sin(a), 0.0])
        axes = np.column_stack([across, apex_base])
        corners = np.array(np.meshgrid(*zip(low, high))).reshape(3, -1).T @ axes
        size = np.ceil((corners.max(axis=0) - corners.min(axis=0)) / pixel).astype(int)
        start = axes @ corners.min(axis=0)
        normal = np.cross(axes[:, 0], axes[:, 1])
        w = rng.normal(scale=np.radians(turns), size=3)
        rotation = trimesh.transformations.euler_matrix(*w)[:3, :3]
        move = axes @ rng.normal(scale=views / np.sqrt(2.0), size=2) + normal * rng.normal(scale=through)
        at = np.stack(np.meshgrid(*(np.arange(n) for n in size), indexing="ij"), axis=-1).reshape(-1, 2) * pixel
        votes = []
        for u, v, t in np.array(np.meshgrid(*[(np.arange(SUB) + 0.5) / SUB - 0.5] * 3)).reshape(3, -1).T:
            points = start + (at + np.array([u, v]) * pixel) @ axes.T + t * thick * normal
            votes.append(heart.label((points @ rotation.T + move) @ tilt.T))
        kinds = np.unique(np.concatenate([np.unique(v) for v in votes]))
        most = kinds[np.argmax([np.sum([v == n for v in votes], axis=0) for n in kinds], axis=0)]
        made.append(
            PlaneView(name, most.reshape(size), heart.structures, turn @ start + place, turn @ axes, [pixel] * 2, thick)
        )
    seg = Segmentation(labels, grid, heart.structures, views=tuple(made))
    world = {"tilt": tilt, "turn": turn, "place": place}
    return Scan(replace(seg, info={"world": world}), shifts[:, :2])


def to_world(heart: Heart, scanned: Scan) -> dict[str, tuple[FloatArray, IntArray]]:
    """True surfaces where the stack lies."""
    world = scanned.seg.info["world"]
    return {
        name: ((points @ world["tilt"]) @ world["turn"].T + world["place"], cells)
        for name, (points, cells) in heart.surfaces.items()
    }


def samples(points: FloatArray, cells: IntArray, count: int = 6000) -> FloatArray:
    """Points spread evenly on a surface."""
    return np.asarray(trimesh.sample.sample_surface(trimesh.Trimesh(points, cells, process=False), count, seed=0)[0])


def distances(
    made: dict[str, tuple[FloatArray, IntArray]], truth: dict[str, tuple[FloatArray, IntArray]], rigid: bool = True
) -> dict[str, float]:
    """Symmetric mean distance of surfaces, the best rigid motion of all of them together removed."""
    names = [name for name in made if name in truth]
    finders = {name: ClosestFinder(*truth[name]) for name in names}
    clouds = {name: samples(*made[name]) for name in names}
    rotation, move = np.eye(3), np.zeros(3)
    for _ in range(8 if rigid else 0):
        here = {name: clouds[name] @ rotation.T + move for name in names}
        from_, to = [], []
        for name in names:
            found = finders[name](here[name][::4]).points
            near = np.linalg.norm(found - here[name][::4], axis=1)
            keep = near <= np.percentile(near, 90)
            from_.append(clouds[name][::4][keep])
            to.append(found[keep])
        a, b = np.concatenate(from_), np.concatenate(to)
        u, _, v = np.linalg.svd((a - a.mean(axis=0)).T @ (b - b.mean(axis=0)))
        rotation = (u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v).T
        move = b.mean(axis=0) - rotation @ a.mean(axis=0)
    found = {}
    for name in names:
        here = clouds[name] @ rotation.T + move
        one = np.linalg.norm(finders[name](here).points - here, axis=1).mean()
        back = samples(*truth[name])
        other = ClosestFinder(made[name][0] @ rotation.T + move, made[name][1])
        found[name] = 0.5 * float(one + np.linalg.norm(other(back).points - back, axis=1).mean())
    return found


def residual(shift: FloatArray, truth: FloatArray, slope: bool = False) -> float:
    """Rms length of what is left of shifts, less their mean (and less a straight line along the stack)."""
    left = shift - truth
    k = np.arange(len(left))[:, None]
    line = np.concatenate([np.ones_like(k), k], axis=1)[:, : 2 if slope else 1].astype(float)
    left = left - line @ np.linalg.lstsq(line, left, rcond=None)[0]
    return float(np.sqrt((left**2).sum(axis=1).mean()))


def surfaces(seg: Segmentation, heart: Heart) -> dict[str, tuple[FloatArray, IntArray]]:
    """Fitted surfaces of a heart's objects; those that cannot be fitted are left out."""
    made = {}
    for name, parts in heart.objects.items():
        try:
            found = fit_surface(seg.object(*parts, name=name), vertices=1500)
        except FemprepError as error:
            print(f"    {name}: {error}")
            continue
        made[name] = (found.points, found.triangles)
    return made


def hearts(names: list[str]) -> list[Heart]:
    """Hearts by name: biv, four, rodero, rodero1, rodero2... for warped ones, or the mesh of the wheel."""
    kinds = {"biv": biventricular, "four": four_chambers}
    found = []
    for n in names:
        if n in kinds:
            found.append(phantom(kinds[n](), n))
        elif n.endswith(".vtu"):
            found.append(from_labels("wheel", *read_wheel_heart(Path(n))))
        elif "FEMPREP_DATA" in os.environ:
            found.append(rodero(Path(os.environ["FEMPREP_DATA"]), int(n[6:] or 0)))
    return found


def compare(heart: Heart, seeds: list[int], names: list[str], cut: dict[str, float]) -> list[dict[str, Any]]:
    """Distances of the surfaces of each method, a row a seed; the means are printed as rows of a table."""
    rows: list[dict[str, Any]] = []
    for seed in seeds:
        scanned = scan(heart, seed, **cut)
        truth = to_world(heart, scanned)
        for name in names:
            start = time.perf_counter()
            made = arrays(method_of(name)(scanned.seg))
            seconds = time.perf_counter() - start
            found = distances(made, truth) if made else {}
            rows.append({"heart": heart.name, "seed": seed, "method": name, **found, "seconds": seconds})
            print(shown({k: v for k, v in rows[-1].items() if isinstance(v, float)}), f" {name}, {seed}", flush=True)
    columns = [*(name for name in OBJECTS if name in heart.objects), "seconds"]
    print(f"\n| {heart.name}, {len(seeds)} seeds | {' | '.join(columns)} |\n|---|{'---|' * len(columns)}")
    for name in names:
        own = [row for row in rows if row["method"] == name]
        means = [[row[column] for row in own if column in row] for column in columns]
        # A mean over fewer seeds is of the easier ones.
        cells = [f"{np.mean(m):.2f}" + f" ({len(m)})" * (len(m) < len(own)) if m else "none" for m in means]
        print(f"| {name} | {' | '.join(cells)} |", flush=True)
    return rows


def main() -> None:
    """Read the arguments, run, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hearts", nargs="+", default=["biv", "four", "rodero", "rodero1"])
    parser.add_argument("--seeds", nargs="+", type=int, default=list(range(8)))
    parser.add_argument("--variants", nargs="+", default=["aligned", "still", "as-is", "stack", "views", "4ch"])
    parser.add_argument("--turns", type=float, default=0.0, help="rotations of views, degrees rms about each axis")
    parser.add_argument("--fixed", action="store_true", help="remove no rigid motion of all surfaces together")
    parser.add_argument("--through", type=float, default=0.0, help="motion of views across their planes, mm rms")
    parser.add_argument("--slices", type=float, default=3.0, help="displacement of slices in their plane, mm rms")
    parser.add_argument("--views", type=float, default=2.0, help="displacement of views in their plane, mm rms")
    parser.add_argument("--pixel", type=float, default=PIXEL, help="pixels of stack and views, mm")
    parser.add_argument("--distance", type=float, default=DISTANCE, help="distance of slices, mm")
    parser.add_argument("--thick", type=float, default=THICK, help="thickness of views, mm")
    parser.add_argument("--methods", nargs="*", help="compare methods, by name or module:function; those of the page")
    parser.add_argument("--csv", type=Path, help="with --methods: keep all figures in this file")
    args = parser.parse_args()
    size = {"pixel": args.pixel, "distance": args.distance, "thick": args.thick}
    cut = {"slices": args.slices, "views": args.views, "turns": args.turns, "through": args.through, **size}
    if args.methods is not None:
        names = args.methods or list(DEFAULT)
        for name in names:
            method_of(name)
        found = [row for heart in hearts(args.hearts) for row in compare(heart, args.seeds, names, cut)]
        if args.csv:
            keep(found, args.csv)
        return
    for heart in hearts(args.hearts):
        rows: dict[str, list[dict[str, float]]] = {}
        for seed in args.seeds:
            moved = scan(heart, seed, **cut)
            still = scan(heart, seed, slices=0.0, views=0.0, **size)
            truth = to_world(heart, moved)
            for variant in args.variants:
                one = still if variant in ("aligned", "still") else moved
                kept = {"views": 3, "still": 3, "4ch": 1}.get(variant, 0)
                seg, row = replace(one.seg, views=one.seg.views[:kept]), {}
                if variant in ("stack", "views", "4ch"):
                    shifts = estimate_shifts(seg)
                    seg, true = align_slices(seg, shifts), one.shifts[shifts.index]
                    row = {"shift": residual(shifts.shift, true), "(line)": residual(shifts.shift, true, True)}
                    row["expected"] = shifts.expected
                row |= distances(surfaces(seg, heart), truth, rigid=not args.fixed)
                rows.setdefault(variant, []).append(row)
                print(f"{heart.name:8s} {seed:2d} {variant:8s}", shown(row), flush=True)
        for variant, found in rows.items():
            mean = {key: float(np.mean([row[key] for row in found if key in row])) for key in found[0]}
            print(f"{heart.name:8s} mean {variant:6s}", shown(mean), flush=True)


def shown(row: dict[str, float]) -> str:
    """Figures with their names."""
    return "  ".join(f"{name} {value:.2f}" for name, value in row.items())


if __name__ == "__main__":
    main()
