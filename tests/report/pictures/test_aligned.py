"""Views with slices and mesh drawn over them, and the chart of shifts."""

from __future__ import annotations

import numpy as np

import femprep as fp
from femprep.phantoms import lv_ellipsoid
from femprep.report.pictures.aligned import crossing, shift_chart, view_pictures
from femprep.report.pictures.overlay import Overlay
from femprep.report.pictures.slices import slice_pictures


def test_a_plane_crosses_a_rectangle_from_side_to_side():
    box = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]])
    ends = crossing(box, box[:, 1] - 1.0).reshape(-1, 2)
    np.testing.assert_allclose(ends[:, 1], 1.0, atol=1e-6)
    np.testing.assert_allclose([ends[:, 0].min(), ends[:, 0].max()], [0.0, 4.0])
    assert crossing(box, box[:, 1] + 1.0).size == 0


def test_views_show_the_slices_and_slices_the_views():
    seg = lv_ellipsoid().segmentation((2.0, 2.0, 8.0))
    index = np.stack(np.meshgrid(np.arange(60), np.arange(80), indexing="ij"), axis=-1).reshape(-1, 2) * 2.0
    axes, start = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]), np.array([-60.0, 0.0, -80.0])
    labels = seg.grid.values_at(seg.labels, seg.grid.to_index(start + index @ axes.T)).reshape(60, 80)
    view = fp.PlaneView("4ch", labels, seg.structures, start, axes, [2.0, 2.0], 6.0)
    alone = slice_pictures(seg, Overlay({}))
    both = seg.with_views(view)
    (picture,) = view_pictures(both, Overlay({}))
    slices = int(np.moveaxis(seg.labels, seg.stack_axis, 0).any(axis=(1, 2)).sum())
    assert picture.count('class="planes"') == 1
    assert picture.count("stroke-opacity") == slices
    assert all("planes" not in one for one in alone)
    assert all("planes" in one for one in slice_pictures(both, Overlay({})))


def test_the_chart_has_two_points_a_slice():
    slices = [{"slice": k, "shift": [k - 2.0, 0.5], "deviation": 0.4} for k in range(5)]
    assert shift_chart({"slices": slices}).count("<circle") == 10
