from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from surface_shapes import box, moved, sphere

from femprep.errors import InputError, OptionError
from femprep.mesh.sampling import sample_surface
from femprep.model import Plane, Surface
from femprep.surface.measure.distance import surface_distance


def test_concentric_spheres_lie_the_difference_of_their_radii_apart():
    found = surface_distance(sphere(20.0, subdivisions=5), sphere(21.5, subdivisions=5))
    # A sphere of 20,480 triangles lies up to 0.01 mm within its radius.
    for spread in (found.both, found.a_to_b, found.b_to_a):
        assert spread.mean == pytest.approx(1.5, abs=5e-3)
        assert spread.rms == pytest.approx(1.5, abs=5e-3)
        assert spread.p95 == pytest.approx(1.5, abs=1.5e-2)
        assert spread.max == pytest.approx(1.5, abs=1.5e-2)
    # A point of one facet faces a point of a facet of the other that is turned by up to a facet's own angle.
    assert found.normals.mean < 1.0


def test_shifted_spheres_have_the_mean_and_greatest_distance_of_the_closed_form():
    # From the point at angle t the other sphere is | |p - s| - r | away; the mean over the sphere by quadrature.
    r, shift = 20.0, 3.0
    x, weight = np.polynomial.legendre.leggauss(200)
    away = np.abs(np.sqrt(r * r - 2 * r * shift * x + shift * shift) - r)
    expected = float(np.sum(weight * away) / 2.0)
    found = surface_distance(sphere(r, subdivisions=5), sphere(r, (0, 0, shift), subdivisions=5))
    assert found.both.mean == pytest.approx(expected, rel=3e-3)
    assert found.both.rms == pytest.approx(float(np.sqrt(np.sum(weight * away**2) / 2.0)), rel=3e-3)
    assert found.both.max == pytest.approx(shift, rel=2e-3)


def test_directions_differ_where_one_surface_reaches_further():
    far = sphere(5.0, (40.0, 0.0, 0.0), subdivisions=3)
    one = sphere(20.0)
    both = Surface(np.r_[one.points, far.points], np.r_[one.cells, far.cells + len(one.points)])
    found = surface_distance(one, both)
    assert found.a_to_b.max < 1e-12
    assert found.b_to_a.max == pytest.approx(25.0, abs=0.05)
    assert found.both.max == found.b_to_a.max
    assert found.both.mean == pytest.approx(0.5 * found.b_to_a.mean)


def test_between_two_planes_only_what_lies_there_counts():
    one, two = box((10.0, 10.0, 30.0)), box((12.0, 12.0, 30.0))
    ends = (Plane([0, 0, -10], [0, 0, -1]), Plane([0, 0, 10], [0, 0, 1]))
    found = surface_distance(one, two, between=ends)
    # The sides lie 1 mm apart; the larger box's edges reach sqrt(2).
    assert found.a_to_b.mean == pytest.approx(1.0, abs=1e-12)
    assert found.b_to_a.mean == pytest.approx(1.0 + (np.sqrt(2) + np.arcsinh(1.0) - 2.0) / 2 * 2 / 12, abs=2e-3)
    assert found.a_to_b.max == pytest.approx(1.0, abs=1e-12)
    # Two sides face each other; only the strips beyond the smaller box's edges may face the adjoining side.
    assert found.normals.p95 < 1e-9
    whole = surface_distance(one, two)
    assert whole.both.mean < found.both.mean  # the tops coincide
    with pytest.raises(InputError, match="between the planes"):
        surface_distance(one, two, between=(Plane([0, 0, -100], [0, 0, 1]),))


def test_greatest_distance_finds_a_single_vertex():
    points = np.array(sphere(20.0).points)
    points[7] *= 1.5
    found = surface_distance(Surface(points, sphere(20.0).cells), sphere(20.0), samples=500)
    assert found.a_to_b.max == pytest.approx(10.0, abs=0.05)


def test_opposite_winding_shows_in_the_normals():
    one = sphere(20.0, subdivisions=3)
    assert surface_distance(one, Surface(one.points, one.cells[:, ::-1])).normals.mean == pytest.approx(180.0, abs=1.0)


@settings(deadline=None, max_examples=10)
@given(st.integers(0, 10_000))
def test_moving_both_surfaces_changes_nothing_and_swapping_swaps(seed):
    one, two = sphere(20.0, subdivisions=2), box((30.0, 30.0, 30.0))
    here = surface_distance(one, two, samples=4000)
    there = surface_distance(moved(one, seed), moved(two, seed), samples=4000)
    back = surface_distance(two, one, samples=4000)
    for name in ("mean", "rms", "p95", "max"):
        assert getattr(there.both, name) == pytest.approx(getattr(here.both, name), abs=1e-3)
        assert getattr(back.a_to_b, name) == getattr(here.b_to_a, name)
        assert getattr(back.both, name) == pytest.approx(getattr(here.both, name), rel=1e-12)


def test_samples_share_the_surface_by_area_and_repeat_exactly():
    shape = box((1.0, 2.0, 3.0))
    samples = sample_surface(shape.points, shape.triangles, 20_000)
    again = sample_surface(shape.points, shape.triangles, 20_000)
    assert samples.points.tobytes() == again.points.tobytes()
    on_top = np.isclose(samples.points[:, 2], 1.5)
    assert on_top.mean() == pytest.approx(2.0 / 22.0, abs=1e-3)
    np.testing.assert_allclose(samples.points[on_top].mean(axis=0), [0, 0, 1.5], atol=5e-3)
    # The second moment of a uniform rectangle: a^2 / 12.
    np.testing.assert_allclose((samples.points[on_top][:, :2] ** 2).mean(axis=0), [1 / 12, 4 / 12], rtol=1e-2)
    inside = np.abs(samples.points) <= np.array([0.5, 1.0, 1.5]) + 1e-12
    assert inside.all()
    with pytest.raises(InputError, match="no area"):
        sample_surface(np.zeros((3, 3)), [[0, 1, 2]], 10)


@pytest.mark.parametrize("samples", [0, -5])
def test_fewer_samples_than_one_are_refused(samples):
    """The planes were said to leave none."""
    with pytest.raises(OptionError, match=f"samples is {samples}, expected a number at least 1"):
        surface_distance(sphere(20.0), sphere(21.0), samples=samples)
