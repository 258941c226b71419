"""A base near the end of labels in thin slices: surfaces round off there, so it lies further in, and that is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from wall_shapes import stack

import femprep as fp
from femprep.model import Plane
from femprep.phantoms import biventricular, lv_ellipsoid
from femprep.wall import find_base, find_common_base, phase_base_offsets

#: What the plane lies within the end of labels, mm.
CLEAR = 2.5


def end_of(seg: fp.Segmentation, name: str) -> float:
    """Height of the outer face of a structure's last slice, mm."""
    last = int(np.flatnonzero(seg.mask(name).any(axis=(0, 1)))[-1])
    return float(seg.grid.to_world([[0, 0, last + 0.5]])[0, 2])


def moved(base: Plane) -> list[float | None]:
    return [notice.amount for notice in base.notices if "surfaces round off there" in notice.what]


def opened(seg: fp.Segmentation, slices: int) -> fp.Segmentation:
    """The labels with myocardium missing on one side of so many basal slices, as beside a valve."""
    labels = np.array(seg.labels)
    last = int(np.flatnonzero(seg.mask("lv").any(axis=(0, 1)))[-1])
    half = labels[: len(labels) // 2, :, last - slices + 1 : last + 1]
    half[half == 2] = 0
    return replace(seg, labels=labels)


@pytest.mark.parametrize("height", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("find", [find_base, find_common_base])
def test_in_thin_slices_it_lies_within_the_end_of_the_labels(find, height) -> None:
    seg = biventricular().segmentation(spacing=(1.0, 1.0, height))
    base = find(seg)
    assert base.point[2] == pytest.approx(end_of(seg, "lv") - CLEAR)
    assert moved(base) == pytest.approx([CLEAR - 0.5 * height])
    assert base.source.endswith(f"; {CLEAR - 0.5 * height:.1f} mm further in")
    further = find(seg, base_offset=1.5)
    assert base.signed_distance(further.point[None])[0] == pytest.approx(-1.5)


@pytest.mark.parametrize("height", [4.9998, 5.0, 8.0])
def test_in_slices_of_five_millimetres_and_more_it_is_their_middle(height) -> None:
    seg = biventricular().segmentation(spacing=(1.0, 1.0, height))
    base = find_common_base(seg)
    assert base.point[2] == pytest.approx(end_of(seg, "lv") - 0.5 * height)
    assert moved(base) == []
    assert base.source.endswith("basal")


def test_a_stack_stored_from_the_base_on_is_cut_alike() -> None:
    seg = lv_ellipsoid().segmentation(spacing=(1.0, 1.0, 1.0))
    labels = np.array(seg.labels)[:, :, ::-1]
    base = find_base(replace(seg, labels=labels))
    first = int(np.flatnonzero((labels == 3).any(axis=(0, 1)))[0])
    assert seg.grid.to_index(base.point[None])[0, 2] == pytest.approx(first - 0.5 + CLEAR)


@pytest.mark.parametrize(("slices", "left"), [(0, [2.0]), (1, [1.0]), (2, []), (4, [])])
def test_where_labels_go_on_it_stays_in_the_last_ring(slices, left) -> None:
    """Each slice more that they go on in is one less to be moved by."""
    seg = lv_ellipsoid().segmentation(spacing=(1.0, 1.0, 1.0))
    base = find_base(opened(seg, slices) if slices else seg, basal_end="last")
    assert base.point[2] == pytest.approx(end_of(seg, "lv") - max(CLEAR, slices + 0.5))
    assert moved(base) == pytest.approx(left)


def test_it_lies_within_the_end_of_a_right_ventricle_that_ends_earlier() -> None:
    seg = biventricular().segmentation(spacing=(1.0, 1.0, 1.0))
    labels = np.array(seg.labels)
    last = int(np.flatnonzero((labels == 1).any(axis=(0, 1)))[-1])
    labels[:, :, last - 4 :][labels[:, :, last - 4 :] == 1] = 0
    short = replace(seg, labels=labels)
    assert end_of(short, "rv") == pytest.approx(end_of(short, "lv") - 5.0)
    assert find_common_base(short).point[2] == pytest.approx(end_of(short, "rv") - CLEAR)
    assert find_base(short).point[2] == pytest.approx(end_of(short, "lv") - CLEAR)


def test_phases_of_one_heart_leave_out_equal_shares_all_the_same() -> None:
    phases = [lv_ellipsoid(base=base).segmentation(spacing=(1.0, 1.0, 1.0)) for base in (20.0, 20.0)]
    assert phase_base_offsets(phases, basal_end="last") == pytest.approx([0.0, 0.0])
    deeper = [phases[0], opened(phases[1], 6)]
    offsets = phase_base_offsets(deeper, basal_end="last")
    bases = [find_base(seg, base_offset=own, basal_end="last") for seg, own in zip(deeper, offsets)]
    assert bases[0].point[2] == pytest.approx(bases[1].point[2])


def test_a_plane_that_was_given_stays() -> None:
    given = (0.0, 0.0, 19.8, 0.0, 0.0, 1.0)
    base = find_base(stack(list("ooooo")), base=given)
    assert base.point[2] == 19.8
    assert moved(base) == []


@pytest.mark.slow
def test_both_ventricles_on_fine_voxels_pass() -> None:
    """Cut in the last slice they left the labels by 2.7 pixels; on voxels of .5 mm the wall was refused."""
    run = fp.mesh_segmentation(biventricular().segmentation(spacing=(0.75,) * 3), anatomy="biv")
    assert run.quality.failures == ()
