"""One wall meshed coarsely and refined, beside meshers run to the same fineness: seconds, peak memory, quality.

    python tests/benchmarks/bench_refine.py                                   0.1 and 0.5 million elements
    python tests/benchmarks/bench_refine.py --sizes 0.1 0.5 2 10 --mesher refine gmsh-hxt
    FEMPREP_DATA=... python tests/benchmarks/bench_refine.py --case patient007_frame01

``refine`` is fTetWild at the coarsest edge length that gives the size by whole levels, then refinement, as
``refinement="auto"`` does it; its row has the seconds of both. Other meshers make fewer elements of the same edge
length: each is run a second time with edges that give as many as asked for, and that run is told. Everything runs in a
process of its own. Seconds are of the processor, warm, on a surface that is there already; "peak" is the whole
process' memory, of femprep and fTetWild the larger.
"""

from __future__ import annotations

import argparse
import json
import pickle
import subprocess
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

from bench_meshers import MESHERS, acdc, ellipsoid, parser_of, peak_memory, row

import femprep as fp
from femprep.mesh.measures.volume_elements import element_measures
from femprep.model import Plane, Wall
from femprep.volume.refine.plan import LONGEST, levels_of, measured_thickness
from femprep.volume.tetrahedra import tetrahedralize
from femprep.volume.validate import TETS_PER_CUBE

SIZES = (0.1, 0.5, 2.0, 10.0)
CHOICES = ("refine", "tetwild-good", "gmsh-hxt", "gmsh-delaunay", "tetgen")


def edge_for(wall: Wall, millions: float) -> float:
    """Edge length of so many million elements."""
    return float((TETS_PER_CUBE * wall.volume / (1e6 * millions)) ** (1.0 / 3.0))


def child(name: str, path: Path, edge: float) -> None:
    """Mesh once in this process and print the figures, JSON."""
    parts, planes = pickle.loads(path.read_bytes())
    wall = Wall(*parts, planes={key: Plane(*plane) for key, plane in planes.items()})
    told = {"seconds": 0.0, "peak": 0.0}
    if name == "refine":
        tetrahedralize(wall, edge_length=LONGEST / 2, refinement="auto")  # no kernel is compiled while the clock runs
        start = time.process_time()
        mesh = tetrahedralize(wall, edge_length=edge, refinement="auto", memory_limit=24.0, time_limit=3000.0)
        runs = mesh.info["attempts"]
        told = {
            "seconds": sum(run.get("processor_seconds", 0.0) for run in runs),
            "peak": max(float(run.get("peak_bytes") or 0.0) for run in runs),
        }
        points, cells = mesh.points, mesh.cells["tetra"]
    else:
        start = time.process_time()
        points, _, cells, own = MESHERS[name][1](None, None, None, wall, edge)  # type: ignore[arg-type]
        told.update(own)
    seconds = time.process_time() - start
    peak = max(peak_memory(), told["peak"])
    found = element_measures(points, cells, "tetra")
    if found["volume"].sum() < 0:
        found = element_measures(points, cells[:, [1, 0, 2, 3]], "tetra")
    angle = found["minimum_dihedral"]
    figures = {
        "elements": len(cells),
        "mesher": told["seconds"],
        "seconds": seconds,
        "peak": peak / 1e6,
        "dihedral": float(angle.min()),
        "ratio": float(found["mean_ratio"].mean()),
        "volume": float(found["volume"].sum() / wall.volume),
    }
    print("\n" + json.dumps(figures))


def main() -> None:
    parser = parser_of(__doc__, list(CHOICES), 1800.0)
    parser.add_argument("--sizes", nargs="+", type=float, default=list(SIZES[:2]), help="million elements")
    parser.add_argument("--edge", type=float, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.child:
        child(given.child[0], Path(given.child[1]), given.edge)
        return
    endo, epi, base = acdc(given.data, given.case) if given.case else ellipsoid()
    wall = fp.build_wall(epi=epi, endo={"lv": endo}, base=base)
    thickness = measured_thickness(wall)
    thin = thickness.of_all_but(5.0)
    print(f"wall of {wall.volume / 1000:.1f} cm3, {len(wall.triangles)} triangles, 5 % thinner than {thin:.1f} mm")
    row(
        "million",
        "mesher",
        "edge mm",
        "levels",
        "elements",
        "s of it fTetWild",
        "s",
        "peak MB",
        "dihedral",
        "mean ratio",
    )
    row(*["---"] * 10)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "wall.pickle"
        parts = (wall.points, wall.triangles, wall.facet_tag, wall.template)
        planes = {key: (plane.point, plane.normal) for key, plane in wall.planes.items()}
        path.write_bytes(pickle.dumps((parts, planes)))
        for millions in given.sizes:
            edge = edge_for(wall, millions)
            levels = levels_of(fp.VolumeOptions(edge_length=edge, refinement="auto"), thickness)
            for name in given.mesher:
                module = MESHERS[name][0] if name in MESHERS else None
                if module is not None and find_spec(module) is None:
                    print(f"left out: {name}, as {module} is not installed (pip install {module})")
                    continue
                found = run(name, path, edge, given.time_limit)
                if name != "refine" and not isinstance(found, str):
                    # As many elements as asked for, which other meshers make of shorter edges.
                    own = edge * (found["elements"] / (1e6 * millions)) ** (1.0 / 3.0)
                    found = run(name, path, own, given.time_limit)
                else:
                    own = edge
                head = (millions, name, round(own, 2), levels if name == "refine" else "")
                if isinstance(found, str):
                    row(*head, found, *[""] * 5)
                    continue
                row(*head, found["elements"], found["mesher"], found["mesher"] + found["seconds"], round(found["peak"]),
                    f"{found['dihedral']:.1f}", f"{found['ratio']:.3f}")  # fmt: skip


def run(name: str, path: Path, edge: float, limit: float) -> dict[str, float] | str:
    """The figures of a mesher in a process of its own, or why there are none."""
    command = [sys.executable, __file__, "--child", name, str(path), "--edge", str(edge)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit)
    except subprocess.TimeoutExpired:
        return f"not done within {limit:g} s"
    lines = done.stdout.strip().splitlines()
    if done.returncode or not lines:
        last = (done.stderr.strip().splitlines() or ["no word"])[-1]
        return f"status {done.returncode}: {last[:80]}"
    figures: dict[str, float] = json.loads(lines[-1])
    return figures


if __name__ == "__main__":
    main()
