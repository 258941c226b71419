"""A base across the long axis of a ventricle that an image of cubic voxels, as of CT, holds at any angle."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import femprep as fp
from femprep.image import Grid, Segmentation
from femprep.image.long_axis import long_axis
from femprep.phantoms import biventricular, lv_ellipsoid
from femprep.wall import extend_apex, find_apex, find_base, find_common_base
from femprep.wall.planes.oblique import look_across, tilt

RODERO = "rodero01/rodero01_4ch_1.0mm_label.nii.gz"


def held(phantom, degrees: float, voxel: float = 1.5, apex: str = "capped") -> Segmentation:
    """A phantom, its long axis along z, in an image that is turned by some degrees about a slanted axis across it."""
    grid = phantom.grid((voxel,) * 3)
    turn = Rotation.from_rotvec(np.radians(degrees) * np.array([0.8, 0.6, 0.0])).as_matrix()
    side = int(np.linalg.norm(np.multiply(grid.shape, voxel)) / voxel) + 2
    middle = grid.to_world((np.array(grid.shape) - 1.0) / 2.0)
    origin = middle - turn @ np.full(3, 0.5 * (side - 1) * voxel)
    return phantom.segmentation(grid=Grid((side,) * 3, (voxel,) * 3, origin, turn), apex=apex)


@pytest.mark.parametrize("degrees", [35.0, 50.0, 130.0])
def test_the_base_lies_across_the_long_axis_below_the_opening(degrees):
    seg = held(lv_ellipsoid(), degrees)
    base = find_base(seg)
    assert np.degrees(np.arccos(base.normal[2])) < 2.0
    assert "across the long axis" in base.source
    assert [notice.kind for notice in base.notices] == ["assumed", "moved"]
    # The phantom ends flat at its base, within which the plane lies by 2.5 mm and a voxel's tilt.
    away = base.signed_distance(seg.grid.to_world(np.argwhere(seg.mask("lv"))))
    assert -0.5 < away.max() < 4.5
    apex = find_apex(seg)
    assert base.normal @ apex.normal == pytest.approx(-1.0)
    assert extend_apex(seg, seg.object("lv", "myo")).info["apex"]["extrapolated_mm"] == 0.0


def test_what_lies_across_already_stays_as_it_is():
    seg = held(lv_ellipsoid(), 10.0)
    assert tilt(seg) == pytest.approx(10.0, abs=1.5)
    assert look_across(seg).seg is seg
    assert "centre of slice" in find_base(seg).source


def test_a_cavity_that_is_open_at_the_apex_as_well_has_its_base_at_the_wider_end():
    seg = lv_ellipsoid().segmentation(spacing=(2.0, 2.0, 2.0), apex="uncapped")
    np.testing.assert_allclose(long_axis(seg).direction, [0.0, 0.0, 1.0], atol=0.02)
    assert look_across(seg).seg is seg


@pytest.mark.parametrize("case", ["011_frame01", "021_frame13", "041_frame01"])
def test_a_stack_drawn_on_cubic_voxels_is_cut_across_the_heart(data, case):
    seg = fp.read_segmentation(data / f"acdc/training/patient{case[:3]}/patient{case}_gt.nii.gz", preset="acdc")
    grid = seg.grid
    times = round(grid.spacing[2] / grid.spacing[0])
    labels = np.repeat(seg.labels, times, axis=2)
    fine = Grid(
        labels.shape, grid.spacing / [1, 1, times], grid.to_world([[0, 0, 0.5 / times - 0.5]])[0], grid.direction
    )
    cubic = Segmentation(labels, fine, seg.structures)
    # These ventricles are wider than they are long, so that the longest axis is none of the heart's.
    assert cubic.stack_axis != 2
    assert np.degrees(np.arccos(find_base(cubic).normal @ find_base(seg).normal)) < 15.0


def test_slices_tell_the_stack_and_so_does_a_basal_end_that_is_given():
    turned = held(lv_ellipsoid(), 50.0)
    assert look_across(turned, "last").seg is turned
    thick = lv_ellipsoid().segmentation(spacing=(1.5, 1.5, 8.0))
    assert look_across(thick).seg is thick


def test_the_plane_is_the_same_whichever_way_the_image_is_stored():
    seg = held(lv_ellipsoid(), 50.0, 2.0)
    grid = seg.grid
    order = [2, 0, 1]
    stored = Grid(
        tuple(grid.shape[a] for a in order),
        grid.spacing[order],
        grid.origin,
        np.ascontiguousarray(grid.direction[:, order]),
    )
    other = Segmentation(np.ascontiguousarray(seg.labels.transpose(order)), stored, seg.structures)
    one, two = find_base(seg), find_base(other)
    np.testing.assert_allclose(one.normal, two.normal, atol=1e-9)
    assert one.signed_distance(two.point) == pytest.approx(0.0, abs=1e-6)


def test_both_ventricles_are_opened():
    seg = held(biventricular(), 50.0)
    base = find_common_base(seg)
    assert np.degrees(np.arccos(base.normal[2])) < 3.0
    for name in ("lv", "rv"):
        away = base.signed_distance(seg.grid.to_world(np.argwhere(seg.mask(name))))
        assert away.min() < -20.0
        assert away.max() > 0.0


def test_a_turned_heart_is_meshed_as_it_is():
    seg = held(lv_ellipsoid(), 50.0, 2.0)
    run = fp.mesh_segmentation(seg, surface={"vertices": 600}, volume={"edge_length": 6.0})
    assert run.quality.passed, run.quality.failures
    normal = run.mesh.planes["base"].normal
    assert np.degrees(np.arccos(normal[2])) < 2.0


def test_a_heart_of_ct_is_cut_below_its_valves(data):
    seg = fp.read_segmentation(data / RODERO, preset="rodero")
    assert tilt(seg) == pytest.approx(48.8, abs=0.1)
    left, both = find_base(seg), find_common_base(seg)
    atrium, cavity = (seg.grid.to_world(np.argwhere(seg.mask(name))) for name in ("la", "lv"))
    axis = atrium.mean(axis=0) - cavity.mean(axis=0)
    # Its atrium lies beside the axis, not on it.
    assert np.degrees(np.arccos(left.normal @ axis / np.linalg.norm(axis))) < 35.0
    assert (left.signed_distance(cavity) < 0.0).mean() == pytest.approx(0.87, abs=0.03)
    # Its right ventricle opens 10 mm further down.
    assert left.signed_distance(both.point) == pytest.approx(-10.0, abs=1e-6)
    right = seg.grid.to_world(np.argwhere(seg.mask("ra")))
    assert (both.signed_distance(right) > 0.0).mean() > 0.9


@pytest.mark.filterwarnings("error")
def test_a_label_of_both_cavity_and_muscle_is_named():
    """No voxel closed the cavity off, and the axes were not a number."""
    labels = np.zeros((5, 5, 5), dtype=np.uint8)
    labels[1:4, 1:4, 1:4] = 1
    seg = Segmentation(labels, Grid(labels.shape, (1, 1, 1), (0, 0, 0), np.eye(3)), {"lv": 1, "myo": 1})
    with pytest.raises(fp.InputError, match="the structures lv and myo share label 1, so that nothing tells"):
        long_axis(seg)
