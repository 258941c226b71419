"""Voxels stored along whatever axes come into one storage, with their boundary points."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations, product

import numpy as np
import pytest

from femprep.image import Grid, LabelObject, make_object
from femprep.image.boundary import BoundaryPoints, boundary_points
from femprep.image.canonical_storage import stored_by_content

DIRECTION = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
WAYS = [(order, signs) for order in permutations(range(3)) for signs in product([1, -1], repeat=3)]


def ellipsoid(skew: float, spacing: tuple[float, float, float]) -> LabelObject:
    """Symmetric where it is not skew."""
    x = np.moveaxis(np.indices((13, 15, 9)), 0, -1) - [6.0, 7.0, 4.0]
    mask = np.linalg.norm(x / [4.5, 4.5, 3.5], axis=3) + skew * (x @ [0.03, 0.05, 0.1]) < 1.0
    return make_object(mask, Grid(mask.shape, spacing, (5.0, -3.0, 70.0), DIRECTION))


def stored(obj: LabelObject, order: tuple[int, ...], signs: tuple[int, ...]) -> LabelObject:
    way = list(order)
    corner = np.zeros(3)
    corner[way] = [n - 1 if sign < 0 else 0 for n, sign in zip(np.array(obj.mask.shape)[way], signs)]
    mask = np.transpose(obj.mask, order)[tuple(slice(None, None, s) for s in signs)]
    direction, grid = obj.grid.direction[:, way] * signs, obj.grid
    own = Grid(mask.shape, grid.spacing[way], grid.to_world(corner[None])[0], direction)
    return LabelObject(np.array(mask), own, obj.name, obj.report, obj.frame)


def same(one: BoundaryPoints, other: BoundaryPoints) -> bool:
    near = all(np.abs(getattr(one, name) - getattr(other, name)).max() < 1e-9 for name in ("points", "normal"))
    return near and all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("axis", "voxel"))


@pytest.mark.parametrize("spacing", [(1.5, 1.5, 8.0), (2.0, 2.0, 2.0)])
@pytest.mark.parametrize("framed", [False, True])
def test_one_storage_for_all(spacing: tuple[float, float, float], framed: bool) -> None:
    obj = ellipsoid(0.0 if framed else 1.0, spacing)
    if framed:  # which of the storages of a symmetric mask is meant the heart's axes tell
        frame = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
        obj = replace(obj, frame=frame * np.sign(np.linalg.det(frame)))
    expected, points = stored_by_content(obj)
    assert expected.grid.stack_axis == 2
    assert expected.barycentre == pytest.approx(obj.barycentre)
    own = boundary_points(obj)
    # As an apex is extrapolated: moved, but still the points of their voxels.
    up = np.where((own.axis == 2)[:, None], 0.7 * DIRECTION[:, 2], 0.0)
    raised = stored_by_content(obj, replace(own, points=own.points + up))[1]
    assert len(raised) == len(own)
    for order, signs in WAYS:
        other = stored(obj, order, signs)
        found, faces = stored_by_content(other)
        assert np.array_equal(found.mask, expected.mask)
        assert np.abs(found.grid.direction - expected.grid.direction).max() < 1e-12
        assert same(faces, points)
        theirs = boundary_points(other)
        along = np.abs(theirs.normal @ DIRECTION[:, 2]) > 0.5
        theirs = replace(theirs, points=theirs.points + np.where(along[:, None], 0.7 * DIRECTION[:, 2], 0.0))
        assert same(stored_by_content(other, theirs)[1], raised)


def test_slices_keep_their_offsets() -> None:
    obj = ellipsoid(-1.0, (1.5, 1.5, 8.0))
    offsets = np.zeros((obj.mask.shape[2], 3))
    offsets[:, :2] = np.random.default_rng(3).uniform(-0.7, 0.7, (len(offsets), 2))
    obj = replace(obj, grid=replace(obj.grid, offsets=offsets))
    found, points = stored_by_content(obj)
    assert not np.array_equal(found.mask, obj.mask)
    assert found.barycentre == pytest.approx(obj.barycentre)
    assert same(stored_by_content(obj, boundary_points(obj))[1], points)
    one, other = ({tuple(p) for p in np.round(b.points, 6)} for b in (points, boundary_points(obj)))
    assert one == other


def test_what_is_in_that_storage_stays_as_it_is() -> None:
    obj, points = stored_by_content(ellipsoid(1.0, (1.5, 1.5, 8.0)))
    assert stored_by_content(obj, points) == (obj, points)
