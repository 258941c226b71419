"""Base planes of phases: equal shares of the cavity left out, the phase that leaves out most as it is."""

from __future__ import annotations

import numpy as np
import pytest

import femprep as fp
from femprep.phantoms import lv_ellipsoid
from femprep.report.volumes import voxel_volume
from femprep.wall import find_base, phase_base_offsets

REST = {"endo": (25.0, 25.0, 60.0), "epi": (34.0, 34.0, 69.0), "base": 20.0}
CONTRACTED = {"endo": (18.0, 18.0, 54.0), "epi": (31.0, 31.0, 66.0), "base": 20.0}


def heart(shape: dict[str, object], opened: int = 0) -> fp.Segmentation:
    """A phantom's labels, with so many basal rings opened on one side."""
    seg = lv_ellipsoid(**shape).segmentation(spacing=(1.4, 1.4, 8.0), apex="uncapped")
    labels = np.array(seg.labels)
    myo = seg.mask("myo")
    filled = np.flatnonzero(seg.mask("lv").any(axis=(0, 1)))
    for slice_ in filled[::-1][:opened]:
        x, y = np.nonzero(myo[:, :, slice_])
        side = x > x.max() - 4
        labels[x[side], y[side], slice_] = 0
        side = (np.abs(y - y.mean()) < 4) & (x > x.mean())
        labels[x[side], y[side], slice_] = 0
    return fp.Segmentation(labels, seg.grid, seg.structures)


def share(seg: fp.Segmentation, offset: float) -> float:
    """Share of the labelled cavity above the base plane."""
    cavity = seg.object("lv", name="lv")
    return 1.0 - voxel_volume(cavity, [find_base(seg, base_offset=offset, basal_end="last")]) / cavity.volume


@pytest.mark.parametrize("opened", [(0, 0), (1, 0), (0, 1), (2, 0)])
def test_all_phases_leave_out_the_share_of_the_one_that_leaves_out_most(opened):
    phases = [heart(shape, number) for shape, number in zip((REST, CONTRACTED), opened)]
    own = [share(seg, 0.0) for seg in phases]
    offsets = phase_base_offsets(phases, basal_end="last")
    assert min(offsets) == 0.0
    assert offsets[int(np.argmax(own))] == 0.0
    found = [share(seg, offset) for seg, offset in zip(phases, offsets)]
    assert found == pytest.approx([max(own)] * 2, abs=1e-9)
    assert own[0] != pytest.approx(own[1], abs=1e-3)


def test_an_offset_asked_for_is_the_least():
    phases = [heart(REST), heart(CONTRACTED, 1)]
    offsets = phase_base_offsets(phases, basal_end="last", base_offset=5.0)
    assert min(offsets) == 5.0
    assert share(phases[0], offsets[0]) == pytest.approx(share(phases[1], offsets[1]), abs=1e-9)


def test_one_phase_is_cut_at_its_own_base():
    assert phase_base_offsets([heart(REST, 1)], basal_end="last") == [0.0]


def test_no_phases_have_no_offsets() -> None:
    with pytest.raises(fp.InputError, match="there are no phases"):
        phase_base_offsets([])
