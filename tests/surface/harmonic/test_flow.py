"""Flow lines: exact for a charge at the centre, of fourth order, reversible, independent of the number of threads."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest

from femprep.surface.harmonic.field import Field
from femprep.template import sphere_points

pytestmark = pytest.mark.bytes

RADIUS = 50.0
ORIGIN = np.zeros(3)


def ellipsoid_field(count: int = 120) -> Field:
    """Charges on an ellipsoid of 12, 14 and 25 mm."""
    sources = sphere_points(count) * [12.0, 14.0, 25.0]
    return Field(ORIGIN, RADIUS, sources, np.full(count, 40.0 / count))


def test_central_charge_flows_along_rays_to_the_exact_radius() -> None:
    # u = c (1/r - 1/R), so that level u lies at r = 1 / (u/c + 1/R).
    strength = 30.0
    field = Field(ORIGIN, RADIUS, np.zeros((1, 3)), np.full(1, strength))
    directions = sphere_points(40)
    levels = np.linspace(0.2, 2.0, 40)
    ends = field.flow(field.on_sphere(directions), 0.0, levels, 40)
    np.testing.assert_allclose(ends, directions / (levels / strength + 1.0 / RADIUS)[:, None], atol=2e-5)


@pytest.mark.slow
def test_order_is_four() -> None:
    field = ellipsoid_field()
    starts = field.on_sphere(sphere_points(60))
    exact = field.flow(starts, 0.0, 0.9, 640)
    errors = [np.abs(field.flow(starts, 0.0, 0.9, n) - exact).max() for n in (10, 20, 40, 80)]
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all(np.abs(orders[1:] - 4.0) < 0.35), orders


def test_points_reach_their_own_levels() -> None:
    field = ellipsoid_field()
    levels = np.linspace(0.3, 1.0, 60)
    ends = field.flow(field.on_sphere(sphere_points(60)), 0.0, levels, 40)
    np.testing.assert_allclose(field.potential(ends), levels, atol=1e-6)
    settled = field.flow(field.on_sphere(sphere_points(60)), 0.0, levels, 40, settle=1)
    np.testing.assert_allclose(field.potential(settled), levels, atol=1e-11)


def test_there_and_back() -> None:
    field = ellipsoid_field()
    directions = sphere_points(200)
    inner = field.flow(field.on_sphere(directions), 0.0, 0.95, 40)
    outer = field.flow(inner, field.potential(inner), 0.0, 40)
    assert np.abs(np.linalg.norm(outer, axis=1) - RADIUS).max() < 1e-4
    assert np.abs(outer - field.on_sphere(directions)).max() < 1e-4


def test_nothing_is_lost_at_a_stagnation_point() -> None:
    # Half-way between two equal charges the gradient vanishes: the point stays finite and in the sphere.
    field = Field(ORIGIN, RADIUS, np.array([[20.0, 0.0, 0.0], [-20.0, 0.0, 0.0]]), np.ones(2))
    starts = np.vstack([np.zeros(3), field.on_sphere([[0.0, 0.0, 1.0]])])
    ends = field.flow(starts, field.potential(starts), 5.0, 40)
    assert np.all(np.isfinite(ends))
    assert np.linalg.norm(ends, axis=1).max() < 2.0 * RADIUS


_CHILD = """
import hashlib, numpy as np
from femprep.surface.harmonic.field import Field
from femprep.template.sphere import fibonacci
field = Field(np.zeros(3), 50.0, fibonacci(123) * [12.0, 14.0, 25.0], np.full(123, 0.35))
ends = field.flow(field.on_sphere(fibonacci(1001)), 0.0, 0.9, 20, settle=1)
print(hashlib.sha256(ends.tobytes() + field.gradient(ends).tobytes()).hexdigest())
"""


@pytest.mark.slow
@pytest.mark.parametrize("threads", ["1", "2"])
def test_bytes_do_not_depend_on_the_number_of_threads(threads: str) -> None:
    child = subprocess.run(
        [sys.executable, "-c", _CHILD],
        env={**os.environ, "NUMBA_NUM_THREADS": threads},
        capture_output=True,
        text=True,
        check=True,
    )
    from femprep.template.sphere import fibonacci

    field = Field(np.zeros(3), 50.0, fibonacci(123) * [12.0, 14.0, 25.0], np.full(123, 0.35))
    ends = field.flow(field.on_sphere(fibonacci(1001)), 0.0, 0.9, 20, settle=1)
    assert child.stdout.strip() == hashlib.sha256(ends.tobytes() + field.gradient(ends).tobytes()).hexdigest()


def test_as_few_steps_as_the_error_allows() -> None:
    field = ellipsoid_field()
    rays = sphere_points(400)
    points = field.flow(field.on_sphere(rays), 0.0, 0.95, 640)
    level = field.potential(points)
    exact = field.flow(points, level, 0.0, 640)
    asked = (1e-1, 1e-2, 1e-3, 1e-4)
    found = [field.enough_steps(points, level, tolerance) for tolerance in asked]
    assert found == sorted(found)
    assert found[0] < 10 < found[-1] < 40
    for tolerance, steps in zip(asked, found):
        errors = np.linalg.norm(field.flow(points, level, 0.0, steps) - exact, axis=1)
        assert errors.max() <= tolerance
        assert errors.max() > 1e-3 * tolerance or steps == 6
