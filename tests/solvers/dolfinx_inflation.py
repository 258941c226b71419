"""Run by the system's Python with dolfinx: inflate the mesh of an XDMF file, print what it found as JSON.

Arguments: mesh.xdmf or a .msh, pressure, Young's modulus, Poisson's ratio, all in the file's units; degree of the
displacement; path of gmsh.py for a .msh. Where there is a file
``fiber.npy`` (the array ``cell_data/fiber`` of the HDF5 file), its integral over each region is printed too; where
there is ``pericardium.npy`` (``point_data/pericardium``, already in the file's units), springs of that stiffness hold
the epicardium along its normal, and their force, the base's and the pressure's are printed.
"""

import importlib.util
import json
import os
import sys

import numpy as np

if len(sys.argv) > 6:
    # dolfinx reads Gmsh's files through gmsh itself, whose module (one file beside its library) is given; dolfinx
    # looks for it when it is imported.
    spec = importlib.util.spec_from_file_location("gmsh", sys.argv[6])
    gmsh = importlib.util.module_from_spec(spec)
    sys.modules["gmsh"] = gmsh
    spec.loader.exec_module(gmsh)

import ufl
from dolfinx import fem
from dolfinx.io import XDMFFile, gmshio
from mpi4py import MPI
from petsc4py import PETSc

path, pressure, young, poisson = sys.argv[1], *map(float, sys.argv[2:5])
if path.endswith(".msh"):
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(path)
    groups = gmsh.model.getPhysicalGroups()
    markers = {gmsh.model.getPhysicalName(dim, tag).upper(): [tag, dim] for dim, tag in groups}
    mesh, cells, facets = gmshio.model_to_mesh(gmsh.model, MPI.COMM_WORLD, 0)
else:
    with open(path.replace("mesh.xdmf", "markers.json")) as file:
        markers = json.load(file)
    with XDMFFile(MPI.COMM_WORLD, path, "r") as xdmf:
        mesh = xdmf.read_mesh(name="Mesh")
        mesh.topology.create_connectivity(2, 3)
        cells = xdmf.read_meshtags(mesh, name="Cell tags")
        facets = xdmf.read_meshtags(mesh, name="Facet tags")

# On hexahedra two Gauss points each way, as CalculiX' C3D8 has.
rule = {} if mesh.topology.cell_name() == "tetrahedron" else {"quadrature_degree": 3}
dx = ufl.Measure("dx", domain=mesh, subdomain_data=cells, metadata=rule)
ds = ufl.Measure("ds", domain=mesh, subdomain_data=facets, metadata=rule)
one = fem.Constant(mesh, PETSc.ScalarType(1.0))
volumes = {n: fem.assemble_scalar(fem.form(one * dx(t))) for n, (t, dim) in markers.items() if dim == 3}
areas = {n: fem.assemble_scalar(fem.form(one * ds(t))) for n, (t, dim) in markers.items() if dim == 2}

fibres = {}
if os.path.exists("fiber.npy"):
    fiber = fem.Function(fem.VectorFunctionSpace(mesh, ("DG", 0)))
    fiber.x.array[:] = np.load("fiber.npy")[mesh.topology.original_cell_index].ravel()
    for name, (tag, dim) in markers.items():
        if dim == 3:
            fibres[name] = [fem.assemble_scalar(fem.form(fiber[i] * dx(tag))) for i in range(3)]

degree = int(sys.argv[5]) if len(sys.argv) > 5 else 1
space = fem.VectorFunctionSpace(mesh, ("Lagrange", degree))
u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
mu, la = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))


def strain(w):
    return ufl.sym(ufl.grad(w))


stress = 2 * mu * strain(u) + la * ufl.tr(strain(u)) * ufl.Identity(3)
normal = ufl.FacetNormal(mesh)
work = ufl.inner(stress, strain(v)) * ufl.dx(metadata=rule)
stiffness = None
if os.path.exists("pericardium.npy"):
    stiffness = fem.Function(fem.FunctionSpace(mesh, ("Lagrange", 1)))
    given = np.load("pericardium.npy")[mesh.geometry.input_global_indices]
    for cell in range(mesh.topology.index_map(3).size_local):
        stiffness.x.array[stiffness.function_space.dofmap.cell_dofs(cell)] = given[mesh.geometry.dofmap.links(cell)]
    work += stiffness * ufl.inner(normal, u) * ufl.inner(normal, v) * ds(markers["EPI"][0])
a = fem.form(work)
load = fem.form(-pressure * ufl.inner(normal, v) * ds(markers["ENDO"][0]))
base = facets.indices[facets.values == markers["BASE"][0]]
held = fem.dirichletbc(np.zeros(3, dtype=PETSc.ScalarType), fem.locate_dofs_topological(space, 2, base), space)
A = fem.petsc.assemble_matrix(a, bcs=[held])
A.assemble()
b = fem.petsc.assemble_vector(load)
fem.petsc.apply_lifting(b, [a], [[held]])
b.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
fem.petsc.set_bc(b, [held])
solver = PETSc.KSP().create(mesh.comm)
solver.setOperators(A)
solver.setType("preonly")
solver.getPC().setType("lu")
result = fem.Function(space)
solver.solve(b, result.vector)
values = result.x.array.reshape(-1, 3)
forces = {}
if stiffness is not None:
    whole = fem.petsc.assemble_matrix(a)
    whole.assemble()
    left = whole.createVecLeft()
    whole.mult(result.vector, left)
    left -= fem.petsc.assemble_vector(load)
    rows = fem.locate_dofs_topological(space, 2, base)
    forces["base"] = left.array.reshape(-1, 3)[rows].sum(axis=0).tolist()
    push = stiffness * ufl.inner(normal, result) * normal
    for name, force, tag in (("springs", -push, "EPI"), ("pressure", -pressure * normal, "ENDO")):
        forces[name] = [fem.assemble_scalar(fem.form(force[i] * ds(markers[tag][0]))) for i in range(3)]
print(
    "RESULT "
    + json.dumps(
        {
            "volumes": volumes,
            "areas": areas,
            "fibres": fibres,
            "forces": forces,
            "greatest": float(np.linalg.norm(values, axis=1).max()),
            "cells": int(mesh.topology.index_map(3).size_local),
            "points": int(mesh.geometry.x.shape[0]),
        }
    )
)
