"""What an error advises can be followed, and leads on; what other options rule out is not advised."""

from __future__ import annotations

from pathlib import Path

import pytest
from advice_cases import Case, cases, followed, heart_map

import femprep as fp
from femprep.cli import main
from femprep.errors import Advice, InputError
from femprep.options import Options
from femprep.options.advice import GIVE_BASE, GIVEN_SURFACES, MEND, SEQUENCE, SHIFTS, changed, followable
from femprep.options.run import LEFT_ALONE, SWEEP, TETWILD

SWEPT = {"mesher": "sweep"}


@pytest.mark.parametrize(
    "case", [pytest.param(one, marks=[pytest.mark.slow] * one.slow, id=one.name) for one in cases()]
)
def test_each_advice_of_a_refusal_leads_to_a_mesh(case: Case) -> None:
    found = list(followed(case))
    assert found
    assert {one.outcome for one in found} <= {"meshed", "meshed, a check failed"}, found


@pytest.mark.parametrize(
    ("options", "fixed", "advice", "left"),
    [
        ({"image": {"correct_shifts": True}}, {}, SHIFTS, None),
        ({}, GIVEN_SURFACES, SHIFTS, None),
        ({}, {}, SHIFTS, SHIFTS.words),
        ({}, {}, GIVE_BASE, GIVE_BASE.words),
        ({"wall": {"base": (0, 0, 0, 0, 0, 1)}}, {}, GIVE_BASE, "change --base"),
        ({}, GIVEN_SURFACES, MEND, "mend the surfaces there"),
        ({"volume": SWEPT}, SEQUENCE, TETWILD, "mesh each phase by itself, without --sequence"),
        ({"volume": SWEPT, "sweep": {"layers": 3}}, {}, TETWILD, "use --mesher tetwild, without --layers"),
        ({"volume": SWEPT, "sweep": {"columns": 12}}, {}, TETWILD, None),
        ({"anatomy": "biv"}, {}, SWEEP, None),
        ({"anatomy": "biv"}, {}, LEFT_ALONE, LEFT_ALONE.words),
    ],
)
def test_advice_is_what_can_be_followed(options: dict, fixed: dict, advice: Advice, left: str | None) -> None:
    found = followable([advice], Options(**options), fixed)
    assert [one.words for one in found] == ([] if left is None else [left])


def test_following_advice_keeps_the_other_options() -> None:
    options = Options(volume=SWEPT | {"edge_length": 3.0}, sweep={"layers": 3}, image={"leave_out": (2,)})
    tetrahedra = changed(options, TETWILD)
    assert (tetrahedra.volume.mesher, tetrahedra.volume.edge_length) == ("tetwild", 3.0)
    assert changed(options, Advice("", "image.leave_out", (5,))).image.leave_out == (2, 5)


def test_errors_end_in_their_advice() -> None:
    assert str(InputError("wrong", advice=["do this", MEND])) == "wrong; do this, or mend the labels there"
    assert str(InputError("wrong")) == "wrong"


@pytest.mark.parametrize(
    "words",
    [["--anatomy", "biv"], ["--quality", "best"], ["--mesher", "tetwild"], ["--blood-pool"]],
)
def test_a_sequence_is_not_sent_to_the_mesher_it_refuses(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    maps = [str(tmp_path / f"{number}.nii.gz") for number in range(2)]
    for path in maps:
        fp.write_segmentation(heart_map(), Path(path))
    given = ["mesh", *maps, "-o", str(tmp_path / "out"), "--preset", "acdc", "--quiet"]
    assert main([*given, "--sequence", *words]) == 2
    line = " ".join(capsys.readouterr().err.split())
    assert "--mesher tetwild" not in line.partition(";")[2]
    assert "without --sequence" in line
