from __future__ import annotations

import numpy as np
import pytest
from surface_shapes import ball_object, box, moved, sphere

from femprep.errors import InputError, OptionError
from femprep.model import Plane, Surface
from femprep.surface.measure.inslice import in_slice_distance, label_distance, missed_distance, nearest_distances
from femprep.surface.measure.sections import slice_planes
from femprep.surface.reference import marching_cubes


def slices(heights):
    return [Plane([0, 0, h], [0, 0, 1]) for h in heights]


def test_concentric_spheres_have_the_difference_of_their_circles_in_every_slice():
    heights = np.array([-12.0, -4.0, 0.5, 9.0])
    found = in_slice_distance(sphere(20.0, subdivisions=6), sphere(22.0, subdivisions=6), slices(heights))
    expected = np.sqrt(22.0**2 - heights**2) - np.sqrt(20.0**2 - heights**2)
    np.testing.assert_allclose(found.slice_means, expected, atol=4e-3)
    assert found.mean == pytest.approx(expected.mean(), abs=4e-3)
    assert found.std == pytest.approx(expected.std(), abs=4e-3)
    assert found.slices == 4
    assert found.skipped == 0


def test_coaxial_boxes_pair_along_their_sides():
    # Two prisms 1 mm apart: mutual nearest neighbours pair the sides straight across.
    found = in_slice_distance(box((10, 10, 30)), box((12, 12, 30)), slices([0.0, 5.0]))
    assert found.pair_mean == pytest.approx(1.0, abs=0.02)
    # The inner corner's nearest are the feet on the outer sides: no pair reaches from corner to corner.
    assert found.max == pytest.approx(1.0, abs=0.01)


def test_a_surface_has_no_distance_from_itself_and_the_measure_is_symmetric():
    one, two = sphere(20.0, subdivisions=3), sphere(20.5, (1.0, 0.3, 0.0), subdivisions=3)
    planes = slices([-6.0, 2.0])
    assert in_slice_distance(one, one, planes).max == 0.0
    there, back = in_slice_distance(one, two, planes), in_slice_distance(two, one, planes)
    assert there.mean == pytest.approx(back.mean, rel=1e-12)
    assert there.pair_std == pytest.approx(back.pair_std, rel=1e-12)


def test_slices_that_cut_one_surface_alone_are_counted_apart():
    found = in_slice_distance(sphere(10.0), sphere(20.0), slices([0.0, 15.0, 40.0]))
    assert (found.slices, found.skipped) == (1, 1)
    with pytest.raises(InputError, match="no slice cuts both"):
        in_slice_distance(sphere(10.0), sphere(20.0), slices([15.0]))


def test_slices_that_a_surface_does_not_reach_are_as_far_as_their_outlines():
    obj, centre = ball_object(20.0, spacing=(0.5, 0.5, 8.0))
    assert missed_distance(sphere(20.0, tuple(centre), subdivisions=4), obj) == 0.0
    # The slices at 16 mm are of circles 20 mm away from the middle.
    assert missed_distance(sphere(12.0, tuple(centre), subdivisions=5), obj) == pytest.approx(8.0, abs=0.5)


def test_distance_of_all_samples_converges_where_the_contours_cross():
    # A circle of radius 2 and a square of half side 1.6; from the circle by quadrature.
    one, two = sphere(20.0, subdivisions=5), box((32.0, 32.0, 32.0))
    angle = (np.arange(200_000) + 0.5) / 200_000 * 2 * np.pi
    x, y = np.abs(20.0 * np.cos(angle)), np.abs(20.0 * np.sin(angle))
    outside = np.hypot(np.maximum(x - 16.0, 0), np.maximum(y - 16.0, 0))
    circle = np.where(np.maximum(x, y) > 16.0, outside, 16.0 - np.maximum(x, y)).mean()
    side = (np.arange(100_000) + 0.5) / 100_000 * 16.0
    square = np.abs(np.hypot(16.0, side) - 20.0).mean()
    found = in_slice_distance(one, two, slices([0.0]), step=0.05)
    assert found.nearest == pytest.approx(0.5 * (circle + square), abs=0.01)
    coarse = in_slice_distance(one, two, slices([0.0]), step=0.4)
    assert coarse.nearest == pytest.approx(found.nearest, abs=0.05)


def test_mutual_nearest_neighbours_by_hand():
    a = np.array([[0.0, 0, 0], [1, 0, 0], [5, 0, 0]])
    b = np.array([[0.9, 0, 0], [5, 2, 0], [50, 0, 0]])
    there, back, mutual = nearest_distances(a, b)
    np.testing.assert_allclose(there, [0.9, 0.1, 2.0])
    np.testing.assert_allclose(back, [0.1, 2.0, np.sqrt(45.0**2)])
    assert mutual.tolist() == [False, True, True]


@pytest.mark.parametrize("mirrored", [False, True])
def test_marching_cubes_lies_on_the_label_contours_of_an_oblique_stack(mirrored):
    obj, _ = ball_object(seed=11, mirrored=mirrored)
    found = label_distance(marching_cubes(obj), obj)
    # Samples of equal contours begin at different points, hence up to half a step apart.
    assert found.max < 0.0501
    assert found.skipped == 0


def test_distance_to_label_contours_grows_with_the_error():
    obj, centre = ball_object(radius=24.0)
    near = label_distance(sphere(24.0, centre, subdivisions=5), obj).mean
    far = label_distance(sphere(26.0, centre, subdivisions=5), obj).mean
    # Half a pixel of staircase about the true circle; then 2 mm of radius, more where the slices cut it flatly.
    assert near < 0.4
    assert 1.9 < far < 2.8


def test_measure_moves_with_the_surfaces():
    one, two = sphere(20.0, subdivisions=3), sphere(20.5, (1.0, 0.3, 0.0), subdivisions=3)
    planes = slices([-6.0, 2.0])
    here = in_slice_distance(one, two, planes)
    carrier = Surface(np.r_[[p.point for p in planes], [p.point + p.normal for p in planes]], [[0, 1, 2]])
    there = moved(carrier, 5).points
    shifted = [Plane(there[i], there[i + 2] - there[i]) for i in range(2)]
    assert in_slice_distance(moved(one, 5), moved(two, 5), shifted).mean == pytest.approx(here.mean, abs=1e-6)


def test_slices_of_an_object_cut_its_surface_everywhere():
    obj, _ = ball_object()
    found = in_slice_distance(marching_cubes(obj), marching_cubes(obj), slice_planes(obj))
    assert found.slices == len(slice_planes(obj))


@pytest.mark.parametrize("step", [-0.1, 0.0, 1e-4, np.nan, np.inf])
def test_a_step_that_is_no_distance_is_refused(step):
    """A negative one took the ends of each contour alone."""
    ball = sphere(20.0)
    with pytest.raises(OptionError, match=rf"^step is {step}, expected a number at least 0\.001$"):
        in_slice_distance(ball, ball, [Plane([0, 0, 0], [0, 0, 1])], step=step)
