"""Run by a Python that has cardiac_geometries: integrals over every tag and of every direction of our folder, as JSON.

    python cardiac_geometries_read.py OUT/dolfinx folder|file

``folder`` is ``Geometry.from_folder``, through ADIOS2; ``file`` is ``Geometry.from_file`` on the HDF5 file, without.
"""

import json
import sys

# This order is needed where the packages are wheels: their libraries of MPI and HDF5 shut others out.
import h5py  # noqa: F401  # isort: skip
from mpi4py import MPI  # isort: skip
import dolfinx  # isort: skip
from cardiac_geometries.geometry import Geometry

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
