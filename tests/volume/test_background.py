"""Edge lengths about a body: as asked for in it, longer with the distance from it, on a mesh that covers its box."""

import numpy as np
import pytest
from analytic_walls import ellipsoid_wall

from femprep.mesh.measures.volume_elements import element_volumes
from femprep.mesh.search.closest import ClosestFinder
from femprep.volume.background import background_field
from femprep.volume.blood import Filling


@pytest.fixture(scope="module")
def wall():
    return ellipsoid_wall(rings=16)


@pytest.mark.slow
def test_edges_are_as_asked_for_in_the_wall_and_grow_with_the_distance_from_it(wall):
    field = background_field(Filling(wall, None), 2.0, 0.3)
    far = ClosestFinder(wall.points, wall.triangles).signed(field.points)
    assert np.array_equal(field.values[far <= 1e-9], np.full((far <= 1e-9).sum(), 2.0))
    assert (field.values <= 2.0 + far.clip(0.0) + 4.0).all()
    assert field.values.max() == 12.0
    assert (field.finest, field.coarsest) == (2.0, 2.0)
    assert field.elements == pytest.approx(wall.volume / 8.0)


def test_the_background_mesh_covers_the_box_about_the_wall_as_far_as_its_longest_edge(wall):
    field = background_field(Filling(wall, None), 2.0, 0.3)
    volumes = element_volumes(field.points, field.tets, "tetra")
    assert volumes.min() > 0.0
    assert volumes.sum() == pytest.approx(np.prod(np.ptp(field.points, axis=0)), rel=1e-6)
    assert (field.points.min(axis=0) < wall.points.min(axis=0) - 12.0).all()
    assert (field.points.max(axis=0) > wall.points.max(axis=0) + 12.0).all()


@pytest.mark.slow
def test_edges_longer_than_those_far_from_the_body_are_kept(wall):
    field = background_field(Filling(wall, None), 15.0, 0.3)
    assert (field.values == 15.0).all()
