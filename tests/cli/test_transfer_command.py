"""``femprep transfer`` on files, and how the command line names second images."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from second_images import ventricle

import femprep as fp
from femprep.cli import main
from femprep.cli._configuration import parse_samples, split_tissues
from femprep.errors import OptionError


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    source, target = tmp_path / "from.vtu", tmp_path / "to.vtu"
    fp.write_mesh(ventricle(size=3, layers=2), source)
    fp.write_mesh(replace(ventricle("hexahedron", 3, 2), cell_data={}), target)
    return source, target


def test_fields_come_with_their_errors_on_the_screen_and_in_a_record(
    files: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    source, target = files
    out = source.with_name("moved.vtu")
    assert main(["transfer", str(source), str(target), "--field", "fiber", "--field", "aha", "-o", str(out)]) == 0
    found = fp.read_mesh(out)
    np.testing.assert_allclose(np.linalg.norm(found.cell_data["fiber"], axis=1), 1.0, atol=1e-9)
    assert set(np.unique(found.cell_data["aha"])) <= set(range(1, 18))
    record = json.loads(source.with_name("moved.transfer.json").read_text())
    assert [one["name"] for one in record["fields"]] == ["fiber", "aha"]
    assert record["source"] == "from.vtu"
    assert len(record["target_sha256"]) == 64
    assert record["place_back_mean_mm"] < record["source_edge_mm"]
    shown = capsys.readouterr().out
    assert "There and back" in shown
    assert "fiber (elements)" in shown
    assert "moved.transfer.json" in shown


def test_missing_fields_and_coordinates_are_one_line_and_no_file(
    files: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    source, target = files
    out = source.with_name("moved.vtu")
    assert main(["transfer", str(source), str(target), "--field", "strain", "-o", str(out)]) == 2
    assert "the source has no field 'strain'" in capsys.readouterr().err
    mesh = fp.read_mesh(target)
    fp.write_mesh(replace(mesh, point_data={}), target)
    assert main(["transfer", str(source), str(target), "--field", "fiber", "-o", str(out)]) == 2
    assert "the target has no point data" in capsys.readouterr().err
    assert not out.exists()
    assert not out.with_name("moved.transfer.json").exists()


def test_tissues_stand_behind_the_file_of_the_regions(tmp_path: Path) -> None:
    files, tissues = split_tissues([Path("sax.nii.gz"), Path("scar=1"), Path("border=2,5")])
    assert files == [Path("sax.nii.gz")]
    assert tissues == {"scar": (1,), "border": (2, 5)}
    samples = parse_samples(["a/t1.nii.gz", "late=lge.nii.gz"])
    assert samples == {"t1": Path("a/t1.nii.gz"), "late": Path("lge.nii.gz")}
    with pytest.raises(OptionError, match="the name 't1'"):
        parse_samples(["t1.nii", "t1=other.nii"])
    with pytest.raises(OptionError, match="names no field"):
        parse_samples(["2021_t1.nii"])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["scar=1"], "--regions FILE"),
        (["--regions", "lge.nii.gz"], "--regions takes a label map and its tissues"),
        (["--regions", "lge.nii.gz", "scar=1", "--sequence"], "leave --sequence out"),
        (["--regions", "lge.nii.gz", "scar=1"], "no such file"),
    ],
)
def test_wrong_second_images_are_one_line(
    words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["mesh", "sax.nii.gz", "-o", str(tmp_path / "out"), "--preset", "acdc", *words]
    assert main(words) == 2
    shown = capsys.readouterr().err
    assert said in " ".join(shown.split())
    assert not (tmp_path / "out").exists()
