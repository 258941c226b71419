"""What the folder of a sequence is made of: names of phases, what is said of several; bad input leaves no folder."""

from __future__ import annotations

from pathlib import Path

import pytest
from greys import cine

import femprep as fp
from femprep.phantoms import lv_ellipsoid
from femprep.report.run import SequenceRun
from femprep.report.sequence_output import _of_phases, phase_names


def test_images_are_as_many_as_phases(tmp_path: Path) -> None:
    seg = lv_ellipsoid().segmentation(spacing=(3.0, 3.0, 10.0))
    # None of the runs is looked at before.
    two = SequenceRun((None, None), (0.0, 1.0), 0, {})  # type: ignore[arg-type]
    with pytest.raises(fp.InputError, match="1 images given for 2 phases"):
        fp.write_sequence(two, tmp_path / "out", images=[cine(seg)])
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("paths", "names"),
    [
        (["a/ed.nii.gz", "a/es.nii.gz"], ["ed", "es"]),
        (["a/gt.nii", "b/gt.nii"], ["000_gt", "001_gt"]),
        (["a/ed.nii", None], ["000_ed", "001"]),
    ],
)
def test_phases_are_named_by_their_files_or_numbered(paths: list[str | None], names: list[str]) -> None:
    assert phase_names([None if path is None else Path(path) for path in paths]) == names


def test_what_is_said_of_every_phase_is_said_once() -> None:
    told = {"ed": ["apex extrapolated", "base moved"], "es": ["apex extrapolated"]}
    assert _of_phases(told) == ["apex extrapolated", "ed: base moved"]
