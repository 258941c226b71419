"""The same phantom through both doors: template surfaces, and STL files of it, as whoever made them might write them.

    python tests/benchmarks/bench_own_surfaces.py [--mesher sweep] [--edge-length 4]

Prints the table of docs/how-to/own-surfaces.md: volumes beside the closed form, quality of the elements, distance from
the exact surfaces.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

import own_shapes as shapes

import femprep as fp
from femprep.model.facets import facet_triangles
from femprep.report.volumes import cavity_volume
from femprep.template import charge_template

BASE = (0.0, 0.0, 20.0, 0.0, 0.0, 1.0)


def template_surfaces(vertices: int) -> dict[str, fp.Surface]:
    """Exact samples of the phantom at a template's vertices, as a fit gives them."""
    directions = charge_template(vertices).directions
    return {name: replace(shapes.closed(name, vertices), directions=directions) for name in ("lv", "epi")}


def doors(folder: Path, vertices: int) -> dict[str, dict[str, fp.Surface]]:
    """Surfaces by the door they come through; all but the first by STL files."""
    made = {
        "STL, closed": shapes.heart(vertices),
        "STL, closed, 6000 vertices": shapes.heart(6000),
        "STL, open cups": {name: shapes.cup(name, vertices=vertices) for name in ("lv", "epi")},
        "STL, flat lids": {name: shapes.lidded(name, vertices=vertices) for name in ("lv", "epi")},
        "STL, metres, turned inside out": {
            name: shapes.flipped(replace(one, points=1e-3 * one.points)) for name, one in shapes.heart(vertices).items()
        },
    }
    found = {"template": template_surfaces(vertices)}
    for k, (door, surfaces) in enumerate(made.items()):
        found[door] = {
            name: fp.read_surface(written(surface, folder / f"{k}_{name}.stl")) for name, surface in surfaces.items()
        }
    return found


def written(surface: fp.Surface, path: Path) -> Path:
    """The surface as a binary STL file."""
    import trimesh

    trimesh.Trimesh(surface.points, surface.triangles, process=False).export(path)
    return path


def main() -> None:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--mesher", default="tetwild")
    arguments.add_argument("--edge-length", type=float, default=4.0)
    arguments.add_argument("--vertices", type=int, default=1500)
    given = arguments.parse_args()
    wall, cavity = shapes.PHANTOM.wall_volume, shapes.PHANTOM.cavity_volume
    print("| door | wall, % off | cavity, % off | least dihedral | mean ratio | off the exact surfaces, mm | s |")
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for door, surfaces in doors(Path(folder), given.vertices).items():
            base = np.array(BASE)
            base[:3] *= 1e-3 if "metres" in door else 1.0
            cut = {} if "cups" in door or "lids" in door else {"base": tuple(base)}
            start = time.perf_counter()
            run = fp.mesh_surfaces(
                surfaces, volume={"mesher": given.mesher, "edge_length": given.edge_length}, wall=cut
            )
            took = time.perf_counter() - start
            off = []
            for name, facets in (("lv", "endo"), ("epi", "epi")):
                nodes = run.mesh.points[np.unique(facet_triangles(run.mesh, facets))]
                off.append(np.abs(shapes.PHANTOM.distance(name, nodes)))
            measures = run.quality.measures
            print(
                f"| {door} | {100 * (run.quality.volume / wall - 1):+.2f} "
                f"| {100 * (cavity_volume(run.mesh) / cavity - 1):+.2f} "
                f"| {measures['minimum_dihedral'].min:.1f} | {measures['mean_ratio'].mean:.3f} "
                f"| {np.concatenate(off).mean():.3f}, at most {np.concatenate(off).max():.2f} | {took:.0f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
