"""Finite elements: exact on linear fields, of second order on a harmonic field, clear about what is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from anatomy_meshes import ellipsoid, grown, slab

from femprep.anatomy.laplace.conjugate import conjugate_gradients
from femprep.anatomy.laplace.dirichlet import solve
from femprep.anatomy.laplace.fem import LinearElements
from femprep.anatomy.laplace.shapes import quadrature, shape_functions
from femprep.errors import InputError
from femprep.model import FACET_TAGS, VolumeMesh

KINDS = ["tetra", "wedge", "hexahedron", "mixed"]
ENDO, EPI = FACET_TAGS["endo"], FACET_TAGS["epi"]


@pytest.mark.parametrize("name", ["tetra", "wedge", "hexahedron"])
def test_shape_functions_are_a_partition_of_unity_with_their_own_gradients(name):
    points = np.random.default_rng(1).uniform(0.05, 0.3, (5, 3))
    value, gradient = shape_functions(name, points)
    assert value.sum(axis=1) == pytest.approx(1.0)
    for i in range(3):
        step = np.zeros(3)
        step[i] = 1e-6
        numeric = (shape_functions(name, points + step)[0] - shape_functions(name, points - step)[0]) / 2e-6
        assert gradient[:, :, i] == pytest.approx(numeric, abs=1e-8)


@pytest.mark.parametrize(("name", "volume"), [("tetra", 1 / 6), ("wedge", 1.0), ("hexahedron", 8.0)])
def test_quadrature_weights_sum_to_the_reference_volume(name, volume):
    assert quadrature(name)[1].sum() == pytest.approx(volume)


@pytest.mark.parametrize("kind", KINDS)
def test_linear_field_is_exact(kind):
    wall = slab(kind)
    space = LinearElements(wall.mesh)
    assert space.volume.sum() == pytest.approx(6000.0)
    solution = solve(space, space.stiffness(), {ENDO: 0.0, EPI: 1.0})
    assert solution == pytest.approx(wall.depth[space.nodes], abs=1e-9)
    assert space.gradient(solution) == pytest.approx(np.tile([0.1, 0, 0], (space.n_cells, 1)), abs=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_any_linear_field_has_its_gradient_in_curved_walls(kind):
    wall = ellipsoid(kind, size=3, layers=2)
    space = LinearElements(wall.mesh)
    slope = np.array([0.3, -1.2, 0.7])
    values = space.points @ slope
    assert space.gradient(values) == pytest.approx(np.tile(slope, (space.n_cells, 1)), abs=1e-12)
    energy = values @ (space.stiffness() @ values)
    assert energy == pytest.approx(slope @ slope * space.volume.sum(), rel=1e-12)
    direction = np.tile(slope / np.linalg.norm(slope), (space.n_cells, 1))
    assert values @ (space.stiffness(direction) @ values) == pytest.approx(energy, rel=1e-12)
    load = space.load(np.tile(slope, (space.n_cells, 1)))
    assert load == pytest.approx(space.stiffness() @ values, abs=1e-9)


def test_harmonic_field_of_a_sphere_converges_with_second_order():
    errors = []
    for size, layers in ((3, 2), (6, 4), (12, 8)):
        wall = ellipsoid("tetra", size=size, layers=layers, endo=(25.0, 25.0), epi=(35.0, 35.0), base=0.0)
        space = LinearElements(wall.mesh)
        solution = solve(space, space.stiffness(), {ENDO: 0.0, EPI: 1.0})
        radius = np.linalg.norm(space.points, axis=1)
        exact = (1 / 25 - 1 / radius) / (1 / 25 - 1 / 35)
        errors.append(np.sqrt(np.mean((solution - exact) ** 2)))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert rates[-1] > 1.8  # the coarsest mesh is not yet in the asymptotic range
    assert rates[0] > 1.5


@pytest.mark.parametrize("kind", ["tetra", "wedge", "hexahedron"])
def test_quadratic_elements_take_their_corner_nodes(kind):
    wall = slab(kind, cells=(2, 2, 2))
    mesh = grown(wall.mesh)
    space = LinearElements(mesh)
    assert space.n == len(wall.mesh.points)
    solution = solve(space, space.stiffness(), {ENDO: 0.0, EPI: 1.0})
    assert space.to_points(solution) == pytest.approx(mesh.points[:, 0] / 10.0, abs=1e-9)


def test_means_to_nodes_and_cells_keep_constants_and_vectors():
    space = LinearElements(ellipsoid("mixed", size=3, layers=2).mesh)
    vector = np.tile([1.0, -2.0, 3.0], (space.n_cells, 1))
    assert space.to_nodes(vector) == pytest.approx(np.tile([1.0, -2.0, 3.0], (space.n, 1)))
    assert space.to_cells(np.full(space.n, 4.0)) == pytest.approx(4.0)


def test_inverted_element_is_named():
    mesh = slab("tetra", cells=(1, 1, 1)).mesh
    cells = mesh.cells["tetra"].copy()
    cells[3] = cells[3, [1, 0, 2, 3]]
    with pytest.raises(InputError, match=r"element 3 \(tetra\) has Jacobian -"):
        LinearElements(replace(mesh, cells={"tetra": cells}))


def test_mesh_without_elements_is_refused():
    with pytest.raises(InputError, match="no elements"):
        LinearElements(VolumeMesh(np.zeros((1, 3)), {}, np.empty(0)))


def test_piece_without_a_boundary_value_is_named():
    mesh = slab("tetra", cells=(1, 1, 1)).mesh
    n = len(mesh.points)
    double = VolumeMesh(
        np.concatenate([mesh.points, mesh.points + 100.0]),
        {"tetra": np.concatenate([mesh.cells["tetra"], mesh.cells["tetra"] + n])},
        np.tile(mesh.region, 2),
        mesh.facets,
        mesh.facet_tag,
    )
    space = LinearElements(double)
    with pytest.raises(InputError, match=r"1 of 2 separate pieces .* near \[100.0, 100.0, 100.0\]"):
        solve(space, space.stiffness(), {ENDO: 0.0, EPI: 1.0})
    with pytest.raises(InputError, match="no facets tagged 'cap_lv'"):
        solve(space, space.stiffness(), {FACET_TAGS["cap_lv"]: 0.0})


def test_conjugate_gradients_solve_and_count():
    matrix = LinearElements(slab("hexahedron").mesh).stiffness()
    matrix = matrix + 0.01 * matrix.diagonal().mean() * sp.eye_array(matrix.shape[0], format="csr")
    exact = np.random.default_rng(2).normal(size=matrix.shape[0])
    solution, steps = conjugate_gradients(matrix.tocsr(), matrix @ exact)
    assert solution == pytest.approx(exact, abs=1e-7)
    assert 0 < steps < 500
