"""Slices left out: an end is cut off, one within the stack is drawn from its neighbours."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

import femprep as fp
from femprep.cli import main
from femprep.errors import InputError
from femprep.image.grid import Grid
from femprep.image.left_out import leave_out_slices
from femprep.image.segmentation import Segmentation
from femprep.phantoms import biventricular, lv_ellipsoid
from femprep.report.notices import lines


@pytest.fixture(scope="module")
def seg() -> Segmentation:
    return lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0))


def numbers(seg: Segmentation) -> list[int]:
    return [int(k) for k in seg.slices("lv", "myo").index]


def test_an_end_is_cut_off(seg: Segmentation) -> None:
    first, *_, last = numbers(seg)
    found = leave_out_slices(seg, [first, last])
    assert numbers(found) == numbers(seg)[1:-1]
    kept = slice(first + 1, last)
    assert np.array_equal(found.labels[:, :, kept], seg.labels[:, :, kept])
    record = found.info["left_out"]
    assert (record["slices"], record["drawn_anew"]) == ([first, last], [])
    assert lines(found.info) == [f"labels of slices {first}, {last} were left out, as was asked for"]


@pytest.mark.parametrize("count", [1, 2])
def test_one_within_the_stack_is_drawn_from_its_neighbours(seg: Segmentation, count: int) -> None:
    """Between slices of cones that are alike it is nearly what was there."""
    middle = numbers(seg)[4 : 4 + count]
    wrong = np.array(seg.labels)
    for k in middle:
        wrong[:, :, k] = np.roll(wrong[:, :, k], 12, axis=0)
    spoiled = Segmentation(wrong, seg.grid, seg.structures, seg.info)
    found = leave_out_slices(spoiled, middle)
    assert found.info["left_out"]["drawn_anew"] == middle
    for k in middle:
        own, drawn = (np.isin(one.labels[:, :, k], seg.numbers("lv", "myo")) for one in (seg, found))
        shared = 2.0 * (own & drawn).sum() / (own.sum() + drawn.sum())
        assert shared > 0.97
        # Cavity and wall meet without a gap.
        assert set(np.unique(found.labels[:, :, k])) == set(np.unique(seg.labels[:, :, k]))


def test_a_stack_along_another_axis_is_the_same(seg: Segmentation) -> None:
    order = [2, 0, 1]
    grid = Grid(
        tuple(seg.labels.shape[a] for a in order),
        seg.grid.spacing[order],
        seg.grid.origin,
        seg.grid.direction[:, order],
    )
    turned = Segmentation(np.transpose(seg.labels, order), grid, seg.structures)
    out = [numbers(seg)[3], numbers(seg)[-1]]
    found = leave_out_slices(turned, out)
    assert np.array_equal(found.labels, np.transpose(leave_out_slices(seg, out).labels, order))


def test_what_one_neighbour_has_alone_ends_between_them() -> None:
    seg = biventricular().segmentation(spacing=(1.4, 1.4, 8.0))
    last = int(seg.slices("rv").index[0])  # the apex lies in the first slices
    assert last > numbers(seg)[0]
    found = leave_out_slices(seg, [last, last + 1])
    area = [int((found.labels[:, :, k] == seg.structures["rv"][0]).sum()) for k in range(last - 1, last + 3)]
    assert area[0] == 0 < area[3]
    assert area == sorted(area)
    assert all((found.labels[:, :, k] == seg.structures["myo"][0]).any() for k in (last, last + 1))


@pytest.mark.parametrize(
    ("slices", "words"),
    [
        ([99], r"slice 99 cannot be left out: the slices are 0 to \d+"),
        ([-1], r"slice -1 cannot be left out"),
    ],
)
def test_what_cannot_be_left_out_is_refused(seg: Segmentation, slices: list[int], words: str) -> None:
    with pytest.raises(InputError, match=words):
        leave_out_slices(seg, slices)


def test_a_slice_without_labels_is_no_error(seg: Segmentation) -> None:
    """Of the phases of a heart the smaller one may have none there."""
    beyond = numbers(seg)[-1] + 1
    assert beyond < seg.labels.shape[2]
    found = leave_out_slices(seg, [beyond])
    assert np.array_equal(found.labels, seg.labels)
    assert lines(found.info) == [f"no labels were to be left out in slice {beyond}"]


def test_two_slices_have_to_be_left(seg: Segmentation) -> None:
    with pytest.raises(InputError, match=re.escape("two have to be left")):
        leave_out_slices(seg, numbers(seg)[1:])


@pytest.mark.slow
@pytest.mark.parametrize("command", ["mesh", "surface"])
def test_by_the_command_line(seg: Segmentation, tmp_path, command: str) -> None:
    fp.write_segmentation(seg, tmp_path / "labels.nii.gz")
    given = [str(tmp_path / "labels.nii.gz"), "--structure", "lv=3", "--structure", "myo=2", "--vertices", "300"]
    given += [] if command == "surface" else ["--edge-length", "5", "--mesher", "sweep"]
    middle, last = numbers(seg)[3], numbers(seg)[-1]
    out = ["--leave-out", str(middle), "--leave-out", str(last)]
    assert main([command, *given, *out, "-q", "-o", str(tmp_path / "out")]) == 0
    text = (tmp_path / "out" / "run.json").read_text()
    assert f"labels of slices {middle}, {last} were left out" in text
    assert f"slice {middle}, within the stack, drawn from" in text
    assert json.loads(text)["options"]["image"]["leave_out"] == [middle, last]
    methods = (tmp_path / "out" / "methods.md").read_text().replace("\n", " ")
    assert f"Labels of slices {middle} and {last} were left out" in methods
    assert "[@raya1990]" in methods
    assert main([command, *given, "--leave-out", "90", "-q", "-o", str(tmp_path / "no")]) == 2
    assert not (tmp_path / "no").exists()


@pytest.mark.parametrize("wrong", [[1.7], "12", [np.nan], ["a"], [[1], [2, 3]]])
def test_what_is_no_number_of_a_slice_is_refused(seg: Segmentation, wrong) -> None:
    """A fraction was cut, and a word was taken letter by letter."""
    with pytest.raises(InputError, match=r"^slices (holds|is no array)"):
        leave_out_slices(seg, wrong)
    assert leave_out_slices(seg, iter([2.0])).info["left_out"]["slices"] == [2]
