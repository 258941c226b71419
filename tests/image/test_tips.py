"""Tips one pixel wide within thick slices: what is one, what is none, and that it is left out and said."""

import time

import numpy as np
import pytest

from femprep.image import Grid, make_object, read_segmentation
from femprep.image.tips import thin_tips


def plane(text: str) -> np.ndarray:
    """Three equal slices of what is drawn."""
    rows = [list(line) for line in text.split()]
    return np.repeat((np.array(rows) != ".")[:, :, None], 3, axis=2)


#: Voxels of tips are drawn as t.
TIP = """
..............
.oooo.........
.oooottttt....
.oooo.....tt..
.oooo.........
..............
"""
#: What a neck one pixel wide holds is part of the tip where it is smaller than a square of three.
BLOB = """
..............
.oooo.........
.oooottttttt..
.oooo....ttt..
.oooo.........
..............
"""
#: No tips: corners, a bridge, a thin slice.
CORNERS = """
..............
....oo........
..ooooooo.....
..oooooo......
.oooooooo.....
..oo..o.......
"""
BRIDGE = """
..............
.oooo....oooo.
.ooooooooooooo
.oooo....oooo.
.oooo....oooo.
..............
"""
THIN = """
..............
.ooooo........
......ooooo...
..............
"""


@pytest.mark.parametrize("text", [TIP, BLOB])
@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("flipped", [False, True])
@pytest.mark.parametrize("stack_axis", range(3))
def test_tips_are_found_however_they_lie(text, turns, flipped, stack_axis):
    mask = plane(text)
    drawn = np.repeat((np.array([list(line) for line in text.split()]) == "t")[:, :, None], 3, axis=2)
    mask, drawn = (np.rot90(a, turns, axes=(0, 1)) for a in (mask, drawn))
    if flipped:
        mask, drawn = mask[::-1], drawn[::-1]
    mask, drawn = (np.moveaxis(a, 2, stack_axis) for a in (mask, drawn))
    tips, count = thin_tips(mask, stack_axis)
    assert count == 3
    np.testing.assert_array_equal(tips, drawn)


@pytest.mark.parametrize("text", [CORNERS, BRIDGE, THIN])
def test_corners_bridges_and_thin_slices_stay(text):
    tips, count = thin_tips(plane(text), 2)
    assert count == 0
    assert not tips.any()


def test_what_alone_holds_slices_together_stays():
    mask = plane(TIP)
    mask[:, :, 1] = False
    mask[2:6, 11:14, 1] = True
    tips, count = thin_tips(mask, 2)
    assert (count, int(tips.sum())) == (0, 0)
    mask[2:6, 2:14, 1] = True
    assert thin_tips(mask, 2)[1] == 2


def test_tips_of_thick_slices_are_left_out_and_said():
    mask = np.pad(plane(TIP), ((0, 0), (0, 0), (1, 1)))
    thick = Grid(mask.shape, (1.5, 1.5, 8.0), np.zeros(3), np.eye(3))
    obj = make_object(mask, thick, "rv")
    assert obj.voxels == 48
    assert (obj.report["tips"], obj.report["tip_voxels"], obj.report["removed_voxels"]) == (3, 21, 21)
    (notice,) = obj.report["notices"]
    assert notice["kind"] == "left out"
    assert "3 tips one pixel wide were left out" in notice["what"]
    assert (notice["amount"], notice["unit"]) == (21, "voxels")
    assert make_object(mask, thick, "rv", policy="strict").voxels == 69
    thin = Grid(mask.shape, (1.5, 1.5, 1.5), np.zeros(3), np.eye(3))
    assert make_object(mask, thin, "rv").report["tips"] == 0


@pytest.mark.slow
def test_real_right_ventricles_have_tips_and_left_ones_none(data):
    maps = sorted((data / "acdc" / "training").glob("*/*_gt.nii.gz"))
    assert len(maps) == 200
    segs = [read_segmentation(path, preset="acdc") for path in maps]
    for parts in (("lv",), ("lv", "myo")):
        assert not any(seg.object(*parts).report["tips"] for seg in segs)
    voxels = [seg.object("rv").report["tip_voxels"] for seg in segs]
    assert (np.count_nonzero(voxels), sum(voxels), max(voxels)) == (62, 361, 24)


def test_noise_takes_no_longer_than_its_voxels():
    """Each of its thousands of specks was grown over the whole slice: 26 s for a map of 216 x 256 x 10."""
    mask = np.random.default_rng(1).random((256, 256, 6)) < 0.12
    mask[100:150, 100:150] = True
    start = time.process_time()
    tips, count = thin_tips(mask, 2)
    assert time.process_time() - start < 2.0
    assert bool(count) == bool(tips.any())
