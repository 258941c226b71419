"""One wall, every mesher: seconds, peak memory, elements, quality; prints a table.

    python tests/benchmarks/bench_meshers.py                                    an ellipsoidal LV of 75 cm3
    FEMPREP_DATA=... python tests/benchmarks/bench_meshers.py --case patient007_frame01 --edge 2.5
    ... --mesher sweep tetwild-good gmsh-hxt --time-limit 300

femprep's own (``sweep-...`` and ``tetwild-...``) stand beside gmsh, tetgen and pygalmesh, which femprep does not use:
those not installed are left out, with a word (pygalmesh has no wheel). fTetWild and gmsh mesh the wall's surface
anew, tetgen keeps its triangles. Each runs in a process of its own with a time limit. Seconds are of the
processor, on surfaces that are there already, warm (kernels compiled); "peak" is the whole process' memory.
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import femprep as fp
from femprep.mesh.measures.volume_elements import element_measures
from femprep.model import Plane, Surface, Wall
from femprep.sweeping import sweep
from femprep.sweeping.matching.match import match_surfaces
from femprep.template import charge_template
from femprep.volume.tetrahedra import tetrahedralize

#: Angle between triangles from which an edge of the wall is one of its rims, radians.
_RIM = 0.7
Cells = tuple[np.ndarray, str, np.ndarray, dict[str, float]]


def ellipsoid(vertices: int = 1500) -> tuple[Surface, Surface, Plane]:
    """Endocardium, epicardium and base of a thick ellipsoid."""
    template = charge_template(vertices)
    surfaces = []
    for name, axes in (("lv", np.array([22.0, 22.0, 42.0])), ("epi", np.array([31.0, 31.0, 51.0]))):
        surfaces.append(Surface(template.directions * axes, template.cells, name, directions=template.directions,
                                shape=lambda d, axes=axes: np.asarray(d) * axes))  # fmt: skip
    return surfaces[0], surfaces[1], Plane(np.array([0.0, 0.0, 10.0]), np.array([0.0, 0.0, 1.0]))


def acdc(folder: Path, case: str) -> tuple[Surface, Surface, Plane]:
    """Endocardium, epicardium and base of one ACDC map."""
    seg = fp.read_segmentation(folder / "acdc" / "training" / case[:10] / f"{case}_gt.nii.gz", preset="acdc")
    outer = seg.object("lv", "myo")
    endo = fp.fit_surface(seg.object("lv"))
    return endo, fp.fit_surface(outer, boundary=fp.extend_apex(seg, outer, endo=endo)), fp.find_base(seg)


def by_sweep(element: str) -> Callable[..., Cells]:
    def mesh(endo: Surface, epi: Surface, base: Plane, wall: Wall, edge: float) -> Cells:
        template = "quad" if element == "hexahedron" else "triangle"
        matched = match_surfaces(endo=endo, epi=epi, base=base, template=template, edge_length=edge)
        made = sweep(matched, element=element)
        ((name, cells),) = made.cells.items()
        return made.points, name, cells, {}

    return mesh


def by_tetwild(quality: str) -> Callable[..., Cells]:
    def mesh(endo: Surface, epi: Surface, base: Plane, wall: Wall, edge: float) -> Cells:
        made = tetrahedralize(wall, edge_length=edge, quality=quality, refinement="none")
        runs = made.info["attempts"]
        child = {"seconds": sum(run.get("processor_seconds", 0.0) for run in runs),
                 "peak": max(float(run.get("peak_bytes") or 0.0) for run in runs)}  # fmt: skip
        return made.points, "tetra", made.cells["tetra"], child

    return mesh


def by_gmsh(algorithm: int) -> Callable[..., Cells]:
    def mesh(endo: Surface, epi: Surface, base: Plane, wall: Wall, edge: float) -> Cells:
        import gmsh

        gmsh.initialize()
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.Algorithm3D", algorithm)
        gmsh.option.setNumber("Mesh.MeshSizeMax", edge)
        gmsh.option.setNumber("General.NumThreads", 1)
        surface = gmsh.model.addDiscreteEntity(2)
        gmsh.model.mesh.addNodes(2, surface, np.arange(1, len(wall.points) + 1), wall.points.ravel())
        gmsh.model.mesh.addElementsByType(surface, 2, [], (wall.triangles + 1).ravel())
        # Split along the rims and meshed anew: gmsh keeps triangles that it is given, and between those of 3 to 6 mm
        # and elements of 2.5 mm it leaves slivers (smallest dihedral angle 0.6 to 1.3 degrees, 12 to 15 on its own).
        gmsh.model.mesh.classifySurfaces(_RIM, True, True, np.pi)
        gmsh.model.mesh.createGeometry()
        loop = gmsh.model.geo.addSurfaceLoop([tag for _, tag in gmsh.model.getEntities(2)])
        gmsh.model.geo.addVolume([loop])
        gmsh.model.geo.synchronize()
        gmsh.model.mesh.generate(3)
        tags, points, _ = gmsh.model.mesh.getNodes()
        number = np.zeros(int(tags.max()) + 1, dtype=np.int64)
        number[tags.astype(np.int64)] = np.arange(len(tags))
        _, nodes = gmsh.model.mesh.getElementsByType(4)
        return points.reshape(-1, 3), "tetra", number[nodes.astype(np.int64)].reshape(-1, 4), {}

    return mesh


def by_tetgen(endo: Surface, epi: Surface, base: Plane, wall: Wall, edge: float) -> Cells:
    import tetgen

    made = tetgen.TetGen(np.array(wall.points), np.array(wall.triangles, dtype=np.int32))
    largest = edge**3 / (6.0 * np.sqrt(2.0))
    result = made.tetrahedralize(switches=f"pq1.2/14a{largest:.4f}Q")
    return np.asarray(result[0]), "tetra", np.asarray(result[1], dtype=np.int64), {}


def by_pygalmesh(endo: Surface, epi: Surface, base: Plane, wall: Wall, edge: float) -> Cells:
    import meshio
    import pygalmesh

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "wall.off"
        meshio.write(path, meshio.Mesh(np.array(wall.points), {"triangle": np.array(wall.triangles)}))
        made = pygalmesh.generate_volume_mesh_from_surface_mesh(
            str(path), max_cell_circumradius=0.75 * edge, max_radius_surface_delaunay_ball=0.6 * edge,
            max_facet_distance=edge / 20.0, min_facet_angle=25.0, verbose=False,
        )  # fmt: skip
    return np.asarray(made.points), "tetra", np.asarray(made.cells_dict["tetra"], dtype=np.int64), {}


MESHERS: dict[str, tuple[str | None, Callable[..., Cells]]] = {
    "sweep-tetra": (None, by_sweep("tetra")),
    "sweep-wedge": (None, by_sweep("wedge")),
    "sweep-hexahedron": (None, by_sweep("hexahedron")),
    "tetwild-fast": (None, by_tetwild("fast")),
    "tetwild-good": (None, by_tetwild("good")),
    "tetwild-best": (None, by_tetwild("best")),
    "gmsh-delaunay": ("gmsh", by_gmsh(1)),
    "gmsh-hxt": ("gmsh", by_gmsh(10)),
    "tetgen": ("tetgen", by_tetgen),
    "pygalmesh": ("pygalmesh", by_pygalmesh),
}


def child(name: str, path: Path, edge: float) -> None:
    """Mesh once in this process and print the figures, JSON."""
    surfaces, (point, normal), parts, planes = pickle.loads(path.read_bytes())
    endo, epi = (Surface(points, cells, name, directions=d) for points, cells, name, d in surfaces)
    base = Plane(point, normal)
    wall = Wall(*parts, planes={key: Plane(*plane) for key, plane in planes.items()})
    if name.startswith("sweep"):  # once before, so that no kernel is compiled while the clock runs
        MESHERS[name][1](endo, epi, base, wall, 2.0 * edge)
    start = time.process_time()
    points, kind, cells, own = MESHERS[name][1](endo, epi, base, wall, edge)
    seconds = time.process_time() - start + own.get("seconds", 0.0)
    peak = max(peak_memory(), own.get("peak", 0.0))
    found = element_measures(points, cells, kind)
    if kind == "tetra" and found["volume"].sum() < 0:
        found = element_measures(points, cells[:, [1, 0, 2, 3]], kind)
    figures = {
        "kind": kind,
        "elements": len(cells),
        "seconds": seconds,
        "peak": peak / 1e6,
        "inverted": int((found["relative_jacobian"] <= 0).sum()),
        "dihedral": [float(found["minimum_dihedral"].min()), float(found["maximum_dihedral"].max())],
        "ratio": [float(found["mean_ratio"].min()), float(found["mean_ratio"].mean())],
        "jacobian": float(found["scaled_jacobian"].min()),
        "volume": float(found["volume"].sum() / wall.volume),
    }
    print("\n" + json.dumps(figures))


def peak_memory() -> float:
    """Greatest memory of this process (VmHWM), bytes; 0 where the system does not tell."""
    status = Path("/proc/self/status")
    if not status.exists():
        return 0.0
    return next(1024.0 * float(line.split()[1]) for line in status.read_text().splitlines() if line.startswith("VmHWM"))


def row(*cells: object) -> None:
    print("| " + " | ".join(f"{c:.3g}" if isinstance(c, float) else str(c) for c in cells) + " |", flush=True)


def parser_of(description: str | None, meshers: list[str], limit: float) -> argparse.ArgumentParser:
    """Arguments of whatever meshes one wall by several meshers, each in a process of its own."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("FEMPREP_DATA", ".")))
    parser.add_argument("--case", help="an ACDC map, as patient007_frame01")
    parser.add_argument("--mesher", nargs="+", choices=meshers, default=meshers)
    parser.add_argument("--time-limit", type=float, default=limit, help="s, for each")
    parser.add_argument("--child", nargs=2, help=argparse.SUPPRESS)
    return parser


def main() -> None:
    parser = parser_of(__doc__, list(MESHERS), 900.0)
    parser.add_argument("--edge", type=float, default=2.5)
    given = parser.parse_args()
    if given.child:
        child(given.child[0], Path(given.child[1]), given.edge)
        return
    endo, epi, base = acdc(given.data, given.case) if given.case else ellipsoid()
    wall = fp.build_wall(epi=epi, endo={"lv": endo}, base=base)
    print(f"wall of {wall.volume / 1000:.1f} cm3, {len(wall.triangles)} triangles, edge length {given.edge:g} mm")
    heads = ("s", "peak MB", "inverted", "dihedral", "mean ratio min/mean", "scaled Jacobian min", "volume")
    row("mesher", "elements", *heads)
    row(*["---"] * 9)
    # Arrays alone: what the children need, and what can be pickled.
    surfaces = [(s.points, s.cells, s.name, s.directions) for s in (endo, epi)]
    parts = (wall.points, wall.triangles, wall.facet_tag, wall.template)
    planes = {key: (plane.point, plane.normal) for key, plane in wall.planes.items()}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "wall.pickle"
        path.write_bytes(pickle.dumps((surfaces, (base.point, base.normal), parts, planes)))
        for name in given.mesher:
            module = MESHERS[name][0]
            if module is not None and find_spec(module) is None:
                print(f"left out: {name}, as {module} is not installed (pip install {module})")
                continue
            command = [sys.executable, __file__, "--child", name, str(path), "--edge", str(given.edge)]
            try:
                result = subprocess.run(command, capture_output=True, text=True, timeout=given.time_limit)
            except subprocess.TimeoutExpired:
                row(name, f"not done within {given.time_limit:g} s", *[""] * 7)
                continue
            lines = result.stdout.strip().splitlines()
            if result.returncode or not lines:
                last = (result.stderr.strip().splitlines() or ["no word"])[-1]
                row(name, f"status {result.returncode}: {last[:80]}", *[""] * 7)
                continue
            f = json.loads(lines[-1])
            angles = "{:.1f} / {:.1f}".format(*f["dihedral"])
            row(name, f["elements"], f["seconds"], round(f["peak"]), f["inverted"], angles,
                "{:.2f} / {:.3f}".format(*f["ratio"]), f["jacobian"], f["volume"])  # fmt: skip


if __name__ == "__main__":
    main()
