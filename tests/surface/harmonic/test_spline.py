"""Wahba's kernel against its integral and its Legendre series; the fit against numpy's and against exact functions."""

from __future__ import annotations

import pickle
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import eval_legendre, gammaln

from femprep.errors import InputError
from femprep.surface.harmonic.leastsquares import fit_spline
from femprep.surface.harmonic.spline import Basis, Spline, _kernel
from femprep.template import sphere_points

pytestmark = pytest.mark.bytes

COSINES = [-1.0, -0.999, -0.7, 0.0, 0.3, 0.9, 0.99999, 1.0 - 1e-12, 1.0]


@pytest.mark.parametrize("degree", [2, 4, 6, 8, 18])
@pytest.mark.parametrize("z", COSINES)
def test_kernel_is_its_integral(degree: int, z: float) -> None:
    # q_k(z): integral over h in (0, 1) of (1-h)^k (1 - 2 h z + h^2)^(-1/2).
    exact, error = quad(
        lambda h: (1 - h) ** degree / np.sqrt((1 - h) ** 2 + 2 * h * (1 - z)), 0, 1, epsabs=1e-14, limit=500
    )
    assert abs(_kernel(z, degree) - exact) < 1e-10 + 10 * error


@pytest.mark.parametrize("degree", [6, 8])
@pytest.mark.parametrize("z", COSINES)
def test_kernel_is_its_legendre_series(degree: int, z: float) -> None:
    # Sum over n of k! n! / (n+k+1)! P_n(z); its tail after 2000 terms is below 1e-20.
    n = np.arange(2000)
    terms = np.exp(gammaln(degree + 1) + gammaln(n + 1) - gammaln(n + degree + 2)) * eval_legendre(n, z)
    assert _kernel(z, degree) == pytest.approx(terms.sum(), abs=1e-13)


def test_kernel_goes_smoothly_to_its_value_at_the_pole() -> None:
    assert _kernel(1.0, 6) == pytest.approx(1.0 / 6.0, abs=1e-15)
    assert _kernel(1.0 + 1e-15, 6) == _kernel(1.0, 6)
    steps = [_kernel(1.0, 6) - _kernel(1.0 - h, 6) for h in (1e-8, 1e-7, 1e-6)]
    # Slope at z = 1: falls linearly in 1 - z.
    assert steps[1] / steps[0] == pytest.approx(10.0, rel=1e-3)
    assert steps[2] / steps[1] == pytest.approx(10.0, rel=1e-3)


def test_values_are_rows_times_coefficients() -> None:
    basis = Basis(sphere_points(50), 3)
    coefficients = np.random.default_rng(0).normal(size=basis.size)
    at = sphere_points(333)
    rows = basis.rows(at)
    assert rows.shape == (333, 51)
    np.testing.assert_array_equal(rows[:, 0], 1.0)
    np.testing.assert_allclose(basis.values(at, coefficients), rows @ coefficients, rtol=1e-12)


def bumps(directions: np.ndarray) -> np.ndarray:
    x, y, z = directions.T
    return np.asarray(1.0 + 0.1 * x * y + 0.05 * z**3 - 0.02 * np.exp(-4 * (z - 1) ** 2))


@pytest.mark.parametrize("knots", [58, 204])
def test_fit_equals_an_orthogonal_factorisation(knots: int) -> None:
    random = np.random.default_rng(1)
    at = random.normal(size=(5000, 3))
    at /= np.linalg.norm(at, axis=1)[:, None]
    values = bumps(at) + 0.01 * random.normal(size=len(at))
    basis = Basis(sphere_points(knots))
    spline, solved = fit_spline(basis, at, values)
    rows = basis.rows(at)
    scale = 1.0 / np.linalg.norm(rows, axis=0)
    exact = np.linalg.lstsq(rows * scale, values, rcond=None)[0] * scale
    np.testing.assert_allclose(spline(at), rows @ exact, atol=1e-9)
    assert solved.smoothing == 0.0
    assert not solved.underdetermined
    assert solved.rms == pytest.approx(np.sqrt(np.mean((rows @ exact - values) ** 2)), rel=1e-6)


@pytest.mark.slow
def test_fit_converges_to_a_smooth_function() -> None:
    at, between = sphere_points(3000), sphere_points(777)
    errors = []
    for knots in (25, 50, 100, 200):
        spline, _ = fit_spline(Basis(sphere_points(knots)), at, bumps(at))
        errors.append(np.abs(spline(between) - bumps(between)).max())
    assert errors[-1] < 1e-5
    assert all(later < 0.5 * earlier for earlier, later in pairwise(errors))


def test_a_constant_is_reproduced() -> None:
    spline, _ = fit_spline(Basis(sphere_points(30)), sphere_points(500), np.full(500, 1.25))
    np.testing.assert_allclose(spline(sphere_points(77)), 1.25, rtol=1e-12)


def test_smoothing_damps_noise_and_keeps_the_mean() -> None:
    at, between = sphere_points(600), sphere_points(1000)
    basis = Basis(sphere_points(300))
    smoothings = (0.0, 1e-4, 1e-3, 1e-2)
    errors: dict[float, list[float]] = {smoothing: [] for smoothing in smoothings}
    for seed in range(4):
        noise = 0.05 * np.random.default_rng(seed).normal(size=len(at))
        for smoothing in smoothings:
            spline, _ = fit_spline(basis, at, bumps(at) + noise, smoothing=smoothing)
            off = spline(between) - bumps(between)
            errors[smoothing].append(float(np.std(off)))
            # Found: 3e-5; the mean of the noise itself is .002 off.
            assert abs(off.mean() - noise.mean()) < 5e-4
    left = [float(np.sqrt(np.mean(np.square(errors[smoothing])))) for smoothing in smoothings]
    # Of the noise of 600 values 301 coefficients take up their share. Found within 1.2 percent of that.
    assert left[0] == pytest.approx(0.05 * np.sqrt(301 / 600), rel=0.1)
    # Found: .52, .67 and .61 of what is left by the smoothing before, .21 of all in the end.
    assert all(after < 0.85 * before for before, after in pairwise(left))
    assert left[-1] < 0.35 * left[0]


def test_more_control_points_than_values_is_said_and_smoothed(caplog: pytest.LogCaptureFixture) -> None:
    at = sphere_points(40)
    with caplog.at_level("WARNING"):
        spline, solved = fit_spline(Basis(sphere_points(90)), at, bumps(at))
    assert solved.underdetermined
    assert solved.smoothing > 0.0
    assert "90 control points for 40 boundary points" in caplog.text
    assert np.abs(spline(at) - bumps(at)).max() < 0.01
    assert np.abs(spline(sphere_points(500)) - bumps(sphere_points(500))).max() < 0.1


def test_values_in_one_place_do_not_break_the_fit() -> None:
    # All normal equations are singular here.
    at = np.tile([[0.0, 0.0, 1.0]], (100, 1))
    spline, solved = fit_spline(Basis(sphere_points(20)), at, np.full(100, 0.9))
    assert solved.smoothing > 0.0
    np.testing.assert_allclose(spline(at[:1]), 0.9, atol=1e-3)
    assert np.all(np.isfinite(spline(sphere_points(50))))


def test_spline_can_be_pickled() -> None:
    spline, _ = fit_spline(Basis(sphere_points(20)), sphere_points(100), bumps(sphere_points(100)))
    again = pickle.loads(pickle.dumps(spline))
    assert isinstance(again, Spline)
    np.testing.assert_array_equal(again(sphere_points(50)), spline(sphere_points(50)))


@pytest.mark.parametrize("values", [np.empty(0), np.array([1.0, np.nan])])
def test_bad_values_are_refused(values: np.ndarray) -> None:
    with pytest.raises(InputError, match="cannot be fitted"):
        fit_spline(Basis(sphere_points(20)), sphere_points(5)[: len(values)], values)
