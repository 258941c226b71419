from __future__ import annotations

import json

import pytest
from surface_shapes import ball_object, sphere

from femprep.image import Segmentation
from femprep.model import Surface
from femprep.surface.measure.compare import compare_surfaces
from femprep.surface.measure.sections import slice_planes
from femprep.surface.reference import marching_cubes


def test_two_spheres():
    found = compare_surfaces(sphere(20.0), sphere(21.0), samples=5000)
    assert found.distance.mean == pytest.approx(1.0, abs=0.01)
    assert found.volume is not None
    assert found.volume.difference_percent == pytest.approx(100.0 * ((20.0 / 21.0) ** 3 - 1.0), abs=1e-6)
    assert found.in_slice is None
    assert found.a.sound
    assert found.b.cells == len(sphere().cells)


def test_slices_of_a_segmentation_and_planes_agree():
    obj, centre = ball_object(seed=4)
    seg = Segmentation(obj.mask, obj.grid, {"ball": (1,)})
    ball = sphere(20.0, centre)
    one = compare_surfaces(ball, marching_cubes(obj), slices=seg, samples=2000)
    two = compare_surfaces(ball, marching_cubes(obj), slices=slice_planes(obj), samples=2000)
    assert one.in_slice is not None
    assert two.in_slice is not None
    assert one.in_slice.mean == two.in_slice.mean
    assert 0.0 < one.in_slice.mean < 1.0


def test_an_open_surface_has_no_volume_to_compare():
    ball = sphere(20.0)
    assert compare_surfaces(Surface(ball.points, ball.cells[1:]), ball, samples=500).volume is None


def test_record_is_json_by_groups():
    record = json.loads(compare_surfaces(sphere(20.0), sphere(21.0), samples=500).model_dump_json())
    assert set(record) == {"distance", "a_to_b", "b_to_a", "normals", "in_slice", "volume", "a", "b"}
    assert record["distance"]["mean"] == pytest.approx(1.0, abs=0.02)
