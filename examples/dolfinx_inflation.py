"""Run by the Python that has dolfinx: the folder of an XDMF deck in; displacements (.npz) and figures (JSON) out.

    python3 dolfinx_inflation.py FOLDER MATERIAL PRESSURE YOUNG POISSON

Reads ``mesh.xdmf`` and ``markers.json`` of FOLDER, holds the facets named BASE, presses on those named ENDO, and writes
``solution.npz``: the displacement of each point in the order of the deck, and the force of the tissue on the held ones.
Units are the deck's own: mm, MPa. MATERIAL is ``linear``, or ``neo-hookean`` as CalculiX and Abaqus have it, with a
pressure that follows the wall.
"""

import json
import sys

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.io import XDMFFile
from mpi4py import MPI
from petsc4py import PETSc

folder, material = sys.argv[1:3]
pressure, young, poisson = map(float, sys.argv[3:6])
large = material == "neo-hookean"

with open(f"{folder}/markers.json") as file:
    markers = json.load(file)
with XDMFFile(MPI.COMM_SELF, f"{folder}/mesh.xdmf", "r") as xdmf:
    mesh = xdmf.read_mesh(name="Mesh")
    mesh.topology.create_connectivity(2, 3)
    facets = xdmf.read_meshtags(mesh, name="Facet tags")

space = fem.VectorFunctionSpace(mesh, ("Lagrange", 1))
u, v = fem.Function(space), ufl.TestFunction(space)
load = fem.Constant(mesh, PETSc.ScalarType(0.0))
normal = ufl.FacetNormal(mesh)
endo = ufl.Measure("ds", domain=mesh, subdomain_data=facets)(markers["ENDO"][0])

shear = young / (2 * (1 + poisson))
if large:
    bulk = young / (3 * (1 - 2 * poisson))
    F = ufl.variable(ufl.Identity(3) + ufl.grad(u))
    J = ufl.det(F)
    energy = shear / 2 * (J ** (-2 / 3) * ufl.tr(F.T * F) - 3) + bulk / 2 * (J - 1) ** 2
    push = load * ufl.dot(J * ufl.inv(F).T * normal, v) * endo
else:
    lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    strain = ufl.sym(ufl.grad(u))
    energy = shear * ufl.inner(strain, strain) + lame / 2 * ufl.tr(strain) ** 2
    push = load * ufl.dot(normal, v) * endo
inner = ufl.derivative(energy * ufl.dx, u, v)
residual, tangent = fem.form(inner + push), fem.form(ufl.derivative(inner + push, u))

base = facets.indices[facets.values == markers["BASE"][0]]
base_dofs = fem.locate_dofs_topological(space, 2, base)
held = fem.dirichletbc(np.zeros(3, dtype=PETSc.ScalarType), base_dofs, space)

solver = PETSc.KSP().create(MPI.COMM_SELF)
solver.setType("preonly")
solver.getPC().setType("lu")
iterations = 0
for share in np.linspace(0.1, 1.0, 10) if large else (1.0,):
    load.value = pressure * share
    for _ in range(20):
        r = fem.petsc.assemble_vector(residual)
        fem.petsc.set_bc(r, [held])
        K = fem.petsc.assemble_matrix(tangent, bcs=[held])
        K.assemble()
        solver.setOperators(K)
        step = r.duplicate()
        solver.solve(-r, step)
        u.x.array[:] += step.array
        iterations += 1
        if not large or np.abs(step.array).max() < 1e-10:
            break
    else:
        sys.exit(f"Newton's method did not converge at {share:.0%} of the load")

# Forces of the tissue on the held points: what the support must bear.
forces = fem.petsc.assemble_vector(fem.form(inner)).array.reshape(-1, 3)
order = np.asarray(mesh.geometry.input_global_indices)
displacement = np.empty((len(order), 3))
# Points of the geometry and degrees of freedom are numbered apart; cells name both.
points, dofs = mesh.geometry.dofmap.array, space.dofmap.list.array
displacement[order[points]] = u.x.array.reshape(-1, 3)[dofs]
np.savez(f"{folder}/solution.npz", displacement=displacement, reaction=forces[base_dofs].sum(axis=0))
print("RESULT " + json.dumps({"iterations": iterations, "reaction": forces[base_dofs].sum(axis=0).tolist()}))
