"""How far finished meshes lie from the outlines of the labels they were made from, by readers that are not femprep's.

    python tests/benchmarks/bench_fidelity.py                        all ACDC maps, LV, by the sweep
    python tests/benchmarks/bench_fidelity.py --mesher tetwild --edge 4
    python tests/benchmarks/bench_fidelity.py --anatomy biv --every 5
    python tests/benchmarks/bench_fidelity.py --folder OUT --image SEG     one folder that is there
    python tests/benchmarks/bench_fidelity.py --cohort OUT                 all folders of a cohort of ACDC maps

The labels are read by SimpleITK and outlined by contourpy; the facets are those of ``facets.vtp``, read and cut by VTK.
In each slice both curves are sampled every 0.1 mm; distances are those of each sample to the nearest of the other
curve, both ways. Outlines beyond the base plane count no more than a pixel from it. Needs FEMPREP_DATA for ACDC.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from bench_acdc import cases
from rows import keep, shown

STEP = 0.1
#: Limits, in pixels: mean of a surface, greatest of any slice.
MEAN, GREATEST = 0.35, 2.0


def largest(mask: np.ndarray) -> np.ndarray:
    """Largest piece, its holes filled slice by slice."""
    from scipy import ndimage

    number, count = ndimage.label(mask, np.ones((3, 3, 3)))
    if count > 1:
        mask = number == 1 + np.argmax(np.bincount(number.ravel())[1:])
    return np.stack([ndimage.binary_fill_holes(plane) for plane in mask])


def outlines(mask: np.ndarray, image: Any) -> dict[int, np.ndarray]:
    """Samples ``(n, 3)``, mm LPS, of the outline in each slice of a mask in numpy's order (slice first)."""
    import contourpy

    found = {}
    for k, plane in enumerate(mask):
        if not plane.any():
            continue
        lines = contourpy.contour_generator(z=np.pad(plane, 1).astype(float)).lines(0.5)
        points = [dense(np.c_[line - 1.0, np.full(len(line), k)], image) for line in lines]
        found[k] = np.concatenate(points)
    return found


def dense(index: np.ndarray, image: Any) -> np.ndarray:
    """A polyline in fractional indices as points in the world, every STEP mm at least."""
    corner = np.array([image.TransformContinuousIndexToPhysicalPoint(row.tolist()) for row in index])
    length = np.linalg.norm(np.diff(corner, axis=0), axis=1)
    return np.concatenate(
        [
            a + np.linspace(0.0, 1.0, max(2, int(np.ceil(n / STEP)) + 1))[:, None] * (b - a)
            for a, b, n in zip(corner[:-1], corner[1:], length)
        ]
    )


def cut(facets: Any, names: list[str], origin: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Samples of where facets of some tags meet a plane."""
    tags = [facets.tag_numbers[name] for name in names]
    part = facets.poly.extract_cells(np.isin(facets.poly.cell_data["facet_tag"], tags)).extract_surface()
    lines = part.slice(normal=normal, origin=origin)
    if not lines.n_points:
        return np.empty((0, 3))
    segments = lines.lines.reshape(-1, 3)[:, 1:]
    a, b = lines.points[segments[:, 0]].astype(float), lines.points[segments[:, 1]].astype(float)
    count = int(np.ceil(np.linalg.norm(b - a, axis=1).max() / STEP)) + 1
    share = np.linspace(0.0, 1.0, max(count, 2))[:, None, None]
    return ((1 - share) * a + share * b).reshape(-1, 3)


class Facets:
    """The boundary facets of a folder, with the numbers of their tags."""

    def __init__(self, folder: Path) -> None:
        import pyvista as pv

        self.poly = pv.read(folder / "facets.vtp").triangulate()
        quality = json.loads((folder / "quality.json").read_text())
        self.tag_numbers = {name: record["tag"] for name, record in quality["facet_tags"].items()}


def measure(folder: Path, image: Path, labels: dict[str, list[int]], anatomy: str) -> list[dict[str, Any]]:
    """A row for each surface and slice."""
    import SimpleITK as sitk
    from scipy.spatial import cKDTree

    seg = sitk.ReadImage(str(image))
    array = sitk.GetArrayFromImage(seg)
    facets = Facets(folder)
    run = json.loads((folder / "run.json").read_text())
    planes = run["details"]["wall"]["planes"]
    normal = np.array(seg.GetDirection()).reshape(3, 3)[:, 2]
    pixel = min(seg.GetSpacing()[:2])

    def mask(*names: str) -> np.ndarray:
        return largest(np.isin(array, [n for name in names for n in labels.get(name, [])]))

    body = outlines(mask("lv", "myo"), seg)
    if anatomy == "lv":
        jobs = [("endo", ["endo"], outlines(mask("lv"), seg), None), ("epi", ["epi"], body, None)]
    else:
        right = outlines(mask("rv"), seg)
        # Where the right ventricle lies beside it the outline of the left one is no epicardium.
        jobs = [
            ("endo_lv", ["endo_lv"], outlines(mask("lv"), seg), None),
            ("endo_rv", ["endo_rv"], right, None),
            ("epi", ["epi"], body, right),
        ]
    rows = []
    for name, tags, contours, besides in jobs:
        for k, curve in contours.items():
            origin = np.array(seg.TransformContinuousIndexToPhysicalPoint([0.0, 0.0, float(k)]))
            below, flat, beyond = np.ones(len(curve), bool), False, False
            for plane in planes.values():
                n, p = np.array(plane["normal"]), np.array(plane["point_mm"])
                away = (curve - p) @ n
                if abs(abs(n @ normal) - 1.0) < 1e-6 and np.abs(away).max() < 1e-3:
                    # The slice is the plane: the rim, cut just inside.
                    origin, flat = origin - 1e-4 * n, True
                else:
                    below &= away < -pixel
                    beyond |= bool((away > 0.0).all())
            if beyond or (not flat and not below.any()):
                continue
            section = cut(facets, tags, origin, normal)
            if besides is not None:
                near = cKDTree(besides[k]).query(curve)[0] if k in besides else np.full(len(curve), np.inf)
                below &= near > 8.0
                if not below.any():
                    continue
            row = {"surface": name, "slice": k, "pixel": pixel}
            if not len(section):
                size = np.linalg.norm(curve - curve.mean(axis=0), axis=1).max()
                rows.append({**row, "missed": True, "mean": np.nan, "greatest": size / pixel})
                continue
            out = cKDTree(section).query(curve[below])[0]
            back = cKDTree(curve).query(section)[0] if besides is None else out
            rows.append(
                {
                    **row,
                    "missed": False,
                    "mean": 0.5 * (out.mean() + back.mean()) / pixel,
                    "greatest": max(out.max(), back.max()) / pixel,
                }
            )
    return rows


def verdict(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Mean and greatest of each surface over its slices, pixels."""
    found: dict[str, float] = {}
    for name in dict.fromkeys(row["surface"] for row in rows):
        own = [row for row in rows if row["surface"] == name]
        found[f"{name}_mean"] = float(np.nanmean([row["mean"] for row in own]))
        found[f"{name}_mean_worst_slice"] = float(np.nanmax([row["mean"] for row in own]))
        found[f"{name}_greatest"] = max(row["greatest"] for row in own if not row["missed"])
        found[f"{name}_missed"] = sum(row["missed"] for row in own)
    return found


def judged(folder: Path, image: str, anatomy: str) -> dict[str, Any]:
    """What a folder holds, by this reader and by its own record."""
    quality = json.loads((folder / "quality.json").read_text())
    run = json.loads((folder / "run.json").read_text())
    rows = measure(folder, Path(image), run["input"]["structures"], anatomy)
    return {
        **verdict(rows),
        "wall_percent": next((v["difference_percent"] for v in run["volumes"] if "wall" in v["name"]), None),
        "dihedral": quality["measures"].get("minimum_dihedral", {}).get("min"),
        "mean_ratio": quality["measures"]["mean_ratio"]["mean"],
        "passed": not quality["failures"],
        "failures": "; ".join(quality["failures"]),
        "worst": "; ".join(
            f"{r['surface']} slice {r['slice']}: {r['greatest']:.1f}" for r in rows if r["greatest"] > GREATEST
        ),
        "outcome": "check failed" if quality["failures"] else "passed",
    }


def one(job: tuple[str, str, dict[str, Any]]) -> dict[str, Any]:
    """Mesh one map into a temporary folder and measure what is in it."""
    import femprep as fp

    name, path, options = job
    row: dict[str, Any] = {"case": name}
    start = time.perf_counter()
    try:
        run = fp.mesh_segmentation(fp.read_segmentation(path, preset="acdc"), **options)
        with tempfile.TemporaryDirectory() as folder:
            fp.write_run(run, Path(folder) / "out", source=path)
            row |= judged(Path(folder) / "out", path, run.options.anatomy)
    except fp.FemprepError as error:
        row["outcome"] = ("refused: " if error.exit_status == 2 else "failed: ") + str(error)
    row["seconds"] = time.perf_counter() - start
    return row


def of_cohort(job: tuple[str, str, Path]) -> dict[str, Any]:
    """The folder of one subject of a cohort, or why there is none."""
    name, path, out = job
    record = next(r for r in json.loads((out / "cohort.json").read_text())["subjects"] if r["subject"] == name)
    if not (out / name).is_dir():
        return {"case": name, "outcome": f"{record['status']}: {record['message']}"}
    anatomy = json.loads((out / name / "run.json").read_text())["options"]["anatomy"]
    return {"case": name, **judged(out / name, path, anatomy)}


def summary(rows: list[dict[str, Any]]) -> None:
    """How many hold the limits, and the distribution of every figure."""
    for outcome, count in Counter(row["outcome"].split(":")[0] for row in rows).most_common():
        print(f"{count:4d}  {outcome}")
    made = [row for row in rows if "worst" in row]
    means = [key for key in made[0] if key.endswith("_mean")]
    tops = [key for key in made[0] if key.endswith("_greatest")]
    held = [r for r in made if all(r[m] <= MEAN for m in means) and all(r[t] <= GREATEST for t in tops)]
    told = [r for r in made if r not in held and not r["passed"]]
    print(
        f"{len(held)} of {len(made)} within {MEAN} and {GREATEST} pixels; {len(told)} beyond and told with status 1; "
        f"{len(made) - len(held) - len(told)} beyond and passed"
    )
    for key in made[0]:
        values = [row[key] for row in made if isinstance(row.get(key), int | float) and not isinstance(row[key], bool)]
        if values:
            shares = np.percentile(values, (0, 50, 95, 100))
            print(f"{key:28s}" + "".join(f"{value:10.3g}" for value in shares))


def main(arguments: list[str] | None = None) -> list[dict[str, Any]]:
    """Run it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mesher", choices=("sweep", "tetwild"), default="sweep")
    parser.add_argument("--anatomy", choices=("lv", "biv"), default="lv")
    parser.add_argument("--edge", type=float, default=2.5, help="edge length, mm")
    parser.add_argument("--every", type=int, default=1, help="one map in so many")
    parser.add_argument("--only", nargs="+", help="names of maps")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--csv", type=Path, help="file for a line per case")
    parser.add_argument("--cohort", type=Path, help="a cohort of ACDC maps, each by its name, in place of meshing them")
    parser.add_argument("--folder", type=Path, help="a folder that femprep made, in place of ACDC")
    parser.add_argument("--image", type=Path, help="its label map")
    parser.add_argument("--labels", nargs="+", default=["lv=3", "myo=2", "rv=1"], help="its labels")
    given = parser.parse_args(arguments)
    if given.folder:
        labels = {name: [int(n)] for name, n in (text.split("=") for text in given.labels)}
        rows = measure(given.folder, given.image, labels, given.anatomy)
        for row in rows:
            print(shown(row))
        print(shown(verdict(rows)))
        return rows
    data = Path(os.environ["FEMPREP_DATA"])
    chosen = [row for row in cases(data) if not given.only or row["id"] in given.only][:: given.every]
    options: dict[str, Any] = {"anatomy": given.anatomy, "volume": {"mesher": given.mesher, "edge_length": given.edge}}
    jobs: list[Any] = [(row["id"], str(data / "acdc" / row["file"]), options) for row in chosen]
    work: Any = one
    if given.cohort:
        known = {r["subject"] for r in json.loads((given.cohort / "cohort.json").read_text())["subjects"]}
        work, jobs = of_cohort, [(name, path, given.cohort) for name, path, _ in jobs if name in known]
    results = []
    with ProcessPoolExecutor(given.jobs) as pool:
        for result in pool.map(work, jobs):
            results.append(result)
            print(shown(result), flush=True)
            if given.csv:
                keep(results, given.csv)
    print()
    summary(results)
    return results


if __name__ == "__main__":
    main()
