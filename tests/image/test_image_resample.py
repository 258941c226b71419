"""Isotropic resampling: places, volumes, shapes between slices."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from femprep.errors import OptionError
from femprep.image import Grid, isotropic, make_object, topology
from femprep.phantoms import lv_ellipsoid, rv_bent


def test_isotropic_object_stays_as_it_is():
    obj = lv_ellipsoid().segmentation((2.0, 2.0, 2.0)).object("lv")
    same = isotropic(obj)
    np.testing.assert_array_equal(same.mask, obj.mask)
    np.testing.assert_allclose(same.grid.origin, obj.grid.origin, atol=1e-12)


@pytest.mark.parametrize("spacing", [(1.4, 1.4, 8.0), (1.5, 1.2, 10.0), (8.0, 1.4, 1.4)])
@pytest.mark.parametrize(("new", "tolerance"), [(None, 0.012), (1.0, 0.012), (2.5, 0.03)])
def test_volume_and_barycentre_are_kept(spacing, new, tolerance):
    direction = Rotation.from_euler("xyz", [20, -30, 50], degrees=True).as_matrix()
    obj = lv_ellipsoid().moved(direction, (10, 20, 30)).segmentation(spacing).object("lv")
    fine = isotropic(obj, new)
    np.testing.assert_array_equal(fine.grid.spacing, np.full(3, new or min(spacing)))
    np.testing.assert_array_equal(fine.grid.direction, obj.grid.direction)
    assert fine.volume == pytest.approx(obj.volume, rel=tolerance)
    assert np.linalg.norm(fine.barycentre - obj.barycentre) < 0.6
    assert fine.report["resampled_by"] == "shape"


def test_shape_interpolation_is_closer_to_the_truth_than_repeating_slices():
    phantom = lv_ellipsoid()
    seg = phantom.segmentation((1.4, 1.4, 8.0), supersample=4)
    obj = seg.object("lv")
    fine = isotropic(obj, 1.0)
    points = fine.grid.to_world(np.argwhere(np.ones(fine.mask.shape, dtype=bool)))
    # Between the first and the last slice centre, where there are slices on both sides.
    height = phantom.height(points)
    centres = phantom.height(seg.slices("lv").centroid)
    points = points[(height > centres.min()) & (height < centres.max())]
    chosen = np.rint(fine.grid.to_index(points)).astype(int)
    truth = phantom.inside("lv", points)
    wrong = np.count_nonzero(fine.mask[tuple(chosen.T)] != truth)
    nearest = np.rint(obj.grid.to_index(points)).astype(int).clip(0, np.array(obj.mask.shape) - 1)
    wrong_nearest = np.count_nonzero(obj.mask[tuple(nearest.T)] != truth)
    assert wrong < 0.5 * wrong_nearest


def test_slices_that_hardly_overlap_are_joined_along_the_way_between_them():
    mask = np.zeros((20, 8, 4), dtype=bool)
    mask[1:7, 2:4, 1] = True
    mask[6:12, 4:6, 2] = True
    obj = make_object(mask, Grid(mask.shape, (1.0, 1.0, 8.0), np.zeros(3), np.eye(3)), "stairs")
    fine = isotropic(obj, along=True)
    assert fine.report["resampled_by"] == "shape"
    assert topology(fine.mask).pieces == 1
    for height, middle in ((9.0, (3.5 + 0.125 * 5.0, 2.5 + 0.25)), (12.0, (6.0, 3.5)), (15.0, (8.5 - 0.625, 4.25))):
        points = fine.grid.to_world(np.argwhere(fine.mask))
        own = points[np.abs(points[:, 2] - height) < 0.51]
        np.testing.assert_allclose(own[:, :2].mean(axis=0), middle, atol=0.6)
        # Both slices are 12 mm2.
        assert len(own) / len(np.unique(own[:, 2])) == pytest.approx(12.0, abs=4.0)


def test_slices_whose_middles_lie_outside_fall_back_to_repeating_them():
    x, y = np.mgrid[:24, :24] - 11.5
    ring = np.abs(np.hypot(x, y) - 7.75) < 1.25
    mask = np.zeros((24, 24, 4), dtype=bool)
    mask[:, :, 1] = ring & (y < 6.0)
    mask[:, :, 2] = ring & (np.hypot(x - 7.5, y) < 1.8)
    obj = make_object(mask, Grid(mask.shape, (1.0, 1.0, 8.0), np.zeros(3), np.eye(3)), "open ring")
    fine = isotropic(obj, along=True)
    assert fine.report["resampled_by"] == "nearest"
    assert fine.volume == pytest.approx(obj.volume)


def test_a_bent_body_stays_in_one_piece():
    fine = isotropic(rv_bent().segmentation((1.4, 1.4, 8.0)).object("rv"))
    found = topology(fine.mask)
    assert (found.pieces, found.tunnels, found.voids) == (1, 0, 0)


@pytest.mark.parametrize("spacing", [0.0, -1.0, float("nan")])
def test_bad_spacing_is_refused(spacing):
    obj = lv_ellipsoid().segmentation((4.0, 4.0, 8.0)).object("lv")
    with pytest.raises(OptionError, match="expected a positive number"):
        isotropic(obj, spacing)
