"""An object at rest has the same digits wherever it was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from femprep.image import Grid, LabelObject, make_object
from femprep.image.boundary import boundary_points
from femprep.image.canonical_frame import CanonicalFrame

SPACING = np.array([1.3671875, 1.40625, 8.0])


def body(direction: np.ndarray, origin: np.ndarray) -> LabelObject:
    x = (np.indices((24, 22, 8)).reshape(3, -1).T * SPACING).reshape(24, 22, 8, 3) - [16.0, 15.0, 28.0]
    return make_object(
        np.linalg.norm(x / [14.0, 12.0, 25.0], axis=3) < 1.0, Grid((24, 22, 8), SPACING, origin, direction)
    )


@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_no_digit_depends_on_the_place(hand):
    image = np.diag([1.0, 1.0, hand])
    straight = body(image, np.zeros(3))
    up = np.array([0.0, 0.0, 0.7312])
    one = CanonicalFrame.of(straight)
    points = boundary_points(straight)
    raised = points.points + np.where(points.axis[:, None] == 2, up, 0.0)
    expected = one.boundary(replace(points, points=raised))
    unit = points.normal @ Rotation.from_rotvec([0.3, 0.2, -0.7]).as_matrix()
    for seed in range(5):
        turn, shift = Rotation.random(random_state=seed).as_matrix(), np.array([123.4, -56.7, 8.9])
        there = body(turn @ image, shift)
        other = CanonicalFrame.of(there)
        assert other.obj.grid.direction.tobytes() == one.obj.grid.direction.tobytes()
        assert other.obj.barycentre.tobytes() == one.obj.barycentre.tobytes()
        moved = boundary_points(there)
        found = other.boundary(replace(moved, points=raised @ turn.T + shift))
        assert found.points.tobytes() == expected.points.tobytes()
        assert found.normal.tobytes() == expected.normal.tobytes()
        assert other.directions(unit @ turn.T).tobytes() == one.directions(unit).tobytes()


def test_what_is_in_the_canonical_frame_lies_there_by_the_image_axes():
    turn = Rotation.from_rotvec([0.5, -0.4, 0.2]).as_matrix()
    obj = body(turn @ np.diag([1.0, 1.0, -1.0]), np.array([10.0, 20.0, 30.0]))
    canonical, points = CanonicalFrame.of(obj), boundary_points(obj)
    here = canonical.boundary(points)
    there = (here.points - canonical.obj.barycentre) @ canonical.axes.T + obj.barycentre
    assert np.allclose(there, points.points, atol=1e-9)
    assert np.allclose(here.normal @ canonical.axes.T, points.normal, atol=1e-12)
    assert np.linalg.det(canonical.axes) == pytest.approx(1.0)
