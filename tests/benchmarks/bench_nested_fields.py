"""Coordinates and fibres of a refined mesh from its coarser meshes, beside those of the finest mesh alone.

    FEMPREP_DATA=... python tests/benchmarks/bench_nested_fields.py                      2.5 and 1.25 mm
    FEMPREP_DATA=... python tests/benchmarks/bench_nested_fields.py --edge 1.25

For each edge length: processor seconds of all fields both ways, the greatest and the root-mean-square difference of the
coordinates, the largest angle between fibres, and beside them how much the mesh's coordinates and fibres differ from
those of the mesh one level coarser, of which all its figures are a small part.
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from bench_meshers import acdc

import femprep as fp
from femprep.anatomy import WallFields
from femprep.model import FloatArray, VolumeMesh


def fields_of(mesh: VolumeMesh, axes: fp.VentricularAxes) -> tuple[dict[str, FloatArray], FloatArray, float]:
    """Coordinates at nodes, fibres of elements, processor seconds of the fields without assembly of their space."""
    found = WallFields(mesh, axes)
    start = time.process_time()
    found.solve()
    seconds = time.process_time() - start
    cosine, sine = found.turn
    nodes = {"across": found.across_distance, "upward": found.upward_distance, "cos": cosine, "sin": sine}
    return nodes, np.asarray(fp.add_fibres(mesh, fields=found).cell_data["fiber"]), seconds


def angle(one: FloatArray, other: FloatArray) -> FloatArray:
    """Angle between fibres, degrees."""
    return np.degrees(np.arccos(np.clip(np.abs(np.einsum("ij,ij->i", one, other)), 0.0, 1.0)))


def compare(mesh: VolumeMesh) -> None:
    nested = mesh.nested
    if nested is None:
        print(f"  {mesh.n_cells} tetrahedra: the wall bears no refinement to this edge length")
        return
    axes = fp.ventricular_axes(mesh)
    for one in (nested.coarse, replace(nested.coarse, nested=None)):  # not counted: compiles the kernels
        fields_of(one, axes)
    coarse, coarse_fibre, _ = fields_of(nested.coarse, axes)
    found, fibre, quick = fields_of(mesh, axes)
    wanted, alone, slow = fields_of(replace(mesh, nested=None), axes)
    print(f"  {mesh.n_cells} tetrahedra: {quick:.2f} s from coarser meshes, {slow:.2f} s by itself")
    for name in found:
        off, level = found[name] - wanted[name], nested.down @ coarse[name] - wanted[name]
        print(
            f"    {name}: rms {np.sqrt((off**2).mean()):.1e}, most {np.abs(off).max():.1e}; "
            f"one level coarser {np.sqrt((level**2).mean()):.1e}, {np.abs(level).max():.1e}"
        )
    off, level = angle(fibre, alone), angle(coarse_fibre[nested.parent], alone)
    print(
        f"    fibres: mean {off.mean():.1e}, most {off.max():.1e} degrees; one level coarser: mean {level.mean():.1f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--case", default="patient007_frame01", help="frame of the ACDC training data")
    parser.add_argument("--edge", nargs="+", type=float, default=[2.5, 1.25], help="edge lengths, mm")
    given = parser.parse_args()
    endo, epi, base = acdc(Path(os.environ["FEMPREP_DATA"]), given.case)
    wall = fp.build_wall(epi=epi, endo={"lv": endo}, base=base)
    for edge in given.edge:
        print(f"edge length {edge} mm", flush=True)
        compare(fp.tetrahedralize(wall, edge_length=edge))


if __name__ == "__main__":
    main()
