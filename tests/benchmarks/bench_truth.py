"""How far finished meshes lie from the true heart, and how thick their wall is beside the true one, apex included.

    python tests/benchmarks/bench_truth.py                     Rodero 01 as two stacks, and ellipsoids, by the sweep
    python tests/benchmarks/bench_truth.py --mesher tetwild --edge 4
    python tests/benchmarks/bench_truth.py --mesher tetwild --refinement none    no coarser mesh refined
    python tests/benchmarks/bench_truth.py --cases phantoms

The true endocardium of Rodero 01 is its published surface; the true epicardium is that of its labels at 1 mm. The
ellipsoids have closed forms; ``bare`` are those whose slices without cavity are left out, as in most of ACDC, so that
the apex is extrapolated. Distances are of the facets' points to the truth and of the truth's to the facets, below the
base by 3 mm at least; those of the apex within 12 mm of the lowest true point. Thickness is the distance of an
endocardial point to the epicardium, true and in the mesh. VTK reads and measures. Rodero needs FEMPREP_DATA.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from bench_fidelity import Facets
from rows import keep, shown

import femprep as fp
from femprep.phantoms import Phantom, lv_ellipsoid

BELOW, APEX = 3.0, 12.0


@dataclass(frozen=True)
class Heart:
    """Labels and the true surfaces behind them."""

    name: str
    seg: fp.Segmentation
    truth: dict[str, pv.PolyData]


def rodero(data: Path) -> Iterator[Heart]:
    """A CT heart as stacks of 8 and 10 mm."""
    folder = data / "rodero01"
    points = pv.read(folder / "true_lv_cavity_ras.vtp").triangulate()
    points.points = points.points * [-1.0, -1.0, 1.0]
    truth = {"endo": points, "epi": body(folder / "rodero01_4ch_1.0mm_label.nii.gz", (1, 2))}
    for file, preset in (
        ("rodero01_sax_4ch_1.4x1.4x8_label.nii.gz", "rodero"),
        ("rodero01_sax_vent_1.5x1.5x10_label.nii.gz", "acdc"),
    ):
        seg = fp.read_segmentation(folder / file, preset=preset)
        yield Heart(f"rodero, {file.split('_')[3]} mm", seg, truth)


def body(file: Path, labels: tuple[int, ...]) -> pv.PolyData:
    """Surface of what has these labels, half-way between voxel centres, lightly smoothed."""
    import SimpleITK as sitk

    image = sitk.ReadImage(str(file))
    mask = np.isin(sitk.GetArrayFromImage(image), labels).astype(np.float32)
    grid = pv.ImageData(dimensions=mask.shape[::-1])
    grid["mask"] = mask.ravel()
    poly = grid.contour([0.5], "mask").connectivity("largest").smooth_taubin(20, pass_band=0.1)
    spacing, axes = np.array(image.GetSpacing()), np.array(image.GetDirection()).reshape(3, 3)
    poly.points = (poly.points * spacing) @ axes.T + np.array(image.GetOrigin())
    return poly


def ellipsoids() -> Iterator[Heart]:
    """Left ventricles in closed form: usual, slim, thick; with their last slices and without."""
    shapes = {
        "usual": lv_ellipsoid(),
        "slim": lv_ellipsoid((17.0, 17.0, 60.0), (25.0, 25.0, 68.0)),
        "thick": lv_ellipsoid((16.0, 16.0, 45.0), (32.0, 32.0, 61.0)),
    }
    for name, phantom in shapes.items():
        for apex, note in (("capped", ""), ("uncapped", ", bare")):
            seg = phantom.segmentation(spacing=(1.4, 1.4, 8.0), supersample=3, apex=apex)
            yield Heart(f"ellipsoid, {name}{note}", seg, {"endo": exact(phantom, "lv"), "epi": exact(phantom, "epi")})


def exact(phantom: Phantom, region: str) -> pv.PolyData:
    """The true surface as 82,000 triangles with their corners on it."""
    ball = pv.Icosphere(radius=1.0, nsub=6)
    ball.points = phantom.exact_surface(region, np.asarray(ball.points, float))
    return ball


def far(points: np.ndarray, surface: pv.PolyData) -> np.ndarray:
    """Distances ``(n,)`` of points to a surface."""
    return np.abs(np.asarray(pv.PolyData(points).compute_implicit_distance(surface)["implicit_distance"]))


def measure(folder: Path, truth: dict[str, pv.PolyData]) -> dict[str, float]:
    """Distances and thicknesses of a folder that femprep made, mm."""
    import json

    facets = Facets(folder)
    planes = json.loads((folder / "run.json").read_text())["details"]["wall"]["planes"]
    base = planes["base"]
    normal, origin = np.array(base["normal"]), np.array(base["point_mm"])
    found: dict[str, float] = {}
    mesh = {}
    for name in ("endo", "epi"):
        cells = np.asarray(facets.poly.cell_data["facet_tag"]) == facets.tag_numbers[name]
        mesh[name] = facets.poly.extract_cells(cells).extract_surface().triangulate()
        fine = mesh[name].subdivide(1, "linear")
        one, other = below(np.asarray(fine.points, float), normal, origin), below(truth[name].points, normal, origin)
        out, back = far(one, truth[name]), far(other, mesh[name])
        height = other @ normal
        tip = height < height.min() + APEX
        found[f"{name}_mean"] = float(0.5 * (out.mean() + back.mean()))
        found[f"{name}_greatest"] = float(max(out.max(), back.max()))
        found[f"{name}_apex_mean"] = float(back[tip].mean())
        found[f"{name}_apex_greatest"] = float(back[tip].max())
    places = below(truth["endo"].points, normal, origin)
    # Where the base is nearer than the epicardium the wall has no thickness of its own.
    places = places[(origin - places) @ normal > far(places, truth["epi"]) + BELOW]
    nearest = np.asarray(mesh["endo"].find_closest_cell(places, return_closest_point=True)[1], float)
    true, ours = far(places, truth["epi"]), far(nearest, mesh["epi"])
    height = places @ normal
    tip = height < height.min() + APEX
    found["wall_true"] = float(true.mean())
    found["wall_off"] = float(np.abs(ours - true).mean())
    found["wall_apex_true"] = float(true[tip].mean())
    found["wall_apex"] = float(ours[tip].mean())
    found["wall_least_true"] = float(true.min())
    found["wall_least"] = float(ours.min())
    return found


def below(points: np.ndarray, normal: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """Points that lie below the base for certain."""
    points = np.asarray(points, dtype=float)
    return points[(points - origin) @ normal < -BELOW]


def main(arguments: list[str] | None = None) -> list[dict[str, Any]]:
    """Run it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="+", choices=("rodero", "phantoms"), default=("rodero", "phantoms"))
    parser.add_argument("--mesher", choices=("sweep", "tetwild"), default="sweep")
    parser.add_argument("--edge", type=float, default=2.5, help="edge length, mm")
    parser.add_argument("--refinement", choices=("auto", "none"), default="auto", help="of fTetWild's meshes")
    parser.add_argument("--csv", type=Path, help="file for a line per case")
    given = parser.parse_args(arguments)
    hearts: list[Heart] = []
    if "rodero" in given.cases:
        hearts += rodero(Path(os.environ["FEMPREP_DATA"]))
    if "phantoms" in given.cases:
        hearts += ellipsoids()
    rows = []
    for heart in hearts:
        row: dict[str, Any] = {"case": heart.name}
        try:
            volume = {"mesher": given.mesher, "edge_length": given.edge, "refinement": given.refinement}
            run = fp.mesh_segmentation(heart.seg, volume=volume)
            with tempfile.TemporaryDirectory() as folder:
                fp.write_run(run, Path(folder) / "out")
                row |= measure(Path(folder) / "out", heart.truth)
            row["passed"] = run.quality.passed
        except fp.FemprepError as error:
            row["outcome"] = str(error)
        rows.append(row)
        print(shown(row), flush=True)
        if given.csv:
            keep(rows, given.csv)
    return rows


if __name__ == "__main__":
    main()
