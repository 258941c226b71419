"""Products of a written-down order against numpy's, and their bits against those of several threads."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from femprep.model import products

pytestmark = pytest.mark.bytes

RANDOM = np.random.default_rng(0)


def test_products_are_numpys():
    a, b, v = RANDOM.normal(size=(50, 3)), RANDOM.normal(size=(3, 4)), RANDOM.normal(size=3)
    np.testing.assert_allclose(products.product(a, b), a @ b, rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(products.product(a, v), a @ v, rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(products.product(v, b), v @ b, rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(products.product(a.reshape(5, 10, 3), b), a.reshape(5, 10, 3) @ b, atol=1e-14)
    np.testing.assert_allclose(products.inner(a, 2.0 * a), 2.0 * np.vdot(a, a), rtol=1e-13)
    np.testing.assert_allclose(products.weighted(a[:, 0], a), a[:, 0] @ a, rtol=1e-12)
    np.testing.assert_allclose(products.weighted(a, 3.0 * a), a.T @ (3.0 * a), rtol=1e-12, atol=1e-12)
    assert abs(products.length(v) - np.linalg.norm(v)) < 1e-15


def test_definite_systems_are_solved():
    half = RANDOM.normal(size=(20, 5, 5))
    matrix = half @ half.transpose(0, 2, 1) + 0.1 * np.eye(5)
    right = RANDOM.normal(size=(20, 5, 2))
    np.testing.assert_allclose(products.solve_definite(matrix, right), np.linalg.solve(matrix, right), rtol=1e-8)


def test_the_inverse_and_the_nearest_rotation():
    matrix = RANDOM.normal(size=(3, 3))
    np.testing.assert_allclose(products.inverse(matrix) @ matrix, np.eye(3), atol=1e-13)
    left, _, right = np.linalg.svd(matrix)
    np.testing.assert_allclose(products.nearest_orthogonal(matrix), left @ right, atol=1e-13)
    assert np.array_equal(products.nearest_orthogonal(3.0 * np.eye(3)), np.eye(3))
    assert products.nearest_orthogonal(np.zeros((3, 3))) is None
    assert products.nearest_orthogonal(np.outer([1.0, 2.0, 3.0], [1.0, 1.0, 0.0])) is None


#: Sums of as many numbers as the whole heart's epicardium of 6,750 vertices has, of which BLAS gives the halves to two
#: threads: by the library, and in one order.
_SUMS = """
import numpy as np
from femprep.model.products import inner
a, b = np.random.default_rng(0).normal(size=(2, 6750, 3))
print(float(inner(a, b)).hex())
"""


def test_long_sums_are_the_same_by_one_and_two_threads():
    told = []
    for threads in ("1", "2"):
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": threads}
        done = subprocess.run(
            [sys.executable, "-c", _SUMS], env=environment, capture_output=True, text=True, check=True
        )
        told.append(done.stdout)
    assert told[0] == told[1]
