"""Run by a Python that has cardiac_geometries: integrals over every tag and of every direction of our folder, as JSON.

    python cardiac_geometries_read.py OUT/dolfinx folder|file

``folder`` is ``Geometry.from_folder``, through ADIOS2; ``file`` is ``Geometry.from_file`` on the HDF5 file, without.
"""

import json
import sys

import dolfinx
import h5py  # noqa: F401  # before cardiac_geometries: the libraries that it loads bear no HDF5 after theirs
from cardiac_geometries.geometry import Geometry
from mpi4py import MPI

folder, how = sys.argv[1:]
if how == "file":
    import io4dolfinx

    io4dolfinx.set_default_backend("h5py")
    geometry = Geometry.from_file(MPI.COMM_WORLD, f"{folder}/mesh.h5")
else:
    geometry = Geometry.from_folder(MPI.COMM_WORLD, folder)


def integral(value):
    found = dolfinx.fem.assemble_scalar(dolfinx.fem.form(value))
    return geometry.mesh.comm.allreduce(found, op=MPI.SUM)


one = dolfinx.fem.Constant(geometry.mesh, 1.0)
found = {}
for name, (tag, dimension) in geometry.markers.items():
    found[name] = integral(one * (geometry.dx if dimension == 3 else geometry.ds)(int(tag)))
for name in ("f0", "s0", "n0"):
    function = getattr(geometry, name)
    if function is not None:
        found[name] = [integral(function[i] * geometry.dx) for i in range(3)]
if MPI.COMM_WORLD.rank == 0:
    print("RESULT " + json.dumps(found))
