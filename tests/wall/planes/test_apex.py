from __future__ import annotations

import numpy as np
import pytest
from wall_shapes import shifted_end, stack, turned

from femprep.image import boundary_points
from femprep.phantoms import lv_ellipsoid
from femprep.surface import fit_surface, label_distance
from femprep.wall import extend_apex


def extended(seg, **changes):
    obj = seg.object("lv", "myo")
    return obj, boundary_points(obj), extend_apex(seg, obj, **changes)


def cylinder(kinds: str, radius=16.0, **placement):
    """Cavity of even radius in a wall of 8 mm, its base (an open ring) in the first slice."""
    return stack(list("c" + kinds), radii=np.full(len(kinds) + 1, radius), **placement)


def heights(seg, points, slice_: int) -> np.ndarray:
    """How far points stand beyond the centre of a slice, mm."""
    return (seg.grid.to_index(points)[:, 2] - slice_) * seg.grid.spacing[2]


def test_a_capped_cavity_is_left_as_it_is():
    obj, plain, points = extended(cylinder("oooom"))
    assert (points.points == plain.points).all()
    assert points.info["apex"] == {"uncapped_share": 0.0, "extrapolated_mm": 0.0}
    assert obj.voxels > 0


def test_an_uncapped_cylinder_gets_a_dome_as_thick_as_its_wall():
    seg = cylinder("oooo")
    _, plain, points = extended(seg)
    info = points.info["apex"]
    assert info["uncapped_share"] == 1.0
    assert info["extrapolated_mm"] == pytest.approx(8.0, abs=1.0)  # a pixel is 1.5 mm
    top = heights(seg, points.points, 4)
    assert top.max() == pytest.approx(4.0 + info["extrapolated_mm"])
    assert heights(seg, plain.points, 4).max() == pytest.approx(4.0)
    # No point of the rest moved, none was lost.
    assert len(points) == len(plain)
    moved = np.abs(points.points - plain.points).max(axis=1) > 0
    assert (heights(seg, plain.points[moved], 4) == 4.0).all()
    # Over the cavity it is level, at the contour of the slice it meets the slice.
    radius = np.hypot(*(points.points - [seg.grid.to_world([[31.5, 31.5, 4]])[0]]).T[:2])
    assert top[moved & (radius < 15.0)].min() == pytest.approx(top.max())
    assert top[moved & (radius > 23.0)].max() < 7.0


def test_the_dome_clears_the_cavity_by_about_its_thickness():
    seg = cylinder("oooo")
    obj, _, points = extended(seg)
    thickness = points.info["apex"]["extrapolated_mm"]
    cavity = boundary_points(seg.object("lv"))
    centre = seg.grid.to_world([[31.5, 31.5, 4]])[0]
    beyond = (points.points - centre)[:, 2] > 0.5
    gap = np.linalg.norm(points.points[beyond, None] - cavity.points[None], axis=2).min(axis=1)
    assert gap.min() > 0.8 * thickness
    assert np.median(gap) < 1.3 * thickness
    assert obj.name


def test_a_partial_cap_is_left_as_the_labels_have_it():
    seg = cylinder("oooom")
    labels = seg.labels.copy()
    labels[:32, :, -1] = 0  # half of the cap is missing
    half = type(seg)(labels, seg.grid, seg.structures)
    _, plain, points = extended(half)
    assert points.info["apex"] == {"uncapped_share": pytest.approx(0.5, abs=0.05), "extrapolated_mm": 0.0}
    assert (points.points == plain.points).all()


def test_a_bare_shoulder_between_two_slices_is_left_to_the_labels():
    seg = stack(list("coooo"), radii=[20.0, 20.0, 20.0, 20.0, 6.0])  # the last ring ends within the cavity before it
    _, plain, points = extended(seg)
    assert len(points) == len(plain)
    moved = np.abs(points.points - plain.points).max(axis=1) > 0
    assert moved.any()
    # What is put elsewhere is the flat end of the last slice alone.
    assert (heights(seg, plain.points[moved], 4) == 4.0).all()


@pytest.mark.slow
def test_a_last_slice_that_is_shifted_and_small_keeps_its_outline():
    """As where a breath was held otherwise: 10 mm beside the others and half as wide."""
    seg = shifted_end(10.0)
    endo, heart = seg.object("lv"), seg.object("lv", "myo")
    epi = fit_surface(heart, boundary=extend_apex(seg, heart, endo=fit_surface(endo)))
    found = label_distance(epi, heart)
    assert found.skipped == 0
    assert found.max < 2.0 * seg.grid.spacing[0]


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_an_oblique_image_is_extended_along_its_own_axis(seed):
    turn = turned(seed)
    straight, oblique = cylinder("oooo"), cylinder("oooo", direction=turn)
    a, b = extended(straight)[2], extended(oblique)[2]
    origin = straight.grid.origin
    assert (a.points - origin) @ turn.T + origin == pytest.approx(b.points)


def test_a_phantom_whose_apex_is_cut_off_gets_one_near_the_true_apex():
    """The cavity of this ellipsoid ends 9 mm above the epicardium; its labels end with the cavity."""
    phantom = lv_ellipsoid()
    seg = phantom.segmentation((1.5, 1.5, 8.0), apex="uncapped")
    obj, plain, points = extended(seg)
    low = phantom.height(points.points).min()
    before = phantom.height(plain.points).min()
    assert points.info["apex"]["extrapolated_mm"] == pytest.approx(9.0, abs=3.0)
    assert low < before - 5.0
    assert abs(low - -69.0) < 8.0  # within a slice
    assert obj.volume > 0


def test_the_thickness_has_a_floor():
    seg = cylinder("oooo")
    _, _, points = extended(seg, minimum_thickness=12.0)
    assert points.info["apex"]["extrapolated_mm"] == 12.0
