"""The band's Cholesky factor against a general solver, on systems of meshes and of any pattern."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array, diags_array, random_array
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import spsolve

from femprep.errors import StageError
from femprep.mesh.banded import SPARE, Banded
from femprep.template import charge_template

pytestmark = pytest.mark.bytes


def laplacian(vertices: int) -> coo_array:
    """The graph Laplacian of a sphere's template, made definite."""
    cells = charge_template(vertices).cells
    one, two = cells.ravel(), np.roll(cells, -1, axis=1).ravel()
    joined = coo_array((np.ones(len(one)), (one, two)), shape=(vertices, vertices))
    return diags_array(np.asarray(joined.sum(axis=1)) + 0.01) - joined


@pytest.mark.parametrize("vertices", [12, 162, 752])
def test_the_solution_is_that_of_a_general_solver(vertices):
    matrix = laplacian(vertices)
    bent = (matrix @ matrix).tocsc()
    right = np.random.default_rng(0).normal(size=(vertices, 4))
    for each in (matrix, bent):
        expected = spsolve(each.tocsc(), right)
        solver = Banded(each)
        assert np.allclose(solver.solve(right), expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
        assert np.array_equal(solver.solve(right[:, 0]), solver.solve(right)[:, 0])


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 40), st.floats(0.0, 0.5), st.integers(0, 2**31))
def test_any_pattern_will_do_pieces_apart_too(size, density, seed):
    rng = np.random.default_rng(seed)
    half = random_array((size, size), density=density, rng=rng)
    matrix = half @ half.T + diags_array(rng.uniform(0.5, 2.0, size))
    right = rng.normal(size=size)
    assert np.allclose(matrix @ Banded(matrix).solve(right), right, atol=1e-9)


@pytest.mark.parametrize("vertices", [162, 752])
def test_the_band_is_as_narrow_as_scipys(vertices):
    matrix = laplacian(vertices).tocsr()
    order = reverse_cuthill_mckee(matrix, symmetric_mode=True)
    turned = matrix[order][:, order].tocoo()
    assert Banded(matrix)._rows.shape[1] - 1 - SPARE <= 1.1 * np.abs(turned.row - turned.col).max()


def test_what_is_not_definite_is_refused():
    matrix = laplacian(42) - diags_array(np.full(42, 1.0))
    with pytest.raises(StageError, match="not positive definite"):
        Banded(matrix)
    with pytest.raises(StageError, match="not positive definite"):
        Banded(diags_array(np.array([1.0, np.nan, 1.0])))
