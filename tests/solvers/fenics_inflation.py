"""Run by the system's Python with legacy dolfin: inflate the mesh of an XDMF file, print what it found as JSON.

Arguments: mesh.xdmf, pressure, Young's modulus, Poisson's ratio, all in the file's units. Where there is a file
``mesh_fiber.xdmf``, the integral of the fibre over each region is printed too.
"""

import json
import os
import sys

import numpy as np
from dolfin import (
    Constant,
    DirichletBC,
    FacetNormal,
    Function,
    Identity,
    Measure,
    Mesh,
    MeshFunction,
    MeshValueCollection,
    TestFunction,
    TrialFunction,
    VectorFunctionSpace,
    XDMFFile,
    assemble,
    dot,
    grad,
    inner,
    set_log_level,
    solve,
    sym,
    tr,
)

set_log_level(40)
path, pressure, young, poisson = sys.argv[1], *map(float, sys.argv[2:5])
with open(path.replace("mesh.xdmf", "markers.json")) as file:
    markers = json.load(file)
mesh = Mesh()
with XDMFFile(path) as xdmf:
    xdmf.read(mesh)
cells = MeshFunction("size_t", mesh, 3, 0)
with XDMFFile(path) as xdmf:
    xdmf.read(cells, "Cell tags")
collection = MeshValueCollection("size_t", mesh, 2)
with XDMFFile(path) as xdmf:
    xdmf.read(collection, "Facet tags")
facets = MeshFunction("size_t", mesh, collection)

dx = Measure("dx", domain=mesh, subdomain_data=cells)
ds = Measure("ds", domain=mesh, subdomain_data=facets)
volumes = {name: assemble(Constant(1.0) * dx(tag)) for name, (tag, dim) in markers.items() if dim == 3}
areas = {name: assemble(Constant(1.0) * ds(tag)) for name, (tag, dim) in markers.items() if dim == 2}

fibres = {}
if os.path.exists("mesh_fiber.xdmf"):
    fiber = Function(VectorFunctionSpace(mesh, "DG", 0))
    with XDMFFile("mesh_fiber.xdmf") as xdmf:
        xdmf.read_checkpoint(fiber, "fiber", 0)
    for name, (tag, dim) in markers.items():
        if dim == 3:
            fibres[name] = [assemble(fiber[i] * dx(tag)) for i in range(3)]

space = VectorFunctionSpace(mesh, "Lagrange", 1)
u, v = TrialFunction(space), TestFunction(space)
mu, la = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))
strain = sym(grad(u))
stress = 2 * mu * strain + la * tr(strain) * Identity(3)
result = Function(space)
solve(
    inner(stress, sym(grad(v))) * Measure("dx", domain=mesh)
    == -Constant(pressure) * dot(FacetNormal(mesh), v) * ds(markers["ENDO"][0]),
    result,
    DirichletBC(space, Constant((0.0, 0.0, 0.0)), facets, markers["BASE"][0]),
    solver_parameters={"linear_solver": "lu"},
)
values = result.compute_vertex_values().reshape(3, -1)
print(
    "RESULT "
    + json.dumps(
        {
            "volumes": volumes,
            "areas": areas,
            "fibres": fibres,
            "greatest": float(np.linalg.norm(values, axis=0).max()),
            "cells": mesh.num_cells(),
            "points": mesh.num_vertices(),
        }
    )
)
