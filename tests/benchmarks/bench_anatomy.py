"""Axes, coordinates, AHA segments and fibres of an LV of tetrahedra: seconds of each, by the size of the mesh.

    python tests/benchmarks/bench_anatomy.py

Prints one line a mesh: elements, nodes, seconds of coordinates, segments and fibres (elements and nodes), their sum,
processor time, and the mean error of the fibres against the analytic field, degrees. The stages share their fields.
"""

from __future__ import annotations

import argparse
import sys
import time
from itertools import pairwise
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from anatomy_meshes import ellipsoid
from ellipsoid_wall import EllipsoidWall

from femprep.anatomy import WallFields, add_aha, add_coordinates, add_fibres


def main() -> None:
    """Run and print."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    print("elements   nodes  coordinates  segments  fibres    sum  cpu   error")
    exact = EllipsoidWall((25.0, 55.0), (35.0, 65.0))
    for size, layers in ((8, 5), (12, 8), (16, 10), (24, 15)):
        mesh = ellipsoid("tetra", size=size, layers=layers).mesh
        times, cpu = [time.perf_counter()], time.process_time()
        fields = WallFields(mesh)
        mesh = add_coordinates(mesh, fields=fields)
        times.append(time.perf_counter())
        mesh = add_aha(mesh, fields=fields)
        times.append(time.perf_counter())
        mesh = add_fibres(mesh, fields=fields, nodes=True)
        times.append(time.perf_counter())
        cpu = time.process_time() - cpu
        centre = mesh.points[mesh.cells["tetra"]].mean(axis=1)
        dot = np.abs(np.sum(mesh.cell_data["fiber"] * exact.triads(centre)[:, :, 0], axis=1))
        error = np.degrees(np.arccos(np.clip(dot, 0, 1))).mean()
        steps = "  ".join(f"{b - a:8.2f}" for a, b in pairwise(times))
        print(
            f"{mesh.n_cells:8d} {len(mesh.points):7d}  {steps}  {times[-1] - times[0]:5.2f}  {cpu:4.1f}  {error:5.2f}"
        )


if __name__ == "__main__":
    main()
