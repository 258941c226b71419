"""A solution by linear elements over three nested levels converges as it must, and linear fields are solved exactly."""

from __future__ import annotations

import numpy as np
import pytest
from analytic_walls import ellipsoid_wall
from test_refinement import ENDO, EPI, HEIGHT, layered

from femprep.mesh.elements import boundary_faces
from femprep.model import FloatArray, VolumeMesh
from femprep.volume.refine import Refinement

skfem = pytest.importorskip("skfem")


def levels(improved: bool) -> list[VolumeMesh]:
    """Meshes of a wall between two ellipsoids: coarse, and refined once and twice onto its smooth surfaces."""
    mesh = layered(rings=6, layers=2, element="tetra")
    nested = Refinement.of(mesh, 2, wall=ellipsoid_wall(ENDO, EPI, HEIGHT, rings=24), optimised=improved)
    return [mesh, *(level.fine for level in nested.levels)]


def solved(mesh: VolumeMesh, value, source) -> tuple[FloatArray, float, float]:
    """Poisson's equation with the values of a field on the boundary: values at nodes, errors in L2 and of the slope."""
    from skfem.helpers import dot, grad

    grid = skfem.MeshTet(mesh.points.T.copy(), mesh.cells["tetra"].T.copy(), sort_t=False)
    basis = skfem.Basis(grid, skfem.ElementTetP1(), intorder=4)
    stiffness = skfem.BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(basis)
    load = skfem.LinearForm(lambda v, w: source(w.x) * v).assemble(basis)
    held = np.unique(boundary_faces(mesh.cells)["triangle"].nodes)
    found = skfem.solve(*skfem.condense(stiffness, load, x=value(mesh.points.T), D=held))
    off = basis.interpolate(found)
    error = skfem.Functional(lambda w: (w["u"] - value(w.x)) ** 2).assemble(basis, u=off)
    step = 1e-4

    def slope(x: FloatArray) -> FloatArray:
        shifts = step * np.eye(3).reshape(3, 3, *(1,) * (x.ndim - 1))
        return np.stack([(value(x + shift) - value(x - shift)) / (2.0 * step) for shift in shifts])

    energy = skfem.Functional(lambda w: ((grad(w["u"]) - slope(w.x)) ** 2).sum(axis=0)).assemble(basis, u=off)
    return found, float(np.sqrt(error)), float(np.sqrt(energy))


@pytest.mark.slow
@pytest.mark.parametrize("improved", [False, True])
def test_errors_of_linear_elements_fall_by_four_and_their_slopes_by_two(improved: bool) -> None:
    length = 20.0

    def value(x: FloatArray) -> FloatArray:
        return np.asarray(np.sin(x[0] / length) * np.exp(x[1] / length) + np.cos(x[2] / length))

    def source(x: FloatArray) -> FloatArray:
        return np.asarray(np.cos(x[2] / length) / length**2)

    errors = np.array([solved(mesh, value, source)[1:] for mesh in levels(improved)])
    rates = np.log2(errors[:-1] / errors[1:])
    if improved:  # elements of the coarse mesh, which was not improved, have other shapes
        rates = rates[1:]
    assert np.abs(rates - [2.0, 1.0]).max() < 0.1, errors


@pytest.mark.parametrize("improved", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_linear_field_is_solved_exactly_on_every_level(improved: bool) -> None:
    """The patch test: no node hangs, no element is turned inside out, whatever moved."""

    def value(x: FloatArray) -> FloatArray:
        return np.asarray(0.3 * x[0] - 1.2 * x[1] + 0.7 * x[2] + 5.0)

    for mesh in levels(improved):
        found, _, _ = solved(mesh, value, lambda x: 0.0 * x[0])
        assert np.abs(found - value(mesh.points.T)).max() < 1e-9
