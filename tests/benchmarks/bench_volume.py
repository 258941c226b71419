"""fTetWild on raw boolean cuts and on femprep's wall: seconds, memory, elements, quality; prints a table.

    python tests/benchmarks/bench_volume.py                              an ellipsoidal LV of 75 cm3
    python tests/benchmarks/bench_volume.py --edge 6 3.2 2.5 1.5
    python tests/benchmarks/bench_volume.py --wall wall.vtp --edge 2.5   a wall of a run (cell data facet_tag)

"mesher s" is the processor time of fTetWild's own process, "rest s" that of everything after it (tags, planes,
optimisation). Peak memory is that of fTetWild's process.

There are two raw cuts: of surfaces as dense as voxels make them, in the mesher's own envelope (a thousandth of the
diagonal), which is what one does without femprep, and of femprep's surfaces in femprep's envelope, which tells what the
rim alone does.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from femprep.errors import FemprepError
from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.measures.volume_elements import element_measures
from femprep.model import Plane, Surface, Wall
from femprep.options import VolumeOptions
from femprep.template import charge_template
from femprep.volume.tetrahedra import tetrahedralize
from femprep.volume.tetwild.guard import run_tetwild
from femprep.volume.tetwild.ways import planned_runs
from femprep.volume.validate import mean_thickness
from femprep.wall import build_wall

HEIGHT = 10.0
SHAPES = {"lv": (22.0, 22.0, 42.0), "epi": (31.0, 31.0, 51.0)}


def ellipsoid(name: str, vertices: int) -> Surface:
    """A closed ellipsoid on the charge template."""
    template = charge_template(vertices)
    axes = np.array(SHAPES[name])
    points = template.directions * axes
    return Surface(points, template.cells, name, template.directions, lambda d: np.asarray(d) * axes)


def clean_wall(vertices: int) -> Wall:
    """The wall femprep builds."""
    base = Plane(np.array([0.0, 0.0, HEIGHT]), np.array([0.0, 0.0, 1.0]))
    return build_wall(epi=ellipsoid("epi", vertices), endo={"lv": ellipsoid("lv", vertices)}, base=base)


def raw_cut(vertices: int) -> tuple[np.ndarray, np.ndarray]:
    """The same surfaces by a plain boolean difference and a plain cut, slivers and all."""
    import manifold3d

    solids = []
    for name in ("epi", "lv"):
        surface = ellipsoid(name, vertices)
        mesh = manifold3d.Mesh64(np.array(surface.points), np.array(surface.cells, dtype=np.uint64))
        solids.append(manifold3d.Manifold(mesh))
    mesh = (solids[0] - solids[1]).trim_by_plane((0.0, 0.0, -1.0), -HEIGHT).to_mesh64()
    points, triangles = np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, dtype=np.int64)
    joined = np.arange(len(points))
    joined[np.asarray(mesh.merge_from_vert, dtype=np.int64)] = np.asarray(mesh.merge_to_vert, dtype=np.int64)
    return points, joined[triangles]


def read_wall(path: Path) -> Wall:
    """A wall file: triangles with cell data ``facet_tag``; the base plane is that of the base facets."""
    import pyvista

    from femprep.model import FACET_TAGS

    mesh = pyvista.read(path)
    points, triangles = np.asarray(mesh.points, dtype=float), mesh.faces.reshape(-1, 4)[:, 1:]
    tag = np.asarray(mesh.cell_data["facet_tag"])
    planes = {}
    for name in ("base", "apex"):
        corners = points[triangles[tag == FACET_TAGS[name]]]
        if len(corners):
            normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
            planes[name] = Plane(corners.mean(axis=(0, 1)), normal)
    return Wall(points, triangles, tag, np.full(len(points), -1), planes)


def row(*cells: object) -> None:
    print("| " + " | ".join(f"{c:.3g}" if isinstance(c, float) else str(c) for c in cells) + " |", flush=True)


def bench_raw(name: str, vertices: int, edge: float, options: VolumeOptions, *, own: bool) -> None:
    """fTetWild alone, with its own envelope or the one that tetrahedralize gives it."""
    points, triangles = raw_cut(vertices)
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    first = next(planned_runs(options, str, edge))
    settings = {
        "edge_length_abs": edge,
        "epsilon": 1e-3 if own else first.envelope / diagonal,
        "stop_energy": first.stop_energy,
        "num_threads": 1,
    }
    quality = float(triangle_quality(points, triangles).min())
    try:
        run = run_tetwild(points, triangles, settings, time_limit=options.time_limit, memory_limit=options.memory_limit)
    except FemprepError as error:
        row(name, len(triangles), edge, quality, str(error)[:60], *[""] * 5)
        return
    found = element_measures(run.points, run.cells, "tetra")
    peak = (run.peak_bytes or 0) / 1e6
    mean, angle = float(found["mean_ratio"].mean()), float(found["minimum_dihedral"].min())
    row(name, len(triangles), edge, quality, run.processor_seconds, "", round(peak), len(run.cells), angle, mean)


def bench_wall(wall: Wall, edge: float, options: VolumeOptions) -> None:
    """The whole of tetrahedralize."""
    quality = float(triangle_quality(wall.points, wall.triangles).min())
    start = time.process_time()
    try:
        mesh = tetrahedralize(wall, options=options, edge_length=edge)
    except FemprepError as error:
        row("femprep's wall", len(wall.triangles), edge, quality, str(error)[:60], *[""] * 5)
        return
    rest = time.process_time() - start
    found = element_measures(mesh.points, mesh.cells["tetra"], "tetra")
    tries = mesh.info["attempts"]
    seconds = sum(item.get("processor_seconds", 0.0) for item in tries)
    peak = max((item.get("peak_bytes") or 0) / 1e6 for item in tries)
    mean, angle = float(found["mean_ratio"].mean()), float(found["minimum_dihedral"].min())
    row("femprep's wall", len(wall.triangles), edge, quality, seconds, rest, round(peak), mesh.n_cells, angle, mean)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wall", type=Path, help="wall.vtp of a run; no raw cut then")
    parser.add_argument("--edge", type=float, nargs="+", default=[6.0, 3.2, 2.5, 1.5])
    parser.add_argument("--vertices", type=int, default=1500)
    parser.add_argument("--dense", type=int, default=6000, help="vertices of the dense surfaces")
    parser.add_argument("--envelope", type=float, help="mm; a twentieth of the edge length if not given")
    given = parser.parse_args()
    options = VolumeOptions(envelope=given.envelope, refinement="none")
    wall = read_wall(given.wall) if given.wall else clean_wall(given.vertices)
    print(f"wall of {wall.volume / 1000:.1f} cm3, {mean_thickness(wall):.1f} mm thick, {len(wall.triangles)} triangles")
    warm = [item for item in given.edge if item <= mean_thickness(wall)]
    tetrahedralize(wall, options=options, edge_length=max(warm), retries=0)  # compiles the kernels
    heads = ["edge mm", "least Q", "mesher s", "rest s", "peak MB", "tets", "least dihedral", "mean ratio"]
    row("surface", "triangles", *heads)
    row(*["---"] * 10)
    for edge in given.edge:
        if not given.wall:
            bench_raw("raw cut, dense", given.dense, edge, options, own=True)
            bench_raw("raw cut", given.vertices, edge, options, own=False)
        bench_wall(wall, edge, options)


if __name__ == "__main__":
    main()
