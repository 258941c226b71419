"""The field against its equations: zero on the sphere, harmonic, its gradient that of its values."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from femprep.errors import InputError
from femprep.surface.harmonic.field import Field, fit_strength

pytestmark = pytest.mark.bytes

CENTRE = np.array([12.0, -40.0, 7.5])
RADIUS = 52.0


def charges(seed: int, count: int = 9) -> Field:
    random = np.random.default_rng(seed)
    inside = random.normal(size=(count, 3))
    inside *= (RADIUS * random.uniform(0.0, 0.7, count) / np.linalg.norm(inside, axis=1))[:, None]
    return Field(CENTRE, RADIUS, CENTRE + inside, random.uniform(0.5, 3.0, count))


def shell(seed: int, low: float, high: float, count: int = 50) -> np.ndarray:
    random = np.random.default_rng(seed + 1000)
    points = random.normal(size=(count, 3))
    return CENTRE + points * (RADIUS * random.uniform(low, high, count) / np.linalg.norm(points, axis=1))[:, None]


def published(field: Field, points: np.ndarray) -> np.ndarray:
    """Eq. A.4, term by term as printed."""
    total = np.zeros(len(points))
    r = points - field.centre
    for s, c in zip(field.sources - field.centre, field.strength):
        length = np.linalg.norm(s)
        image = s * field.radius**2 / length**2
        total += c * (1.0 / np.linalg.norm(r - s, axis=1) - field.radius / length / np.linalg.norm(r - image, axis=1))
    return total


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 10_000))
def test_zero_on_the_sphere_and_positive_inside(seed: int) -> None:
    field = charges(seed)
    assert np.abs(field.potential(shell(seed, 1.0, 1.0))).max() < 1e-12
    assert field.potential(shell(seed, 0.0, 0.99)).min() > 0.0
    assert field.potential(shell(seed, 1.01, 2.0)).max() < 0.0


def test_equals_the_published_formula() -> None:
    field, points = charges(3), shell(3, 0.1, 1.2, 400)
    np.testing.assert_allclose(field.potential(points), published(field, points), rtol=1e-11, atol=1e-13)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10_000))
def test_gradient_is_that_of_the_potential(seed: int) -> None:
    field, points = charges(seed), shell(seed, 0.75, 1.1)
    step = 1e-4
    difference = np.stack(
        [(field.potential(points + e) - field.potential(points - e)) / (2 * step) for e in step * np.eye(3)], axis=1
    )
    scale = np.abs(field.gradient(points)).max()
    assert np.abs(field.gradient(points) - difference).max() < 1e-7 * scale


def test_laplacian_vanishes_at_second_order() -> None:
    field, points = charges(5), shell(5, 0.75, 0.95, 200)
    size = np.linalg.norm(field.gradient(points), axis=1)
    worst = []
    for step in (1.0, 0.5, 0.25):
        around = sum(field.potential(points + sign * e) for e in step * np.eye(3) for sign in (-1, 1))
        worst.append(np.max(np.abs(around - 6.0 * field.potential(points)) / step**2 / size))
    assert worst[0] / worst[1] == pytest.approx(4.0, rel=0.2)
    assert worst[1] / worst[2] == pytest.approx(4.0, rel=0.2)


def test_charge_at_the_centre_is_the_limit_of_the_image() -> None:
    # As |s| goes to zero the image becomes the constant 1 / R.
    centre = Field(CENTRE, RADIUS, CENTRE[None, :], np.ones(1))
    points = shell(1, 0.2, 1.5)
    distance = np.linalg.norm(points - CENTRE, axis=1)
    np.testing.assert_allclose(centre.potential(points), 1.0 / distance - 1.0 / RADIUS, rtol=1e-12, atol=1e-15)
    near = replace(centre, sources=CENTRE[None, :] + [[1e-9, 0.0, 0.0]])
    np.testing.assert_allclose(near.potential(points), centre.potential(points), rtol=1e-8)


def test_turns_with_its_charges() -> None:
    field, points = charges(8), shell(8, 0.1, 0.99)
    turn = Rotation.from_euler("xyz", [0.3, -1.1, 2.0]).as_matrix()
    turned = replace(field, sources=CENTRE + (field.sources - CENTRE) @ turn.T)
    moved = CENTRE + (points - CENTRE) @ turn.T
    np.testing.assert_allclose(turned.potential(moved), field.potential(points), rtol=1e-12)
    np.testing.assert_allclose(
        turned.gradient(moved), field.gradient(points) @ turn.T, rtol=1e-10, atol=1e-12 * field.strength.sum()
    )


def test_strength_minimises_the_squares() -> None:
    # Eq. 4 at the strength of Eq. 6 against its neighbours, and its derivative.
    field, points = charges(2, 30), shell(2, 0.75, 0.85, 300)
    best = fit_strength(field, points)
    assert np.ptp(best.strength) == 0.0
    assert best.strength[0] > 0.0
    level = best.potential(points)
    assert abs(np.sum(level * (level - 1.0))) < 1e-9 * len(points)

    def squares(factor: float) -> float:
        return float(np.sum((replace(best, strength=best.strength * factor).potential(points) - 1.0) ** 2))

    assert squares(1.0) < squares(1.001)
    assert squares(1.0) < squares(0.999)


def test_a_point_on_a_charge_is_finite() -> None:
    field = charges(4)
    assert np.all(np.isfinite(field.potential(field.sources)))
    assert np.all(np.isfinite(field.gradient(field.sources)))


def test_input_is_left_alone_and_arrays_are_frozen() -> None:
    field = charges(0)
    points = shell(0, 0.2, 0.9)
    before = points.copy()
    field.flow(points, field.potential(points), 0.0, 8)
    np.testing.assert_array_equal(points, before)
    with pytest.raises(ValueError, match="read-only"):
        field.sources[0, 0] = 1.0


def test_survives_pickling() -> None:
    field, points = charges(6), shell(6, 0.2, 0.9)
    field.potential(points)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(field)).potential(points), field.potential(points))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"radius": 0.0}, "expected a positive length"),
        ({"radius": 10.0}, "have to lie inside"),
        ({"sources": np.empty((0, 3)), "strength": np.ones(1)}, "at least one is needed"),
        ({"sources": np.ones((4, 2))}, "singularities has shape"),
    ],
)
def test_bad_input_is_named(changes: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        replace(charges(0), **changes)


def test_boundary_points_outside_the_sphere_are_refused() -> None:
    with pytest.raises(InputError, match="1 of 2 boundary points lie outside"):
        fit_strength(charges(0), np.add(CENTRE, [[10.0, 0.0, 0.0], [60.0, 0.0, 0.0]]))
