"""Contours become labels: areas, gaps in the stack, open ends, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drawn_hearts import drawn

import femprep as fp
from femprep.image.contour_labels import inside


@pytest.fixture(scope="module")
def made():
    return drawn()


def test_a_polygon_keeps_its_area_wherever_it_lies():
    angle = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    circle = 30.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    areas = [inside(circle + 40.0 + shift, (90, 90)).sum() for shift in np.random.default_rng(1).random((20, 2))]
    assert np.mean(areas) == pytest.approx(np.pi * 900.0, rel=2e-3)


def test_a_concave_polygon_leaves_its_notch_out():
    notched = np.array([[0.5, 0.5], [10.5, 0.5], [10.5, 10.5], [5.5, 2.5], [0.5, 10.5]])
    found = inside(notched, (12, 12))
    assert found[2, 5]
    assert not found[5, 6]


def test_a_missing_plane_is_interpolated_and_reported(made):
    seg = made.to_segmentation()
    kept = replace(
        made,
        planes=[plane for plane in made.planes if plane.name != "slice 4"],
        contours=[one for one in made.contours if one.plane != "slice 4"],
    )
    found = kept.to_segmentation()
    assert found.grid.shape[2] == seg.grid.shape[2]
    assert found.grid.spacing[2] == pytest.approx(seg.grid.spacing[2])
    assert any("interpolated" in notice["what"] for notice in found.info["notices"])
    for name in ("lv", "myo", "rv"):
        assert found.mask(name).sum() == pytest.approx(seg.mask(name).sum(), rel=0.02)


def test_an_open_slice_at_the_end_is_left_to_the_views(made):
    """Half of the outlines of the highest slice is cut away, as where it passes through a valve."""
    cut = []
    for one in made.contours:
        if one.plane == "slice 1" and one.surface in ("lv", "epi"):
            plane = made.planes[0]
            at = plane.to_plane(one.points)
            one = replace(one, points=one.points[at[:, 0] > np.median(plane.to_plane(one.points)[:, 0])])
        cut.append(one)
    found = replace(made, contours=cut).to_segmentation()
    assert not found.mask("lv")[:, :, -1].any()
    assert any("open" in notice["what"] for notice in found.info["notices"])
    without = replace(made, planes=made.planes[:10], contours=[one for one in cut if one.plane.startswith("slice")])
    assert without.to_segmentation().mask("lv")[:, :, -1].any()


def test_what_makes_no_stack_is_refused(made):
    views = [one for one in made.contours if not one.plane.startswith("slice")]
    with pytest.raises(fp.InputError, match="at least two"):
        replace(made, contours=views).to_segmentation()
    tilted = replace(made.planes[10], short_axis=True)
    with pytest.raises(fp.InputError, match="not parallel"):
        replace(made, planes=(*made.planes[:10], tilted, *made.planes[11:])).to_segmentation()
    with pytest.raises(fp.OptionError, match="positive"):
        made.to_segmentation(pixel=0.0)
