"""An image under a label map: taken where the labels lay in the scanner, whatever its own grid and pose."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from greys import linear, world_value, write_image

import femprep as fp
from femprep.errors import InputError, OptionError
from femprep.image import Grid, SliceShifts
from femprep.image.underlay import greys, lay_under, read_under, window
from femprep.model.image_file import ImageFile, image_file
from femprep.phantoms import lv_ellipsoid
from femprep.surface.alignment import align_slices

TURN = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])


@pytest.fixture(scope="module")
def seg() -> fp.Segmentation:
    return lv_ellipsoid().moved(TURN, [12.0, -30.0, 50.0]).segmentation(spacing=(2.0, 2.0, 8.0))


def marked(seg: fp.Segmentation) -> np.ndarray:
    return np.argwhere(seg.labels > 0).astype(float)


def test_on_its_own_grid_nothing_is_interpolated(seg: fp.Segmentation) -> None:
    values = np.random.default_rng(0).normal(size=seg.labels.shape)
    under = lay_under(seg, fp.IntensityImage(values, seg.grid))
    assert under.same_grid
    assert under.covered == 1.0
    assert np.allclose(under.values(marked(seg)), values[seg.labels > 0])


def test_of_another_grid_and_pose_it_is_taken_at_the_same_place_of_the_world(seg: fp.Segmentation) -> None:
    other = Grid((150, 140, 160), (1.1, 1.3, 1.2), (130.0, 90.0, -60.0), np.diag([-1.0, -1.0, 1.0]))
    under = lay_under(seg, linear(other))
    assert not under.same_grid
    assert under.covered == 1.0
    index = marked(seg)
    assert np.allclose(under.values(index), world_value(seg.grid.to_world(index)), atol=1e-2)


def test_slices_that_were_moved_back_take_their_image_with_them(seg: fp.Segmentation) -> None:
    numbers = np.arange(seg.grid.shape[2])
    shift = np.where(numbers[:, None] % 2, [5.0, -3.0], [0.0, 0.0])
    found = SliceShifts(2, numbers, shift, np.ones(len(numbers)), 99.0, (5.0, 1.0), ("lv",))
    values = np.random.default_rng(1).normal(size=seg.labels.shape)
    moved = align_slices(seg, found)
    under = lay_under(moved, fp.IntensityImage(values, seg.grid))
    assert not under.same_grid
    # Voxel for voxel, in any order: every label has the value it had before.
    before = [values[..., k][seg.labels[..., k] > 0] for k in numbers]
    for k in numbers:
        here = np.argwhere(moved.labels[..., k] > 0)
        index = np.column_stack([here, np.full(len(here), k)]).astype(float)
        assert np.allclose(under.values(index), before[k], atol=1e-5), k


def test_what_lies_beyond_the_image_is_told(seg: fp.Segmentation) -> None:
    half = seg.grid.window((0, 0, 0), (seg.grid.shape[0] // 2, *seg.grid.shape[1:]))
    under = lay_under(seg, linear(half))
    inside = marked(seg)[:, 0] < half.shape[0] - 0.5
    assert under.covered == pytest.approx(inside.mean())
    assert np.array_equal(np.isfinite(under.values(marked(seg))), inside)


def test_what_lies_elsewhere_is_refused_in_one_line(seg: fp.Segmentation, tmp_path: Path) -> None:
    far = Grid(seg.grid.shape, seg.grid.spacing, seg.grid.origin + 900.0, seg.grid.direction)
    write_image(linear(far), tmp_path / "far.nii.gz")
    with pytest.raises(InputError, match=r"far\.nii\.gz' does not meet the labels: its middle is at") as told:
        read_under(seg, ImageFile(tmp_path / "far.nii.gz"), fp.Options())
    assert "\n" not in str(told.value)


def test_of_mirrored_labels_it_is_refused(seg: fp.Segmentation, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="mirror both files first"):
        lay_under(fp.flip(seg), linear(seg.grid))
    with pytest.raises(OptionError, match="mirror both files first"):
        read_under(seg, ImageFile(tmp_path / "any.nii.gz"), fp.Options(flip=True))


def test_voxel_sizes_given_for_the_labels_are_those_of_an_image_of_the_same_voxels(
    seg: fp.Segmentation, tmp_path: Path
) -> None:
    one = Grid(seg.grid.shape, np.ones(3), seg.grid.origin, seg.grid.direction)
    write_image(linear(one), tmp_path / "one.nii.gz")
    image = read_under(seg, ImageFile(tmp_path / "one.nii.gz"), fp.Options(image={"spacing": (2.0, 2.0, 8.0)}))
    assert lay_under(seg, image).same_grid
    assert "by the option spacing" in image.info["notices"][-1]["what"]


def test_file_and_frame() -> None:
    assert image_file("a:b.nii.gz") == ImageFile(Path("a:b.nii.gz"))
    assert image_file("b.nii.gz:3", Path("/data")) == ImageFile(Path("/data/b.nii.gz"), 3)
    assert image_file(":3") == ImageFile(Path(":3"))


def test_black_and_white() -> None:
    values = np.append(np.linspace(0.0, 100.0, 1001), [np.nan, 1e6])
    low, high = window(values)
    assert (low, high) == pytest.approx((1.0, 99.0), abs=0.2)
    assert greys(np.array([-5.0, 50.0, 1e6, np.nan]), (0.0, 100.0)).tolist() == [0, 127, 255, 255]
    assert window(np.full(3, np.nan)) == (0.0, 1.0)
