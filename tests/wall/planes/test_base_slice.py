"""One bad slice in the middle of a stack does not make a heart of its tip: the base stays, or is refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from wall_shapes import stack

import femprep as fp
from femprep.errors import InputError
from femprep.model import Plane

MYOCARDIUM, CAVITY = 2, 3
#: The slice that is damaged in a stack of ten whose first one is basal.
BAD = 4


def slice_of(seg: fp.Segmentation, plane: Plane) -> float:
    return float(seg.grid.to_index(plane.point[None])[0, 2])


def damaged(change: Callable[[Any], None], sound: str = "oooooooooo") -> fp.Segmentation:
    """A stack with one slice changed."""
    whole = stack(list(sound))
    labels = np.array(whole.labels)
    change(labels[:, :, BAD])
    return replace(whole, labels=labels)


def pinned(labels: Any) -> None:
    labels[32, 32] = 0


def pinned_wall(labels: Any) -> None:
    row = int(np.flatnonzero(labels[32] == CAVITY)[-1]) + 1  # the first voxel of the wall
    labels[32, row] = 0


def stray(labels: Any) -> None:
    labels[1, 1] = CAVITY


def ring_cut(labels: Any) -> None:
    labels[32:34, :32] *= labels[32:34, :32] != MYOCARDIUM


def swapped(labels: Any) -> None:
    labels[:] = np.choose(labels, [0, 1, CAVITY, MYOCARDIUM])


@pytest.mark.parametrize("change", [pinned, pinned_wall, stray])
def test_holes_and_strays_that_the_objects_are_rid_of_open_no_ring(change: Callable[[Any], None]) -> None:
    seg = damaged(change)
    base = fp.find_base(seg)
    assert slice_of(seg, base) == pytest.approx(0.0)
    assert not base.notices


def test_a_ring_that_is_open_between_closed_ones_does_not_end_the_heart() -> None:
    seg = damaged(ring_cut)
    base = fp.find_base(seg)
    assert slice_of(seg, base) == pytest.approx(0.0)
    (notice,) = base.notices
    assert (notice.kind, notice.unit) == ("assumed", "%")
    assert notice.what.startswith(f"the myocardium is open in slice {BAD}, between others in which it closes, by up to")
    assert f"--leave-out {BAD}" in notice.what
    assert notice.amount == pytest.approx(5.0, abs=3.0)
    assert not fp.find_base(fp.leave_out_slices(seg, [BAD])).notices, "the advice"


def test_a_slice_that_gapes_is_refused_where_most_of_the_cavity_lies_beyond_it() -> None:
    seg = damaged(swapped)
    with pytest.raises(
        InputError,
        match=rf"^\d\d % of the left cavity would lie beyond the base.*in slice {BAD}, near .*--leave-out {BAD}",
    ):
        fp.find_base(seg)
    mended = fp.leave_out_slices(seg, [BAD])
    assert slice_of(mended, fp.find_base(mended)) == pytest.approx(0.0), "the advice"


def test_a_heart_whose_rings_close_at_the_tip_alone_is_refused_without_leaving_a_slice_out() -> None:
    seg = stack(list("cccccccooo"))
    with pytest.raises(InputError, match=r"in slice 6, near .*mend the labels there, or .*--base") as caught:
        fp.find_base(seg)
    assert "--leave-out" not in str(caught.value)


def test_much_beyond_the_base_is_told() -> None:
    seg = stack(list("ccoooooooo"))
    (notice,) = fp.find_base(seg).notices
    voxels = np.count_nonzero(seg.labels == CAVITY, axis=(0, 1))
    assert notice.amount == pytest.approx(100.0 * voxels[:2].sum() / voxels.sum())
    assert (notice.kind, notice.unit) == ("left out", "%")
    assert not fp.find_base(stack(list("cooooooooo"))).notices


def test_of_thin_slices_one_that_is_open_ends_the_run_which_is_told_without_its_number() -> None:
    whole = stack(list("o" * 40), spacing=(1.5, 1.5, 1.5), radii=np.linspace(24.0, 8.0, 40))
    labels = np.array(whole.labels)
    ring_cut(labels[:, :, 14])
    with pytest.raises(InputError, match=r"closes? around it near .*give --basal-end") as caught:
        fp.find_base(replace(whole, labels=labels), basal_end="first")
    assert "slice 14" not in str(caught.value)


def test_one_voxel_without_a_label_moves_no_base_of_a_patient(data: Path) -> None:
    """It took more than a quarter of the heart away in 24 of 25 where it was near the base."""
    for number in range(1, 101, 20):
        (path,) = data.glob(f"acdc/training/patient{number:03d}/*frame01_gt.nii.gz")
        seg = fp.read_segmentation(path, preset="acdc")
        base, slices = fp.find_base(seg), seg.slices("lv").index
        for slice_ in slices[1:-1]:
            labels = np.array(seg.labels)
            inside = np.argwhere(labels[:, :, slice_] == CAVITY)
            labels[(*inside[len(inside) // 2], slice_)] = 0
            found = fp.find_base(replace(seg, labels=labels))
            assert found.point == pytest.approx(base.point, abs=1e-9), (path.name, slice_)
