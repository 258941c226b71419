"""ACDC through femprep: every map through the surfaces, a choice of maps through the whole way; prints tables.

    python tests/benchmarks/bench_acdc.py surfaces             all maps: LV cavity, LV + myocardium, RV cavity
    python tests/benchmarks/bench_acdc.py surfaces --every 5   every fifth of them
    python tests/benchmarks/bench_acdc.py meshes --edge 2.5    24 maps (ED and ES, each group, the awkward ones)
    python tests/benchmarks/bench_acdc.py meshes --refinement none    the mesher's own elements, as small as asked for

Needs FEMPREP_DATA. A line per case in CSV goes to --csv; the summary to standard output.
"""

from __future__ import annotations

import argparse
import csv
import os
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from rows import keep, shown

#: Maps that the data's own description calls awkward, and the clean ones it begins with.
CHOSEN = (
    *("patient007_frame01", "patient007_frame07", "patient009_frame01", "patient009_frame13"),
    *("patient021_frame01", "patient021_frame13", "patient041_frame01", "patient041_frame11"),
    *("patient084_frame01", "patient084_frame10", "patient029_frame01", "patient029_frame12"),
    *("patient012_frame01", "patient012_frame13"),
)
EXTRA = {
    "pig ED": ("pig/ep_pig_E774_SAX_ED_phase00_slices6-19_label.nii.gz", {"lv": 1, "myo": 2}),
    "pig ES": ("pig/ep_pig_E774_SAX_ES_phase11_slices6-19_label.nii.gz", {"lv": 1, "myo": 2}),
    "rodero01 vent": ("rodero01/rodero01_sax_vent_1.5x1.5x10_label.nii.gz", {"lv": 3, "myo": 2}),
}


def cases(data: Path) -> list[dict[str, str]]:
    """Rows of cases.csv whose file is there."""
    with (data / "acdc" / "cases.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    return [row for row in rows if (data / "acdc" / row["file"]).is_file()]


def choose(rows: list[dict[str, str]], count: int) -> list[dict[str, str]]:
    """The named maps, then ED and ES of further patients of each group in turn, up to ``count``."""
    picked = [row for row in rows if row["id"] in CHOSEN]
    groups = sorted({row["group"] for row in rows})
    pools = {(g, p): [r for r in rows if (r["group"], r["phase"]) == (g, p)] for g in groups for p in ("ED", "ES")}
    step = 0
    while len(picked) < min(count, len(rows)):
        for pool in pools.values():
            row = pool[(7 * step + 3) % len(pool)]
            if row not in picked and len(picked) < count:
                picked.append(row)
        step += 1
    return picked


#: Objects of the surface benchmark: the structures each is the union of. ``heart`` is what a mesh is made from: its
#: apex is extended where the labels leave the cavity bare.
OBJECTS = {"lv": ("lv",), "epi": ("lv", "myo"), "heart": ("lv", "myo"), "rv": ("rv",)}


def one_surface(job: tuple[str, str, str, str, tuple[str, ...]]) -> dict[str, Any]:
    """Fit the LV cavity, LV + myocardium and the RV cavity of one map, or some of them; measure them."""
    import femprep as fp
    from femprep.mesh.measures.triangles import triangle_quality
    from femprep.mesh.search.intersection import self_intersections
    from femprep.report.notices import lines
    from femprep.surface import label_distance, surface_quality

    name, path, group, method, objects = job
    row: dict[str, Any] = {"case": name, "group": group}
    outcomes = []
    for key in objects:
        try:
            start = time.perf_counter()
            seg = fp.read_segmentation(path, preset="acdc")
            obj = seg.object(*OBJECTS[key])
            if key == "heart":
                boundary = fp.extend_apex(seg, obj, endo=fp.fit_surface(seg.object("lv"), method=method))
                surface = fp.fit_surface(obj, method=method, boundary=boundary)
            else:
                surface = fp.fit_surface(obj, method=method)
            row[f"{key}_seconds"] = time.perf_counter() - start
            quality = triangle_quality(surface.points, surface.triangles)
            row[f"{key}_q_mean"], row[f"{key}_q_min"] = float(quality.mean()), float(quality.min())
            row[f"{key}_crossings"] = len(self_intersections(surface.points, surface.triangles))
            row[f"{key}_sound"] = surface_quality(surface).sound
            off = label_distance(surface, obj)
            row["pixel"] = float(np.sort(seg.grid.spacing)[0])
            row[f"{key}_in_slice"], row[f"{key}_farthest_pixels"] = off.nearest, off.farthest / row["pixel"]
            row[f"{key}_volume_percent"] = 100.0 * (surface.volume / obj.volume - 1.0)
            taken = [one for one in surface.info.get("attempts", ()) if one["status"] == "taken"]
            row[f"{key}_way"] = f"{taken[0]['beginning']}, {taken[0]['way']}" if taken else "none"
            row[f"{key}_mended"] = "; ".join(lines(surface.info))
        except fp.FemprepError as error:
            kind = "refused" if error.exit_status == 2 else "failed"
            outcomes.append(f"{key} {kind}: {error}")
    row["outcome"] = "; ".join(outcomes) or "done"
    return row


def one_mesh(job: tuple[str, str, dict[str, int] | None, dict[str, Any]]) -> dict[str, Any]:
    """Mesh one map the whole way into a temporary folder; measure it."""
    import femprep as fp

    name, path, structures, volume = job
    row: dict[str, Any] = {"case": name}
    try:
        start = time.perf_counter()
        seg = fp.read_segmentation(path, structures=structures, preset=None if structures else "acdc")
        run = fp.mesh_segmentation(seg, volume=volume, formats=("abaqus", "dolfinx", "gmsh"))
        with tempfile.TemporaryDirectory() as folder:
            manifest = fp.write_run(run, Path(folder) / "out", source=path)
        row["seconds"] = time.perf_counter() - start
        row["seconds_volume"] = run.seconds["volume"]
        runs = run.mesh.info["attempts"]
        row["seconds_mesher"] = sum(entry.get("processor_seconds", 0.0) for entry in runs)
        row["runs"], row["levels"] = len(runs), runs[-1].get("refined_levels", 0)
        for record in run.fidelity.records:
            row[f"{record.surface}_mean_mm"], row[f"{record.surface}_greatest_mm"] = (
                record.mean_mm,
                record.greatest_mm,
            )
        measures = run.quality.measures
        row["cells"] = run.mesh.n_cells
        row["dihedral_min"] = measures["minimum_dihedral"].min
        row["mean_ratio_mean"] = measures["mean_ratio"].mean
        row["cavity_percent"] = manifest.volumes[0].difference_percent
        row["wall_percent"] = manifest.volumes[1].difference_percent
        base = run.mesh.planes["base"]
        first = 0
        for block in run.mesh.facets.values():
            on_base = block[run.mesh.facet_tag[first : first + len(block)] == run.mesh.facet_names["base"]]
            first += len(block)
            row["base_error_mm"] = float(np.abs(base.signed_distance(run.mesh.points[np.unique(on_base)])).max())
        row["thickness_min_mm"] = run.wall.info.get("thickness", {}).get("minimum_mm")
        row["passed"] = run.quality.passed
        row["outcome"] = "done" if run.quality.passed else "done, check failed: " + "; ".join(run.quality.failures)
    except fp.FemprepError as error:
        row["outcome"] = f"refused: {error}" if error.exit_status == 2 else f"failed: {error}"
    return row


def summary(rows: list[dict[str, Any]]) -> None:
    """Outcomes, then least, mean and greatest of every figure."""
    for outcome, count in Counter(row["outcome"] for row in rows).most_common():
        print(f"{count:4d}  {outcome}")
    keys = [key for key in rows[0] if key not in ("case", "group", "outcome", "passed")]
    print(f"\n{'':24s}{'min':>12s}{'mean':>12s}{'max':>12s}")
    for key in keys:
        values = [row[key] for row in rows if isinstance(row.get(key), int | float)]
        if values:
            print(f"{key:24s}{min(values):12.4g}{np.mean(values):12.4g}{max(values):12.4g}")


#: Quality asked of each object's triangles: mean and least Q.
ASKED = {"lv": (0.95, 0.5), "epi": (0.95, 0.5), "heart": (0.95, 0.5), "rv": (0.92, 0.4)}
#: Greatest distance to the labels in any place of any slice, pixels, that a finished mesh may have.
GREATEST = 2.0


#: Mean distance to the labels' contours asked for, mm, where pixels are 1.4 to 1.6 mm.
IN_SLICE = 0.4


def against_asked(rows: list[dict[str, Any]]) -> None:
    """How many surfaces of each object have the quality asked for, and which have not or were refused."""
    for key, (mean, least) in ASKED.items():
        fitted = [row for row in rows if f"{key}_q_min" in row]
        refused = [
            row["case"] for row in rows if any(f"{key} {how}:" in row["outcome"] for how in ("refused", "failed"))
        ]
        if not fitted and not refused:
            continue
        short = [row for row in fitted if row[f"{key}_q_mean"] < mean or row[f"{key}_q_min"] < least]
        crossing = sum(row[f"{key}_crossings"] > 0 for row in fitted)
        unsound = sum(not row[f"{key}_sound"] for row in fitted)
        print(
            f"\n{key}: {len(fitted)} accepted, {crossing} of them crossing, {unsound} unsound; "
            f"{len(short)} short of Q {mean} / {least}"
        )
        for row in sorted(short, key=lambda row: row[f"{key}_q_min"])[:10]:
            print(f"    {row['case']}  Q mean {row[f'{key}_q_mean']:.3f}  min {row[f'{key}_q_min']:.3f}")
        usual = [row for row in fitted if 1.4 <= row["pixel"] <= 1.6]
        if usual:
            far = [row[f"{key}_in_slice"] for row in usual]
            named = ", ".join(row["case"] for row in usual if row[f"{key}_in_slice"] > IN_SLICE)
            print(f"    in slices {np.mean(far):.3f} mm, {max(far):.3f} at most ({len(usual)} maps, 1.4-1.6 mm pixels)")
            print(f"    farther than {IN_SLICE} mm: {named or 'none'}")
        far = [row["case"] for row in fitted if row[f"{key}_farthest_pixels"] > GREATEST]
        print(f"    farther than {GREATEST:g} pixels in some place: {len(far)}: {', '.join(far) or 'none'}")
        for way, count in Counter(row[f"{key}_way"] for row in fitted).most_common():
            print(f"    {count:4d}  {way}")
        harmonic = [row["case"] for row in fitted if "method even" in row[f"{key}_mended"]]
        print(f"    harmonic in place of smooth: {', '.join(harmonic) or 'none'}")
        share = 100.0 * len(refused) / (len(fitted) + len(refused))
        print(f"    refused {len(refused)} ({share:.1f} %): {', '.join(refused) or 'none'}")


def main(arguments: list[str] | None = None) -> list[dict[str, Any]]:
    """Run the chosen benchmark."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("surfaces", "meshes"))
    parser.add_argument("--count", type=int, default=None, help="maps to run [surfaces: all, meshes: 24]")
    parser.add_argument("--edge", type=float, default=2.5, help="edge length of the meshes, mm")
    parser.add_argument("--refinement", choices=("auto", "none"), help="of the meshes; the default where left out")
    parser.add_argument("--only", nargs="+", help="of the meshes, by name: patient007_frame01, or 'pig ED'")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument(
        "--objects", nargs="+", choices=tuple(OBJECTS), default=["lv", "epi", "rv"], help="surfaces to fit"
    )
    parser.add_argument("--every", type=int, default=1, help="surfaces of one map in so many")
    parser.add_argument("--method", choices=("smooth", "even", "paper"), default="smooth", help="of fitting surfaces")
    parser.add_argument("--csv", type=Path, help="file for a line per case")
    given = parser.parse_args(arguments)
    data = Path(os.environ["FEMPREP_DATA"])
    rows = cases(data)
    if given.what == "surfaces":
        rows = rows[:: given.every] if given.count is None else choose(rows, given.count)
        rest = (given.method, tuple(given.objects))
        jobs: list[Any] = [(row["id"], str(data / "acdc" / row["file"]), row["group"], *rest) for row in rows]
        work: Any = one_surface
    else:
        chosen = choose(rows, given.count or 24)
        volume = {"edge_length": given.edge} | ({"refinement": given.refinement} if given.refinement else {})
        jobs = [(row["id"], str(data / "acdc" / row["file"]), None, volume) for row in chosen]
        jobs += [(name, str(data / path), labels, volume) for name, (path, labels) in EXTRA.items()]
        if given.only:
            jobs = [job for job in jobs if job[0] in given.only]
        work = one_mesh
    results = []
    with ProcessPoolExecutor(given.jobs) as pool:
        for result in pool.map(work, jobs):
            results.append(result)
            print(shown(result), flush=True)
    print()
    summary(results)
    if given.what == "surfaces":
        against_asked(results)
    if given.csv:
        keep(results, given.csv)
    return results


if __name__ == "__main__":
    main()
