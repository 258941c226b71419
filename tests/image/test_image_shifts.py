"""Breath-hold shifts: estimated from labels, corrected by whole pixels and offsets of the grid."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from femprep.errors import InputError
from femprep.image import (
    Grid,
    SliceShifts,
    boundary_points,
    isotropic,
    write_segmentation,
)
from femprep.image.reading.reader import read_segmentation
from femprep.phantoms import biventricular, lv_ellipsoid, rv_bent
from femprep.surface.alignment import align_slices, estimate_shifts
from femprep.surface.measure.sections import label_contours

SPACING = (1.44, 1.44, 8.0)


def shifted(phantom, seed, share=1.0):
    """A phantom's label map with slices moved by 1 to 4 mm, and how far."""
    grid = phantom.grid(SPACING, margin=(6, 6, 1))
    rng = np.random.default_rng(seed)
    count = grid.shape[2]
    angle, length = rng.uniform(0, 2 * np.pi, count), rng.uniform(1.0, 4.0, count) * (rng.random(count) < share)
    shifts = length[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return phantom.segmentation(grid=grid, shifts=shifts), shifts


def shapeless(shift, index):
    """Without constant and slope, which make another heart of the same shape."""
    line = np.column_stack([np.ones(len(index)), index])
    return shift - line @ np.linalg.lstsq(line, shift, rcond=None)[0]


@pytest.mark.parametrize("seed", range(3))
def test_known_shifts_of_a_bent_heart_are_found(seed):
    seg, shifts = shifted(biventricular(), seed)
    found = estimate_shifts(seg)
    before = shapeless(shifts[found.index], found.index)
    after = shapeless(shifts[found.index] - found.shift, found.index)
    assert found.evidence > 20.0
    assert np.sqrt((after**2).sum(axis=1).mean()) < 0.25 * np.sqrt((before**2).sum(axis=1).mean())
    assert found.zigzag[1] < 0.5 * found.zigzag[0]


@pytest.mark.parametrize("phantom", [biventricular(), lv_ellipsoid(), rv_bent()])
def test_nothing_is_done_to_a_heart_that_is_merely_bent(phantom):
    seg = phantom.segmentation(SPACING)
    found = estimate_shifts(seg)
    assert not found.shift.any()
    same = align_slices(seg)
    np.testing.assert_array_equal(same.labels, seg.labels)
    assert same.grid is seg.grid
    assert "no slice was moved" in same.info["slice_shifts"]["notices"][0]["what"]


def test_one_slice_alone_is_moved_back():
    phantom = biventricular()
    grid = phantom.grid(SPACING, margin=(6, 6, 1))
    shifts = np.zeros((grid.shape[2], 2))
    shifts[5] = (4.0, -3.0)
    found = estimate_shifts(phantom.segmentation(grid=grid, shifts=shifts))
    row = int(np.flatnonzero(found.index == 5)[0])
    np.testing.assert_allclose(found.shift[row], [4.0, -3.0], atol=0.3)
    assert np.abs(np.delete(found.shift, row, axis=0)).max() < 0.3


def test_a_stack_of_few_slices_is_left_alone():
    seg = lv_ellipsoid().segmentation((1.44, 1.44, 20.0))
    seg = replace(seg, labels=np.where(np.arange(seg.labels.shape[2]) < 4, seg.labels, 0))
    assert len(estimate_shifts(seg).index) == 0
    assert not align_slices(seg).info["slice_shifts"]["slices"]


def test_every_contour_moves_by_exactly_its_slices_shift():
    seg = biventricular().segmentation(SPACING)
    slices = np.arange(seg.grid.shape[2])
    shift = np.random.default_rng(3).uniform(-5.0, 5.0, (len(slices), 2))
    shift[3] = 0.0
    known = SliceShifts(2, slices, shift, np.zeros(len(slices)), 99.0, (9.0, 0.0), ("lv",))
    moved = align_slices(seg, known)
    for name in ("lv", "myo", "rv"):
        numbers = np.flatnonzero(seg.mask(name).any(axis=(0, 1)))
        for k, before, after in zip(numbers, *(label_contours(s.object(name))[1] for s in (seg, moved))):
            back = np.append(shift[k], 0.0)
            for one, other in zip(before, after, strict=True):
                np.testing.assert_allclose(other, one - back, atol=1e-9)
    lateral = [p.points[p.axis < 2] for p in (boundary_points(s.object("lv")) for s in (seg, moved))]
    assert len(lateral[0]) == len(lateral[1])


def test_labels_moved_beyond_the_border_are_not_lost():
    seg = lv_ellipsoid().segmentation(SPACING, margin=(0, 0, 0))
    slices = np.arange(seg.grid.shape[2])
    known = SliceShifts(2, slices, np.full((len(slices), 2), 11.0), np.zeros(len(slices)), 99.0, (9.0, 0.0), ("lv",))
    moved = align_slices(seg, known)
    assert [int((moved.labels == n).sum()) for n in (2, 3)] == [int((seg.labels == n).sum()) for n in (2, 3)]
    np.testing.assert_allclose(
        moved.object("lv").barycentre, seg.object("lv").barycentre - [11.0, 11.0, 0.0], atol=1e-9
    )


def test_grids_with_offsets():
    rng = np.random.default_rng(0)
    offsets = np.column_stack([rng.uniform(-0.7, 0.7, (6, 2)), np.zeros(6)])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    grid = Grid((9, 8, 6), (1.4, 1.3, 8.0), (5.0, -3.0, 2.0), turn, offsets)
    index = rng.uniform(-2.0, 10.0, (50, 3))
    np.testing.assert_allclose(grid.to_index(grid.to_world(index)), index, atol=1e-12)
    part = grid.window((2, -1, -2), (4, 5, 9))
    np.testing.assert_allclose(part.to_world(index), grid.to_world(index + np.array([2, -1, -2])), atol=1e-9)
    at = np.array([[1.0, 2.0, 3.0]])
    np.testing.assert_allclose(grid.to_world(at) - grid.regular.to_world(at), [turn @ offsets[3]], atol=1e-12)
    with pytest.raises(InputError, match="along the stack"):
        Grid((9, 8, 6), (1.4, 1.3, 8.0), (0.0, 0.0, 0.0), np.eye(3), np.ones((6, 3)))


def test_isotropic_voxels_and_barycentre_honour_offsets():
    seg = lv_ellipsoid().segmentation(SPACING)
    slices = np.arange(seg.grid.shape[2])
    shift = 0.7 * np.column_stack([np.where(slices % 2, 1.0, -1.0), np.zeros(len(slices))])
    known = SliceShifts(2, slices, shift, np.zeros(len(slices)), 99.0, (9.0, 0.0), ("lv",))
    obj = align_slices(seg, known).object("lv")
    np.testing.assert_allclose(obj.barycentre, obj.grid.to_world(np.argwhere(obj.mask)).mean(axis=0), atol=1e-9)
    even = isotropic(obj, 0.5)
    for k in (4, 5):
        contour = np.concatenate(label_contours(obj)[1][k])
        level = round(even.grid.to_index(contour[:1])[0, 2])
        middle = np.argwhere(even.mask[:, :, level]).mean(axis=0)
        wanted = np.argwhere(obj.mask[:, :, np.flatnonzero(obj.mask.any(axis=(0, 1)))[k]]).mean(axis=0)
        number = np.flatnonzero(obj.mask.any(axis=(0, 1)))[k]
        world = obj.grid.to_world([[*wanted, number]])[0]
        np.testing.assert_allclose(even.grid.to_world([[*middle, level]])[0, :2], world[:2], atol=0.15)


@pytest.mark.slow
def test_the_command_line_corrects_and_records(tmp_path):
    from femprep.cli import main

    seg, _ = shifted(lv_ellipsoid(), 1)
    write_segmentation(seg, tmp_path / "heart.nii.gz")
    call = ["surface", str(tmp_path / "heart.nii.gz"), "--preset", "acdc", "--object", "lv=lv", "--vertices", "1000"]
    assert main([*call, "--correct-shifts", "--quiet", "-o", str(tmp_path / "out")]) == 0
    run = json.loads((tmp_path / "out" / "run.json").read_text())
    assert run["options"]["image"]["correct_shifts"] is True
    record = run["input"]["notes"]["slice_shifts"]
    expected = estimate_shifts(read_segmentation(tmp_path / "heart.nii.gz", preset="acdc"))
    assert [row["slice"] for row in record["slices"]] == expected.index.tolist()
    assert [row["shift"] for row in record["slices"]] == expected.shift.tolist()
    assert any("breath-hold shifts of up to" in line for line in run["notices"])


def test_shifts_of_real_hearts(data):
    """A CT heart has none; a map with slices that jump by more than a centimetre becomes smooth."""
    folder = data / "rodero01"
    still = read_segmentation(folder / "rodero01_sax_vent_1.5x1.5x10_label.nii.gz", preset="acdc")
    assert not estimate_shifts(still).shift.any()
    name = "patient014_frame01_gt.nii.gz"
    jumping = read_segmentation(data / "acdc" / "training" / "patient014" / name, preset="acdc")
    moved = align_slices(jumping)
    assert jumping.slices("lv").zigzag.max() > 20.0
    assert moved.slices("lv").zigzag.max() < 5.0
