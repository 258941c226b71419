"""Scars of known shape in phantoms, marked from label maps of 8 mm slices: how far off they are; prints a table.

    python tests/benchmarks/bench_regions.py [--edge-length MM] [--conforming] [--places N] [--csv FILE]

A scar is a sector of the wall of an LV ellipsoid, through a part of its depth; its volume, centroid and transmurality
are those of a million points. The wall is swept from the phantom's own label map of 1.4 x 1.4 x 8 mm. The second image
has slices of 8 mm too, in the same pose and tilted against the long axis. Beside each figure stands that of the nearest
voxel, the label of the voxel at an element's centre. The mesh ends at its base plane, some millimetres below the
phantom's, and so does the scar it is measured against; its volume stands as well beside that of the elements whose
centres lie in the scar. What the labels' own voxels, as boxes below the base plane, are off is what the image itself
leaves untold. ``--places`` moves the second image N times by random parts of a voxel, and prints means and spreads. A
biventricular phantom tells what leaks through the septum.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from rows import keep, shown

import femprep as fp
from femprep.image import Grid
from femprep.mesh.measures.volume_elements import centroids, element_volumes
from femprep.model import FloatArray
from femprep.phantoms import biventricular, lv_ellipsoid

ENDO, EPI = np.array([25.0, 25.0, 60.0]), np.array([34.0, 34.0, 69.0])
BASE = 20.0
#: Name, depths from and to, middle and half width of the sector, degrees, heights from and to, mm.
SCARS = (
    ("subendocardial half", 0.0, 0.5, 40.0, 35.0, -np.inf, np.inf),
    ("subepicardial half", 0.5, 1.0, 200.0, 40.0, -np.inf, np.inf),
    ("transmural", 0.0, 1.0, 130.0, 30.0, -np.inf, np.inf),
    ("subendocardial third", 0.0, 1 / 3, 300.0, 45.0, -np.inf, np.inf),
    ("mid-wall", 0.25, 0.75, 250.0, 40.0, -np.inf, np.inf),
    ("subendocardial half, of 32 mm height", 0.0, 0.5, 40.0, 40.0, -36.0, -4.0),
)


def depth(points: FloatArray) -> FloatArray:
    """0 on the endocardial, 1 on the epicardial ellipsoid, and between them in proportion to their semi-axes."""
    low, high = np.full(len(points), -0.5), np.full(len(points), 1.5)
    for _ in range(40):
        middle = 0.5 * (low + high)
        axes = ENDO + middle[:, None] * (EPI - ENDO)
        outside = ((points / axes) ** 2).sum(axis=1) > 1.0
        low, high = np.where(outside, middle, low), np.where(outside, high, middle)
    return 0.5 * (low + high)


def scar(row: tuple[Any, ...]) -> Callable[[FloatArray], Any]:
    """Whether points lie in a scar."""
    _, inner, outer, middle, half, bottom, top = row

    def inside(points: FloatArray) -> Any:
        through = depth(points)
        turn = (np.degrees(np.arctan2(points[:, 1], points[:, 0])) - middle + 180.0) % 360.0 - 180.0
        height = (points[:, 2] >= bottom) & (points[:, 2] <= top) & (points[:, 2] <= BASE)
        return (through >= max(inner, -1e-9)) & (through <= outer) & (np.abs(turn) < half) & height

    return inside


def tilted(grid: Grid, degrees: float) -> Grid:
    """The grid turned about the y axis through its middle."""
    a = np.radians(degrees)
    turn = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    middle = grid.to_world([(np.array(grid.shape) - 1) / 2])[0]
    direction = turn @ grid.direction
    return Grid(
        grid.shape, grid.spacing, middle - direction @ ((np.array(grid.shape) - 1) / 2 * grid.spacing), direction
    )


def labelled(grid: Grid, inside: Callable[[FloatArray], Any]) -> fp.Segmentation:
    """Label map of what a function tells of voxel centres."""
    index = np.stack(np.meshgrid(*map(np.arange, grid.shape), indexing="ij"), axis=-1).reshape(-1, 3)
    labels = inside(grid.to_world(index.astype(float))).reshape(grid.shape)
    return fp.Segmentation(labels.astype(np.uint8), grid, {"scar": (1,)})


@cache
def truth(row: tuple[Any, ...], base: float) -> tuple[float, FloatArray]:
    """Volume, mL, and centroid of a scar below a height."""
    inside = scar(row)
    low, high = np.array([-35.0, -35.0, -70.0]), np.array([35.0, 35.0, base])
    points = np.random.default_rng(0).uniform(low, high, (1_000_000, 3))
    mine = inside(points)
    return float(mine.mean() * np.prod(high - low) / 1e3), points[mine].mean(axis=0)


def voxels(image: fp.Segmentation, base: float) -> tuple[float, FloatArray]:
    """Volume, mL, and centroid of the labels' own voxels below a height."""
    grid, index = image.grid, np.argwhere(image.labels == 1)
    through = np.zeros((40, 3))
    through[:, grid.stack_axis] = (np.arange(40) + 0.5) / 40 - 0.5
    points = grid.to_world((index[:, None] + through).reshape(-1, 3))
    points = points[points[:, 2] <= base]
    return len(points) / 40 * grid.voxel_volume / 1e3, points.mean(axis=0)


def one(wall: fp.VolumeMesh, row: tuple[Any, ...], grid: Grid, pose: str, conforming: bool) -> dict[str, Any]:
    """Figures of one scar in one image."""
    inside = scar(row)
    image = labelled(grid, inside)
    base = float(wall.planes["base"].point[2])
    volume, centre = truth(row, base)
    labels_ml, labels_centre = voxels(image, base)
    mesh = found = fp.add_regions(wall, image, conforming=conforming)
    told = found.info["tissues"]["tissues"][0]
    size = np.concatenate([element_volumes(mesh.points, block, kind) for kind, block in mesh.cells.items()])
    place = np.concatenate([centroids(mesh.points, block, kind) for kind, block in mesh.cells.items()])
    index = np.rint(grid.to_index(place)).astype(int)
    there = ((index >= 0) & (index < grid.shape)).all(axis=1)
    plain = there & (image.labels[tuple(np.clip(index, 0, np.array(grid.shape) - 1).T)] == 1)
    true_share = inside(place)
    meshed = float(size[true_share].sum()) / 1e3
    region = found.region == told["tag"]

    def off(weight: FloatArray) -> float:
        return float(np.linalg.norm(np.average(place, axis=0, weights=weight) - centre))

    def wrong(chosen: Any) -> float:
        return 100.0 * float(size[chosen != true_share].sum() / size[true_share].sum())

    through = 100.0 * (min(row[2], 1.0) - row[1])
    return {
        "scar": row[0],
        "image": pose,
        "true_ml": volume,
        "meshed_ml": meshed,
        "labels_percent": 100.0 * (labels_ml / volume - 1.0),
        "labels_centroid_mm": float(np.linalg.norm(labels_centre - centre)),
        "shares_of_meshed_percent": 100.0 * (told["shares_ml"] / meshed - 1.0),
        "shares_percent": 100.0 * (told["shares_ml"] / volume - 1.0),
        "region_percent": 100.0 * (told["region_ml"] / volume - 1.0),
        "nearest_percent": 100.0 * (float(size[plain].sum()) / 1e3 / volume - 1.0),
        "centroid_mm": off(found.cell_data["scar_share"] * size),
        "nearest_centroid_mm": off(plain * size),
        "transmurality_true": through,
        "transmurality": told["transmurality_percent"],
        "wrong_elements_percent": wrong(region),
        "nearest_wrong_percent": wrong(plain),
        "elements": found.n_cells,
        "minimum_dihedral": fp.check(found).measures["minimum_dihedral"].min,
    }


def spread(wall: fp.VolumeMesh, poses: dict[str, Grid], places: int, conforming: bool) -> None:
    """Print means and standard deviations over random places of the image, the same for each scar."""
    parts = np.random.default_rng(1).uniform(-0.5, 0.5, (places, 3))
    names = ("labels_percent", "shares_percent", "region_percent", "labels_centroid_mm", "centroid_mm", "transmurality")
    for row in SCARS:
        for pose, grid in poses.items():
            found = []
            for part in parts:
                moved = replace(grid, origin=grid.origin + grid.direction @ (part * grid.spacing))
                told = one(wall, row, moved, pose, conforming)
                found.append([told[name] for name in names])
            means, deviations = np.mean(found, axis=0), np.std(found, axis=0)
            words = ", ".join(f"{name} {a:.2f} +- {b:.2f}" for name, a, b in zip(names, means, deviations))
            print(f"{row[0]}, {pose}: {words}", flush=True)


def septum(edge_length: float) -> dict[str, Any]:
    """A scar on the left side of a septum: what of it gets beyond the septum's middle."""
    phantom = biventricular()
    seg = phantom.segmentation((1.4, 1.4, 8.0), apex="uncapped")
    run = fp.mesh_segmentation(seg, anatomy="biv", volume={"edge_length": edge_length}, fibres={})
    row = ("septum", 0.0, 0.4, 0.0, 40.0, -np.inf, np.inf)
    image = labelled(seg.grid, scar(row))
    found = fp.add_regions(run.mesh, image)
    size = np.concatenate([element_volumes(found.points, block, kind) for kind, block in found.cells.items()])
    share = found.cell_data["scar_share"]
    right = found.cell_data["transventricular"] > 0.5
    return {
        "scar": "left side of a septum",
        "scar_ml": float((share * size).sum() / 1e3),
        "right_of_the_middle_ml": float((share * size)[right].sum() / 1e3),
        "right_region_ml": float(size[right & (found.region == 21)].sum() / 1e3),
        "transmurality": found.info["tissues"]["tissues"][0]["transmurality_percent"],
    }


def main() -> None:
    """Print a line for each scar and pose."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--edge-length", type=float, default=2.5)
    parser.add_argument("--conforming", action="store_true", help="cut elements along the outlines")
    parser.add_argument("--places", type=int, default=0, help="random places of the second image")
    parser.add_argument("--no-septum", action="store_true", help="leave the biventricular phantom out")
    parser.add_argument("--csv", type=Path)
    given = parser.parse_args()
    seg = lv_ellipsoid().segmentation((1.4, 1.4, 8.0), apex="uncapped")
    run = fp.mesh_segmentation(
        seg, volume={"mesher": "sweep", "edge_length": given.edge_length}, sweep={"element": "tetra"}, fibres={}
    )
    print(f"{run.mesh}, wall {run.quality.volume / 1e3:.2f} mL, phantom {lv_ellipsoid().wall_volume / 1e3:.2f} mL")
    wide = seg.grid.window((-10, -10, -3), tuple(n + m for n, m in zip(seg.grid.shape, (20, 20, 6))))  # type: ignore[arg-type]
    poses = {"same pose": seg.grid, "tilted by 25 degrees": tilted(wide, 25.0)}
    if given.places:
        spread(run.mesh, poses, given.places, given.conforming)
        return
    rows = [one(run.mesh, row, grid, pose, given.conforming) for row in SCARS for pose, grid in poses.items()]
    for row in rows:
        print(shown(row), flush=True)
    if not given.no_septum:
        rows.append(septum(max(given.edge_length, 4.0)))
        print(shown(rows[-1]), flush=True)
    if given.csv:
        keep(rows, given.csv)


if __name__ == "__main__":
    main()
