from __future__ import annotations

import sys

import numpy as np
import pytest
from surface_shapes import ball_object, sphere

from femprep.errors import MissingDependencyError
from femprep.image import boundary_points
from femprep.mesh.search.closest import ClosestFinder
from femprep.surface.measure.distance import surface_distance
from femprep.surface.measure.quality import surface_quality
from femprep.surface.reference import METHODS, marching_cubes, remeshed, slice_interpolation
from femprep.surface.reference.slice_interpolation import interpolated_distance


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("mirrored", [False, True])
def test_every_method_gives_a_sound_ball_where_the_image_lies(method, mirrored):
    obj, centre = ball_object(radius=24.0, seed=5, mirrored=mirrored)
    surface = METHODS[method](obj)
    quality = surface_quality(surface)
    assert quality.closed
    assert quality.outward
    assert quality.pieces == 1
    assert quality.euler_characteristic == 2
    assert surface.info["method"] == method
    distance = surface_distance(surface, sphere(24.0, centre), samples=4000)
    assert distance.both.mean < 1.5
    np.testing.assert_allclose(surface.points.mean(axis=0), centre, atol=1.0)


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_every_method_repeats_exactly(method):
    obj, _ = ball_object(radius=12.0, seed=2)
    one, two = METHODS[method](obj), METHODS[method](obj)
    assert one.points.tobytes() == two.points.tobytes()
    assert one.cells.tobytes() == two.cells.tobytes()


@pytest.mark.slow
def test_marching_cubes_passes_through_the_boundary_points():
    obj, _ = ball_object(radius=12.0, seed=9)
    surface = marching_cubes(obj)
    points = boundary_points(obj).points
    assert len(surface.points) == len(points)
    assert ClosestFinder(surface.points, surface.cells)(points).distance.max() < 1e-4
    order, expected = np.lexsort(surface.points.round(3).T), np.lexsort(points.round(3).T)
    np.testing.assert_allclose(surface.points[order], points[expected], atol=1e-4)


def test_slice_interpolation_keeps_the_slices_and_halves_the_terraces():
    obj, centre = ball_object(radius=24.0)
    phi, grid = interpolated_distance(obj)
    assert grid.spacing.tolist() == [1.4, 1.4, 1.4]
    # At a slice's own height the sign is the mask's.
    k = obj.grid.shape[2] // 2
    height = k * 8.0 / 1.4
    assert np.all((phi[:, :, round(height)] > 0) == obj.mask[:, :, k])
    truth = sphere(24.0, centre)
    terraced = surface_distance(marching_cubes(obj), truth).both.mean
    smooth = surface_distance(slice_interpolation(obj), truth).both.mean
    assert smooth < 0.8 * terraced


def test_remeshing_gives_the_vertices_asked_for_and_even_triangles():
    obj, _ = ball_object(radius=24.0)
    surface = remeshed(obj, vertices=800)
    assert abs(len(surface.points) - 800) < 40
    quality = surface_quality(surface)
    assert quality.q.mean > 0.9


def test_without_pyacvd_the_message_names_the_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyacvd", None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'femprep\[compare\]'"):
        remeshed(ball_object(radius=12.0)[0])
