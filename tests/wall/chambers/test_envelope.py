"""The body that encloses grown surfaces: least distances hold, joins are round, the template lies exactly on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from wall_shapes import Ellipsoid, template_surface

from femprep.image import Grid
from femprep.mesh.search.closest import ClosestFinder
from femprep.surface.fitting.outlined import outline_surface
from femprep.wall import Envelope, Part
from femprep.wall.chambers.envelope import _joined

GRID = Grid((4, 4, 4), np.ones(3), np.zeros(3), np.eye(3))


def sphere(radius: float, x: float = 0.0, vertices: int = 600):
    return template_surface(Ellipsoid((radius,) * 3, np.array([x, 0.0, 0.0])), vertices, "ball")


@pytest.fixture(scope="module")
def pair() -> tuple[Envelope, Part, Part]:
    first, second = Part(sphere(20.0), 0.0, 0.0), Part(sphere(15.0, 22.0), 3.0, 6.0)
    return Envelope([first, second]), first, second


def test_the_field_of_one_part_is_its_distance_less_the_thickness():
    envelope = Envelope([Part(sphere(20.0, vertices=1500), 3.0, 0.0)])
    value, gradient = envelope.with_gradients(np.array([[30.0, 0, 0], [0, 21.0, 0], [0, 0, 10.0]]))
    np.testing.assert_allclose(value, [7.0, -2.0, -13.0], atol=0.1)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1.0, atol=1e-9)


def test_the_join_never_takes_tissue_away_and_adds_at_most_a_quarter_of_the_blend(pair):
    envelope, first, second = pair
    points = np.random.default_rng(1).uniform(-40, 60, (4000, 3))
    least = np.min([Envelope([part]).values(points) for part in (first, second)], axis=0)
    added = least - envelope.values(points)
    assert added.min() >= -1e-12
    assert 1.0 < added.max() <= 6.0 / 4 + 1e-9


def test_parts_that_are_too_far_to_be_joined_are_not_looked_for():
    parts = [Part(sphere(20.0), 0.0, 0.0), Part(sphere(15.0, 22.0), 3.0, 6.0), Part(sphere(9.0, -14.0), -1.0, 2.0)]
    points = np.random.default_rng(1).uniform(-40, 60, (4000, 3))
    alone = [Envelope([part]).with_gradients(points) for part in parts]
    for blend, other in zip((6.0, 2.0), alone[1:]):
        alone[0] = _joined(alone[0], other, blend)
    np.testing.assert_array_equal(Envelope(parts).values(points), alone[0][0])
    np.testing.assert_array_equal(Envelope(parts).with_gradients(points)[1], alone[0][1])


def test_blocks_of_voxels_are_decided_as_each_voxel_is(pair):
    envelope, *_ = pair
    obj = envelope.object(GRID, "epi")
    inner = tuple(n - 1 for n in obj.mask.shape)
    index = np.stack(np.meshgrid(*(np.arange(0, n, 3) for n in inner), indexing="ij"), axis=-1).reshape(-1, 3)
    np.testing.assert_array_equal(obj.mask[tuple(index.T)], envelope.values(obj.grid.to_world(index)) < 0)


def test_a_settled_surface_keeps_the_thickness_everywhere(pair):
    envelope, first, second = pair
    obj = envelope.object(GRID, "epi")
    rough = outline_surface(obj, 900)
    surface = envelope.settle(rough)
    assert np.abs(envelope.values(surface.points)).max() < 1e-3
    for part in (first, second):
        distance = ClosestFinder(part.surface.points, part.surface.triangles).signed(surface.points)
        assert distance.min() >= part.thickness - 1e-3
    np.testing.assert_array_equal(surface.cells, rough.cells)
    assert surface.info["settled"]["farthest_mm"] > 0.0


@pytest.mark.slow
def test_a_fold_in_a_narrow_groove_is_told_and_goes_where_the_groove_is_filled():
    one, other = replace(sphere(20.0), name="lv_epi"), replace(sphere(15.0, 35.0), name="rv")
    narrow = Envelope([Part(one, 0.0, 0.0), Part(other, 1.0, 0.2)])
    rough = outline_surface(narrow.object(GRID, "epi"), 500)
    assert narrow.folds(narrow.settle(rough)) > 0
    for below in (0.5, 0.0):  # as far as it takes
        filled = narrow.filled(rough, below)
        surface = filled.settle(rough)
        if filled.folds(surface) == 0:
            break
    assert filled.folds(surface) == 0
    assert np.abs(filled.values(surface.points)).max() < 1e-3
    added = narrow.values(surface.points)  # in the groove alone, and never less than the body
    assert added.min() > -1e-3
    assert np.median(added) < 0.5
    away = np.linalg.norm(surface.points - [19.0, 0.0, 0.0], axis=1)
    assert added[away > 25.0].max() < 1e-3  # the outline lies as far off the body as its voxels are large
