"""The base of both ventricles: the LV's, or nearer the apex where the RV ends early or falls into pieces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import binary_dilation

import femprep as fp
from femprep.errors import InputError
from femprep.phantoms import biventricular
from femprep.wall import find_base, find_common_base


@pytest.fixture(scope="module")
def heart():
    return biventricular().segmentation(spacing=(1.4, 1.4, 8.0))


def without_rv(seg, slices: int, part: slice = slice(None)):
    """The label map with the RV taken out of its most basal (last) slices, or out of some of their rows."""
    labels = np.array(seg.labels)
    last = int(np.flatnonzero((labels == 1).any(axis=(0, 1)))[-1])
    for k in range(last, last - slices, -1):
        plane = labels[:, part, k]
        plane[plane == 1] = 0
    return replace(seg, labels=labels)


def test_it_is_the_base_of_the_left_ventricle_where_both_reach_it(heart):
    common, left = find_common_base(heart), find_base(heart)
    np.testing.assert_array_equal(common.point, left.point)
    assert common.source == left.source


@pytest.mark.parametrize("slices", [1, 2])
def test_it_moves_to_where_the_right_ventricle_begins(heart, slices):
    short = without_rv(heart, slices)
    common, left = find_common_base(short), find_base(short)
    assert left.signed_distance(common.point) == pytest.approx(-8.0 * slices)
    assert f"{slices} slice(s) below the left ventricle's base" in common.source


def test_a_slice_in_which_the_right_ventricle_is_in_two_pieces_is_passed_over(heart):
    labels = np.asarray(heart.labels)
    rows = np.flatnonzero((labels == 1).any(axis=(0, 2)))
    middle = int(rows.mean())
    common = find_common_base(without_rv(heart, 1, slice(middle - 4, middle + 4)))
    assert find_base(heart).signed_distance(common.point) == pytest.approx(-8.0)


@pytest.mark.parametrize(("kept", "slices"), [(0.8, 0), (0.1, 1)])
def test_a_slice_that_is_a_lid_of_the_right_ventricle_is_passed_over(heart, kept, slices):
    """Of its last slice a tenth of the rows is left: the next one lies bare by 40 mm, at 11 degrees."""
    rows = np.flatnonzero((np.asarray(heart.labels) == 1).any(axis=(0, 2)))
    end = rows[0] + int(kept * len(rows))
    common = find_common_base(without_rv(heart, 1, slice(end, None)))
    assert find_base(heart).signed_distance(common.point) == pytest.approx(-8.0 * slices)


def walled(seg, gap: int, everywhere: bool = False):
    """The label map with the wall of the RV labelled 4, two pixels thick, and open in its most basal slices, or all."""
    labels = np.array(seg.labels)
    (right,), (lv,), (myo,) = (seg.structures[name] for name in ("rv", "lv", "myo"))
    slices = np.flatnonzero((labels == right).any(axis=(0, 1)))
    for k in slices:
        plane = labels[:, :, k]
        free = ~np.isin(plane, (right, lv, myo))
        plane[binary_dilation(plane == right, iterations=2) & free] = 4
        if everywhere or k > slices[-1] - gap:  # as beside the tricuspid valve
            rows = np.flatnonzero((plane == 4).any(axis=0))
            middle = plane[:, rows[len(rows) // 2] - 3 : rows[len(rows) // 2] + 3]
            middle[middle == 4] = 0
    return replace(seg, labels=labels, structures={**seg.structures, "rv_wall": (4,)})


@pytest.mark.parametrize("gap", [0, 1, 2])
def test_a_labelled_wall_closes_around_the_right_ventricle(heart, gap):
    common = find_common_base(walled(heart, gap))
    assert find_base(heart).signed_distance(common.point) == pytest.approx(-8.0 * gap)
    assert ("where the wall closes around the right ventricle" in common.source) == (gap > 0)
    assert len(common.notices) == (gap > 0)


def test_a_labelled_wall_with_holes_everywhere_tells_nothing(heart):
    common, left = find_common_base(walled(heart, 0, everywhere=True)), find_base(heart)
    np.testing.assert_array_equal(common.point, left.point)


def test_a_right_ventricle_open_to_its_atrium_is_cut_below_the_valve(data):
    """Slices 10 and 11 of this stack hold the right atrium beside the ventricle; cut there it has no wall."""
    seg = fp.read_segmentation(data / "rodero01" / "rodero01_sax_4ch_1.4x1.4x8_label.nii.gz", preset="rodero")
    assert "slice 10" in find_base(seg).source
    assert "slice 12" in find_common_base(seg).source
    assert "slice 10" in find_common_base(replace(seg, structures={**seg.structures, "rv_wall": (99,)})).source


def test_a_right_ventricle_that_is_nowhere_near_the_base_is_refused(heart):
    with pytest.raises(InputError, match="opens the cavity of the right ventricle as well"):
        find_common_base(without_rv(heart, 8), basal_end="last")
