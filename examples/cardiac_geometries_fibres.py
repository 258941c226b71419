"""A dolfinx folder of femprep's as a ``cardiac_geometries.Geometry`` with its fibres.

    python cardiac_geometries_fibres.py OUT/dolfinx [FOLDER]

Run by the Python that dolfinx and cardiac-geometriesx belong to. ``Geometry.from_folder`` takes mesh, tags, markers
and info from the folder as it is; fibres it reads from ADIOS checkpoints alone, which dolfinx' own tools write. So they
are filled in here from the HDF5 file: f0, s0 and n0, one vector per element (DG 0). With FOLDER the whole is saved
there by cardiac_geometries, checkpoints included: from then on ``Geometry.from_folder(comm, FOLDER)`` gives all of it.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import dolfinx
import h5py
import numpy as np
from cardiac_geometries.geometry import Geometry
from mpi4py import MPI

#: Names of the directions in cardiac_geometries, and in femprep.
DIRECTIONS = {"f0": "fiber", "s0": "sheet", "n0": "normal"}


def with_fibres(comm: MPI.Comm, folder: Path) -> Geometry:
    """The geometry of a folder, with the directions that its HDF5 file holds."""
    geometry = Geometry.from_folder(comm, folder)
    mesh = geometry.mesh
    space = dolfinx.fem.functionspace(mesh, ("DG", 0, (3,)))
    cells = mesh.topology.index_map(mesh.topology.dim)
    # dolfinx reorders cells; this says which row of the file each one was.
    row = np.asarray(mesh.topology.original_cell_index)[: cells.size_local]
    with h5py.File(folder / "mesh.h5", "r") as store:
        for name, own in DIRECTIONS.items():
            if f"cell_data/{own}" in store:
                function = dolfinx.fem.Function(space, name=name)
                dofs = space.dofmap.list[: cells.size_local, 0]
                function.x.array.reshape(-1, 3)[dofs] = store[f"cell_data/{own}"][()][row]
                function.x.scatter_forward()
                setattr(geometry, name, function)
    return geometry


def main(folder: Path, out: Path | None = None) -> dict[str, float | list[float]]:
    """Measure every marker and integrate every direction; save where a folder is given."""
    geometry = with_fibres(MPI.COMM_WORLD, folder)
    if out is not None:
        geometry.save_folder(out)
        geometry = Geometry.from_folder(MPI.COMM_WORLD, out)

    def integral(value: object) -> float:
        found = dolfinx.fem.assemble_scalar(dolfinx.fem.form(value))
        return float(geometry.mesh.comm.allreduce(found, op=MPI.SUM))

    one = dolfinx.fem.Constant(geometry.mesh, 1.0)
    found: dict[str, float | list[float]] = {}
    for name, (tag, dimension) in geometry.markers.items():
        found[name] = integral(one * (geometry.dx if dimension == 3 else geometry.ds)(int(tag)))
    for name in DIRECTIONS:
        function = getattr(geometry, name)
        if function is not None:
            found[name] = [integral(function[i] * geometry.dx) for i in range(3)]
    return found


if __name__ == "__main__":
    figures = main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
    print("RESULT " + json.dumps(figures))
