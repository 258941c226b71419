"""Every method side by side on hearts whose true surface is known; prints a table.

    python tests/benchmarks/bench_surfaces.py                         Rodero 01 at 1.4 x 1.4 x 8 mm, and the phantoms
    python tests/benchmarks/bench_surfaces.py --cases rodero --placements 8 --pixels 1.25 1.6
    python tests/benchmarks/bench_surfaces.py --cases phantoms --spacing 1.4 1.4 10 --supersample 4 --seed 3

Rodero 01 needs FEMPREP_DATA. Distances are symmetric means between the first and the last slice centre, in mm; normals
are the mean angle to the truth's, in degrees; in-slice is the mean distance to the label contours, both ways; sound
means closed, outward, one piece, like a sphere, without self-intersection. Seconds are those of a second call, kernels
compiled. --csv keeps all figures. With further placements, means and ranges over them follow, beside the best of the
methods in use in each.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from rows import keep

from femprep.image import Grid, LabelObject, make_object, read_segmentation
from femprep.mesh.topology import volume
from femprep.model import Surface
from femprep.phantoms import Phantom, atrium, lv_ellipsoid, rv_bent, rv_crescent, whole_heart
from femprep.surface import fit_surface, read_surface
from femprep.surface.fit import TABLE_1
from femprep.surface.reference.side_by_side import Method, MethodFigures, all_methods, measure_method
from femprep.surface.reference.slice_interpolation import METHOD

RODERO_LABELS = {"lv": 1, "rv": 3, "la": 5, "ra": 7}
#: Between an object's name and the number of its placement.
PLACEMENT = ", placement "
SMOOTH = "femprep, smooth"
#: Not among the methods in use.
OWN = (SMOOTH, "femprep, even", METHOD["akima"])


@dataclass(frozen=True)
class Case:
    """One object with its true surface; ``chamber`` is its row of the paper's Table 1."""

    name: str
    chamber: str
    obj: LabelObject
    truth: Surface


def rodero(data: Path, chambers: list[str]) -> Iterator[Case]:
    """The four cavities of a CT heart, sampled as a short-axis stack, and their true surfaces."""
    folder = data / "rodero01"
    seg = read_segmentation(folder / "rodero01_sax_4ch_1.4x1.4x8_label.nii.gz", structures=RODERO_LABELS)
    for name in chambers:
        ras = read_surface(folder / f"true_{name}_cavity_ras.vtp")
        points = ras.points * [-1.0, -1.0, 1.0]  # two axes turned: the winding stays
        yield Case(f"rodero {name}", name, seg.object(name), Surface(points, ras.cells, name="truth"))


def placed(case: Case, spacing: list[float], supersample: int, seed: int) -> Case:
    """The same truth sampled anew, on a grid moved and tilted at random about the first one."""
    import pyvista as pv
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy

    rng = np.random.default_rng(seed)
    left, _, right = np.linalg.svd(case.obj.grid.direction)
    tilt = trimesh.transformations.euler_matrix(*rng.normal(scale=np.radians(10.0), size=3))[:3, :3]
    axes, size = tilt @ left @ right, np.asarray(spacing)
    offset = rng.uniform(0.0, 1.0, size=3) * size
    local = (case.truth.points - case.truth.points.mean(axis=0)) @ axes
    low = np.floor((local.min(axis=0) - offset) / size) - 3.0
    count = (np.ceil((local.max(axis=0) - offset) / size) + 3.0 - low).astype(int)
    fine = count * supersample
    faces = np.column_stack([np.full(len(case.truth.triangles), 3), case.truth.triangles])
    stencil = vtk.vtkPolyDataToImageStencil()
    stencil.SetInputData(pv.PolyData(local, faces.ravel()))
    stencil.SetOutputSpacing(*(size / supersample))
    stencil.SetOutputOrigin(*(offset + low * size + 0.5 * size / supersample))
    stencil.SetOutputWholeExtent(0, int(fine[0]) - 1, 0, int(fine[1]) - 1, 0, int(fine[2]) - 1)
    stencil.SetTolerance(0.0)
    image = vtk.vtkImageStencilToImage()
    image.SetInputConnection(stencil.GetOutputPort())
    image.SetInsideValue(1)
    image.SetOutsideValue(0)
    image.SetOutputScalarTypeToUnsignedChar()
    image.Update()
    hits = vtk_to_numpy(image.GetOutput().GetPointData().GetScalars()).reshape(fine[::-1]).T
    i, j, k = count
    parts = hits.reshape(i, supersample, j, supersample, k, supersample).sum(axis=(1, 3, 5))
    mask = 2 * parts > supersample**3
    origin = case.truth.points.mean(axis=0) + axes @ (offset + (low + 0.5) * size)
    obj = make_object(mask, Grid(mask.shape, size, origin, axes), case.obj.name)
    return Case(f"{case.name}{PLACEMENT}{seed}", case.chamber, obj, case.truth)


def phantoms(
    chambers: list[str], spacing: list[float], supersample: int, seed: int | None, shift: float = 0.0
) -> Iterator[Case]:
    """Bodies with closed-form surfaces; a seed moves them on the grid and turns them a little out of its axes.

    Slices are shifted in their plane by ``shift`` mm rms.
    """
    bodies: dict[str, tuple[str, Phantom, str, tuple[str, ...]]] = {
        "lv": ("lv", lv_ellipsoid(), "lv", ("lv",)),
        "epi": ("epi", lv_ellipsoid(), "epi", ("lv", "myo")),
        "rv crescent": ("rv", rv_crescent(), "rv", ("rv",)),
        "rv bent": ("rv", rv_bent(), "rv", ("rv",)),
        "rv bent, small": ("rv", rv_bent((8.0, 18.0, 42.0), 30.0), "rv", ("rv",)),
        "rv crescent, end-systolic": ("rv", rv_crescent((9.0, 42.0, 50.0), (38.0, 38.0, 62.0), 18.0), "rv", ("rv",)),
        "la": ("la", atrium(), "la", ("la",)),
        "whole heart": ("epi", whole_heart(), "epi", ("epi",)),
    }
    rng = np.random.default_rng(seed)
    for title, (chamber, phantom, region, structures) in bodies.items():
        placement: dict[str, Any] = {}
        if seed is not None:
            angle = rng.normal(scale=np.radians(8.0), size=3)
            placement = {
                "direction": trimesh.transformations.euler_matrix(*angle)[:3, :3],
                "offset": rng.uniform(0.0, 1.0, size=3) * spacing,
            }
        if chamber not in chambers:
            continue
        if shift:
            grid = phantom.grid(spacing, **placement)
            placement = {"shifts": rng.normal(scale=shift / np.sqrt(2.0), size=(grid.shape[2], 2)), "grid": grid}
        else:
            placement["spacing"] = spacing
        seg = phantom.segmentation(supersample=supersample, **placement)
        yield Case(f"phantom {title}", chamber, seg.object(*structures), exact(phantom, region))


def exact(phantom: Phantom, region: str, subdivisions: int = 6) -> Surface:
    """The true surface of a phantom's region as 82,000 triangles with their corners on it."""
    ball = trimesh.creation.icosphere(subdivisions=subdivisions)
    points, cells = phantom.exact_surface(region, np.asarray(ball.vertices)), np.asarray(ball.faces)
    return Surface(points, cells if volume(points, cells) > 0 else cells[:, ::-1], name="truth")


def methods(chamber: str) -> dict[str, Method]:
    """The methods in use, the paper's at its own numbers, and femprep's own."""
    found = dict(all_methods())
    del found["femprep, paper"]
    return {"paper (M, K, V of its Table 1)": partial(fit_surface, method="paper", **TABLE_1[chamber]), **found}


def line(found: MethodFigures) -> str:
    """One line of the table."""
    return (
        f"{found.mean:7.3f} {found.p95:6.2f} {found.max:6.2f} {found.normals:8.1f} {found.in_slice:9.3f} "
        f"{found.triangles:10d} {found.q_mean:6.2f}/{found.q_min:.2f} {'yes' if found.sound else 'no':>6s} "
        f"{found.seconds:8.2f}"
    )


def over_placements(rows: list[dict[str, Any]]) -> None:
    """Means and ranges over an object's placements: of the smooth surface, the best method in use, their ratio."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for row in rows:
        name, placement, number = row["case"].partition(PLACEMENT)
        if placement:
            found.setdefault(name, {}).setdefault(number, {})[row["method"]] = row["mean"]
    if not found:
        return

    def shown(values: list[float]) -> str:
        return f"{np.mean(values):.3f} ({min(values):.3f} to {max(values):.3f})"

    print("\nOver placements, mm: mean (range)")
    print(f"{'':12s}{'placements':>11s}{'smooth':>25s}{'best in use':>25s}{'smooth / best in use':>25s}")
    for name, placements in found.items():
        pairs = [
            (means[SMOOTH], min(mean for method, mean in means.items() if method not in OWN))
            for means in placements.values()
            if SMOOTH in means and set(means).difference(OWN)
        ]
        if pairs:
            ours, best = (list(column) for column in zip(*pairs))
            ratio = [a / b for a, b in pairs]
            print(f"{name:12s}{len(pairs):11d}{shown(ours):>25s}{shown(best):>25s}{shown(ratio):>25s}")


def main() -> None:
    """Read the arguments, run, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="+", choices=("rodero", "phantoms"), default=["rodero", "phantoms"])
    parser.add_argument("--chambers", nargs="+", choices=sorted(TABLE_1), default=["lv", "rv", "la", "ra", "epi"])
    parser.add_argument("--methods", nargs="+", help="names of methods, or the beginnings of names; all by default")
    parser.add_argument("--spacing", nargs=3, type=float, default=[1.4, 1.4, 8.0], help="voxels of the phantoms, mm")
    parser.add_argument("--supersample", type=int, default=1, help="partial volume from n x n x n points a voxel")
    parser.add_argument("--seed", type=int, help="move and tilt the phantoms on the grid")
    parser.add_argument("--placements", type=int, default=0, help="further random placements of Rodero 01 on the grid")
    parser.add_argument(
        "--pixels", nargs=2, type=float, help="range of the pixel size, drawn anew for each placement; else --spacing"
    )
    parser.add_argument("--csv", type=Path, help="keep all figures in this file")
    arguments = parser.parse_args()

    cases: list[Case] = []
    if "rodero" in arguments.cases:
        if "FEMPREP_DATA" not in os.environ:
            parser.error("Rodero 01 needs the environment variable FEMPREP_DATA; or give --cases phantoms")
        chambers = [c for c in arguments.chambers if c in RODERO_LABELS]
        hearts = list(rodero(Path(os.environ["FEMPREP_DATA"]), chambers))
        cases.extend(hearts)
        for seed in range(1, arguments.placements + 1):
            spacing = list(arguments.spacing)
            if arguments.pixels:
                # Drawn on its own, so that a placement's tilt and offset stay those of its number.
                spacing[:2] = [float(np.random.default_rng([seed, 1]).uniform(*arguments.pixels))] * 2
            cases.extend(placed(case, spacing, arguments.supersample, seed) for case in hearts)
    if "phantoms" in arguments.cases:
        cases.extend(phantoms(arguments.chambers, arguments.spacing, arguments.supersample, arguments.seed))

    rows = []
    for case in cases:
        print(
            f"\n{case.name}: {case.obj.volume / 1000:.1f} mL, voxels {np.round(case.obj.grid.spacing, 2).tolist()} mm"
        )
        print(
            f"{'':38s}{'mean':>7s} {'95 %':>6s} {'max':>6s} {'normals':>8s} {'in-slice':>9s} {'triangles':>10s} "
            f"{'Q mean/min':>11s} {'sound':>6s} {'seconds':>8s}"
        )
        for name, method in methods(case.chamber).items():
            if arguments.methods and not any(name.startswith(wanted) for wanted in arguments.methods):
                continue
            figures = measure_method(case.obj, case.truth, name, method)
            if figures.failure is not None:
                print(f"{name:38s} left out: {figures.failure}")
                continue
            print(f"{name:38s}{line(figures)}", flush=True)
            rows.append({"case": case.name, **figures.model_dump()})
    over_placements(rows)
    if arguments.csv and rows:
        keep(rows, arguments.csv)


if __name__ == "__main__":
    main()
