"""Both ventricles and the whole heart through femprep: tags, regions against the labels, element quality; tables.

    python tests/benchmarks/bench_anatomies.py biv             40 ACDC maps: 4 of each group at ED and at ES
    python tests/benchmarks/bench_anatomies.py whole-heart     Rodero 01 at 1 mm and as a stack of 1.4 x 1.4 x 8 mm

Needs FEMPREP_DATA. A line per case in CSV goes to --csv as it is done; the summary to standard output.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from itertools import chain, zip_longest
from pathlib import Path
from typing import Any

import numpy as np
from bench_acdc import cases, summary
from rows import keep, shown

#: Facet tags a mesh of each anatomy must have, and its regions.
TAGS = {
    "biv": ({"endo_lv", "endo_rv", "epi", "base"}, {"lv", "rv", "septum"}),
    "whole-heart": ({"endo_lv", "endo_rv", "endo_la", "endo_ra", "epi"}, {"lv", "rv", "septum", "la", "ra"}),
}
RODERO = {
    "rodero01 1 mm": "rodero01/rodero01_4ch_1.0mm_label.nii.gz",
    "rodero01 stack": "rodero01/rodero01_sax_4ch_1.4x1.4x8_label.nii.gz",
}


def choose(rows: list[dict[str, str]], count: int) -> list[dict[str, str]]:
    """Maps of every group at ED and ES in equal numbers, evenly spread over the patients; groups in turn."""
    kinds = sorted({(row["group"], row["phase"]) for row in rows})
    each = -(-count // len(kinds))
    pools = []
    for kind in kinds:
        pool = [row for row in rows if (row["group"], row["phase"]) == kind]
        pools.append([pool[i * len(pool) // each] for i in range(min(each, len(pool)))])
    return [row for row in chain.from_iterable(zip_longest(*pools)) if row is not None][:count]


def measure(run: Any, anatomy: str) -> dict[str, Any]:
    """Figures of any finished run."""
    from femprep.mesh.measures.volume_elements import element_volumes

    measures, mesh = run.quality.measures, run.mesh
    tags, regions = TAGS[anatomy]
    return {
        "cells": mesh.n_cells,
        "missing_tags": " ".join(sorted(tags - set(mesh.facet_names))) or 0,
        "missing_regions": " ".join(sorted(regions - set(mesh.region_names))) or 0,
        "inverted": int((element_volumes(mesh.points, mesh.cells["tetra"], "tetra") <= 0).sum()),
        "dihedral_min": measures["minimum_dihedral"].min,
        "dihedral_median": measures["minimum_dihedral"].median,
        "mean_ratio_mean": measures["mean_ratio"].mean,
        "radius_ratio_min": measures["radius_ratio"].min,
        "radius_ratio_median": measures["radius_ratio"].median,
        "thickness_min_mm": run.wall.info["thickness"]["minimum_mm"],
        "checks": "passed" if run.quality.passed else "; ".join(run.quality.failures),
    }


@contextmanager
def outcome_told(row: dict[str, Any]) -> Iterator[None]:
    """Note in a row how its block ended: done, refused or failed, and why."""
    import femprep as fp

    try:
        yield
        row["outcome"] = "done" if row["checks"] == "passed" else "done, check failed: " + row["checks"]
    except fp.FemprepError as error:
        row["outcome"] = f"refused: {error}" if error.exit_status == 2 else f"failed: {error}"


def meshed(row: dict[str, Any], path: str, anatomy: str, preset: str, changes: dict[str, Any]) -> tuple[Any, Any]:
    """A label map and its run, with processor time and figures noted in the row."""
    import femprep as fp

    start = time.process_time()
    seg = fp.read_segmentation(path, preset=preset)
    run = fp.mesh_segmentation(seg, anatomy=anatomy, preset=preset, **changes)
    row["processor_seconds"] = time.process_time() - start
    row.update(measure(run, anatomy))
    return seg, run


def one_biv(name: str, path: str, changes: dict[str, Any]) -> dict[str, Any]:
    """Mesh both ventricles of one map; measure them."""
    import femprep as fp
    from femprep.mesh.measures.volume_elements import centroids, element_volumes
    from femprep.report.volumes import cavity_volume, voxel_volume

    row: dict[str, Any] = {"case": name}
    with outcome_told(row):
        seg, run = meshed(row, path, "biv", "acdc", changes)
        base = run.mesh.planes["base"]
        row["base_source"] = base.source
        for side in ("lv", "rv"):
            voxels = voxel_volume(run.objects[side], [base])
            row[f"{side}_cavity_percent"] = 100.0 * (cavity_volume(run.mesh, f"endo_{side}") / voxels - 1.0)
        # Between the closed rings at either end, where the labels tell the wall and nothing is extrapolated.
        planes = [base, fp.find_apex(seg)]
        cells = run.mesh.cells["tetra"]
        centre, volume = centroids(run.mesh.points, cells, "tetra"), element_volumes(run.mesh.points, cells, "tetra")
        between = np.all([plane.signed_distance(centre) < 0 for plane in planes], axis=0)
        names = run.mesh.region_names
        left = between & np.isin(run.mesh.region, [names["lv"], names["septum"]])
        muscle = voxel_volume(run.objects["lv_epi"], planes) - voxel_volume(run.objects["lv"], planes)
        row["lv_and_septum_percent"] = 100.0 * (float(volume[left].sum()) / muscle - 1.0)
        for region, tag in names.items():
            row[f"{region}_ml"] = float(volume[run.mesh.region == tag].sum()) / 1000.0
    return row


def one_heart(name: str, path: str, out: Path | None, changes: dict[str, Any]) -> dict[str, Any]:
    """Mesh the whole heart of one map; measure it."""
    import femprep as fp
    from femprep.report.volumes import cavity_volume

    row: dict[str, Any] = {"case": name}
    with outcome_told(row):
        seg, run = meshed(row, path, "whole-heart", "rodero", changes)
        if out is not None:
            fp.write_run(run, out / name.replace(" ", "_"), source=path)
        for record in run.wall.info["repaired"]:
            if "thickened" in record:
                row[f"{record['thickened']}_thickened_share"] = record["share_of_vertices"]
        for number, record in enumerate(run.wall.info.get("openings", [])):
            key = f"opening_{number}_{record['name']}_{record['between'][0]}"
            row[key] = record.get("radius_mm", "closed")
        for side in ("lv", "rv", "la", "ra"):
            voxels = seg.object(side).volume
            row[f"{side}_cavity_percent"] = 100.0 * (cavity_volume(run.mesh, f"endo_{side}") / voxels - 1.0)
    return row


def main(arguments: list[str] | None = None) -> list[dict[str, Any]]:
    """Run the chosen benchmark."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("biv", "whole-heart"))
    parser.add_argument("--count", type=int, default=40, help="ACDC maps to run")
    parser.add_argument("--edge", type=float, default=3.0, help="edge length of the meshes, mm")
    parser.add_argument("--quality", choices=("fast", "good", "best"), default="good", help="asked of fTetWild")
    parser.add_argument("--vertices", type=int, default=1500, help="of each cavity's surface")
    parser.add_argument(
        "--method", choices=("paper", "even", "smooth"), help="of the surfaces; the default where left out"
    )
    parser.add_argument("--only", nargs="+", help="cases to run, by name: patient001_frame01, or 'rodero01 stack'")
    parser.add_argument("--openings", choices=("closed", "labels"), default="closed", help="of the whole hearts")
    parser.add_argument("--minimum-thickness", type=float, default=1.0, help="of the wall, mm")
    parser.add_argument("--out", type=Path, help="folder for the whole hearts' meshes")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--csv", type=Path, help="file for a line per case")
    given = parser.parse_args(arguments)
    data = Path(os.environ["FEMPREP_DATA"])
    changes = {
        "volume": {"edge_length": given.edge, "quality": given.quality},
        "surface": {"vertices": given.vertices, **({"method": given.method} if given.method else {})},
        "wall": {"minimum_thickness": given.minimum_thickness, "openings": given.openings},
    }
    if given.what == "biv":
        chosen = choose(cases(data), given.count)
        jobs: list[Any] = [(one_biv, row["id"], str(data / "acdc" / row["file"]), changes) for row in chosen]
    else:
        jobs = [(one_heart, name, str(data / path), given.out, changes) for name, path in RODERO.items()]
    if given.only:
        jobs = [job for job in jobs if job[1] in given.only]
    results: list[dict[str, Any]] = []
    with ProcessPoolExecutor(given.jobs) as pool:
        for future in as_completed([pool.submit(*job) for job in jobs]):
            results.append(future.result())
            print(shown(results[-1]), flush=True)
            if given.csv:
                keep(results, given.csv)
    print()
    summary(sorted(results, key=len, reverse=True))
    return results


if __name__ == "__main__":
    main()
