"""fTetWild at each quality, and with elements asked for through the wall, on walls of real hearts; prints tables.

    FEMPREP_DATA=... python tests/benchmarks/bench_quality.py                          six ACDC maps, fast, good, best
    ... --case patient007_frame01 patient084_frame01 --quality good --edge 2.0
    ... --through 2 3                                      elements through the wall instead of an edge length
    ... --order 2                                          ten-node tetrahedra as well
    ... --purpose implicit explicit electrophysiology --quality good --refinement auto      limits of what it is for

"mesher s" is the processor time of all runs of fTetWild's own process, "rest s" that of everything else.
"""

from __future__ import annotations

import argparse
import os
import time
from itertools import product
from pathlib import Path

import numpy as np

import femprep as fp
from femprep.errors import FemprepError
from femprep.mesh.measures.volume_elements import element_measures
from femprep.model import VolumeMesh, Wall
from femprep.volume.quality.transmural import elements_through_wall
from femprep.volume.tetrahedra import tetrahedralize

CASES = (
    "patient007_frame01",
    "patient009_frame01",
    "patient012_frame13",
    "patient021_frame13",
    "patient041_frame01",
    "patient084_frame01",
)


def build(folder: Path, case: str) -> Wall:
    """The wall of one ACDC map."""
    seg = fp.read_segmentation(folder / case[:10] / f"{case}_gt.nii.gz", preset="acdc")
    outer = seg.object("lv", "myo")
    endo = fp.fit_surface(seg.object("lv"))
    epi = fp.fit_surface(outer, boundary=fp.extend_apex(seg, outer, endo=endo))
    return fp.build_wall(epi=epi, endo={"lv": endo}, base=fp.find_base(seg))


def row(*cells: object) -> None:
    print("| " + " | ".join(f"{c:.3g}" if isinstance(c, float) else str(c) for c in cells) + " |", flush=True)


def bench(case: str, wall: Wall, label: str, **asked: object) -> None:
    """One mesh, one row."""
    start = time.process_time()
    try:
        mesh = tetrahedralize(wall, **asked)
    except FemprepError as error:
        row(case, label, str(error)[:80], *[""] * 10)
        return
    rest = time.process_time() - start
    ((name, cells),) = mesh.cells.items()
    found = element_measures(mesh.points, cells, name)
    runs = mesh.info["attempts"]
    scaled, blunt = float(found["scaled_jacobian"].min()), float(found["maximum_dihedral"].max())
    seconds = sum(run.get("processor_seconds", 0.0) for run in runs)
    angle, ratio = found["minimum_dihedral"].min(), found["mean_ratio"].mean()
    jacobian = found["relative_jacobian"].min()
    shapes = (float(angle), blunt, float(ratio), float(jacobian), scaled)
    row(case, label, len(cells), *shapes, *through(mesh, asked), len(runs), seconds, rest)


def through(mesh: VolumeMesh, asked: dict[str, object]) -> tuple[str, str]:
    """Elements through the wall: least, fifth percentile and median; share of nodes with as many as asked for."""
    count = elements_through_wall(mesh)
    share = "" if "elements_through_wall" not in asked else f"{np.mean(count >= asked['elements_through_wall']):.3f}"
    return "{:g} {:g} {:g}".format(*np.percentile(count, [0, 5, 50])), share


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("FEMPREP_DATA", ".")))
    parser.add_argument("--case", nargs="+", default=list(CASES))
    parser.add_argument("--quality", nargs="+", default=["fast", "good", "best"])
    parser.add_argument("--edge", type=float, default=2.5)
    parser.add_argument("--through", type=int, nargs="+", default=[])
    parser.add_argument("--order", type=int, default=1)
    parser.add_argument("--refinement", choices=("auto", "none"), default="none")
    parser.add_argument("--purpose", nargs="+", default=["general"], help="what limits are those of")
    given = parser.parse_args()
    folder = given.data / "acdc" / "training"
    heads = (
        "dihedral min",
        "dihedral max",
        "mean ratio",
        "Jacobian min",
        "scaled Jacobian min",
        "through wall",
        "share",
    )
    row("case", "asked", "tets", *heads, "runs", "mesher s", "rest s")
    row(*["---"] * 13)
    for case in given.case:
        wall = build(folder, case)
        for quality, purpose in product(given.quality, given.purpose):
            common = {"quality": quality, "order": given.order, "refinement": given.refinement}
            common["limits"] = fp.CheckOptions(purpose=purpose)
            words = quality if purpose == "general" else f"{quality}, {purpose}"
            if not given.through:
                bench(case, wall, f"{words}, {given.edge:g} mm", edge_length=given.edge, **common)
            for number in given.through:
                bench(case, wall, f"{words}, {number} through", elements_through_wall=number, **common)


if __name__ == "__main__":
    main()
