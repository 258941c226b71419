"""AHA segments of every ACDC map: which of the seventeen are empty, and how small the smallest is; prints a table.

    python tests/benchmarks/bench_aha.py [--first N] [--count N] [--csv FILE]

The surfaces are fitted and joined to a wall as in the main job. To be fast, gmsh fills it with tetrahedra on the wall's
own triangles in place of fTetWild: their quality does not matter here, their places and volumes do. Segments come from
``add_aha`` with the axes of the labels. Needs FEMPREP_DATA and gmsh.
"""

from __future__ import annotations

import argparse
import os
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from bench_acdc import cases
from rows import keep, shown

import femprep as fp
from femprep.model import REGION_TAGS, VolumeMesh, Wall


def fill(wall: Wall) -> VolumeMesh:
    """Tetrahedra in a wall, on its own triangles."""
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.model.addDiscreteEntity(2, 1)
        gmsh.model.mesh.addNodes(2, 1, np.arange(1, len(wall.points) + 1), np.array(wall.points).ravel())
        gmsh.model.mesh.addElementsByType(1, 2, [], np.array(wall.triangles).ravel() + 1)
        gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop([1])])
        gmsh.model.geo.synchronize()
        gmsh.model.mesh.generate(3)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        _, nodes = gmsh.model.mesh.getElementsByType(4)
    finally:
        gmsh.finalize()
    points = np.empty((len(tags), 3))
    points[np.asarray(tags, dtype=int) - 1] = np.reshape(coordinates, (-1, 3))
    cells = np.reshape(nodes, (-1, 4)).astype(int) - 1
    first, *others = (points[cells[:, i]] for i in range(4))
    inverted = np.linalg.det(np.stack([x - first for x in others], axis=1)) < 0
    cells[inverted] = cells[inverted][:, [0, 2, 1, 3]]
    return VolumeMesh(
        points,
        {"tetra": cells},
        np.full(len(cells), REGION_TAGS["lv"]),
        {"triangle": wall.triangles},
        wall.facet_tag,
        planes=wall.planes,
    )


def one(name: str, path: Path, vertices: int) -> dict[str, Any]:
    """Segments of one map."""
    row: dict[str, Any] = {"case": name}
    start = time.perf_counter()
    try:
        seg = fp.read_segmentation(path, preset="acdc")
        cavity, heart = seg.object("lv"), seg.object("lv", "myo")
        boundary = fp.extend_apex(seg, heart)
        endo = fp.fit_surface(cavity, vertices=vertices)
        epi = fp.fit_surface(heart, boundary=boundary, vertices=vertices)
        wall = fp.build_wall(epi=epi, endo={"lv": endo}, base=fp.find_base(seg))
        apex = wall.info["apex"]
        row["extrapolated_mm"] = float(apex.get("extrapolated_mm", 0.0)) if apex.get("extrapolated") else 0.0
        mesh = fp.add_aha(fill(wall), axes=fp.ventricular_axes(seg))
        record = mesh.info["aha"]
        volume = record["volumes_mm3"]
        missed = abs(sum(volume.values()) / wall.volume - 1.0)
        if missed > 1e-6:
            row["outcome"] = f"the tetrahedra miss {missed:.1e} of the wall"
            return row
        smallest = min(volume, key=volume.get)
        row.update(tetrahedra=mesh.n_cells, smallest=smallest, smallest_mm3=volume[smallest])
        row["apex_mm3"] = volume.get(17, 0.0)
        row["outcome"] = "17 segments" if not record["empty"] else f"empty: {record['empty']}"
    except fp.FemprepError as error:
        row["outcome"] = f"{'refused' if error.exit_status == 2 else 'failed'}: {error}"
    row["seconds"] = time.perf_counter() - start
    return row


def summary(rows: list[dict[str, Any]]) -> None:
    """Outcomes by whether the labels hold the apex, then the smallest segments."""
    for title, mine in (
        ("labels hold the apex", [r for r in rows if r.get("extrapolated_mm") == 0.0]),
        ("epicardium continued beyond the labels", [r for r in rows if r.get("extrapolated_mm", 0.0) > 0.0]),
        ("no wall", [r for r in rows if "extrapolated_mm" not in r]),
    ):
        print(f"{len(mine):4d}  {title}")
        for outcome, count in Counter(r["outcome"] for r in mine).most_common():
            print(f"      {count:4d}  {outcome}")
    for key in ("smallest_mm3", "apex_mm3", "tetrahedra", "seconds"):
        values = [r[key] for r in rows if key in r]
        if values:
            print(f"{key:14s} min {min(values):8.4g}  median {np.median(values):8.4g}  max {max(values):8.4g}")


def main() -> list[dict[str, Any]]:
    """All maps, or some of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0, help="maps to pass over [0]")
    parser.add_argument("--count", type=int, default=None, help="maps to run [all that follow]")
    parser.add_argument("--vertices", type=int, default=800, help="vertices of each surface")
    parser.add_argument("--csv", type=Path, help="file for a line per case")
    given = parser.parse_args()
    data = Path(os.environ["FEMPREP_DATA"])
    rows = []
    for case in cases(data)[given.first :][: given.count]:
        row = one(case["id"], data / "acdc" / case["file"], given.vertices)
        rows.append(row)
        print(shown(row), flush=True)
    print()
    summary(rows)
    if given.csv:
        keep(rows, given.csv)
    return rows


if __name__ == "__main__":
    main()
