"""What a command writes beside its own output, and its output, take the place of no input."""

from __future__ import annotations

from pathlib import Path

import pytest
from meshes import truncated_ellipsoid

from femprep.cli import main
from femprep.cli._apart import require_unnamed
from femprep.errors import OptionError
from femprep.export import write_mesh


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    write_mesh(truncated_ellipsoid(heights=2, around=6, layers=1), tmp_path / "lv.vtu")
    (tmp_path / "link.vtu").symlink_to("lv.vtu")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    "words",
    [
        ["check", "lv.vtu", "-q", "--log", "lv.vtu"],
        ["check", "lv.vtu", "-q", "--log=./lv.vtu"],
        ["check", "lv.vtu", "-q", "--log", "link.vtu"],
        ["convert", "lv.vtu", "x.inp", "--log", "lv.vtu"],
        ["convert", "lv.vtu", "x.inp", "--log", "x.inp"],
        ["check", "lv.vtu", "--html", "x.html", "--log", "x.html"],
        ["mesh", "--surface", "lv=lv.vtu", "-o", "out", "--log", "lv.vtu"],
        ["mesh", "a.nii", "--image", "lv.vtu:2", "-oout", "--log", "lv.vtu"],
        ["mesh", "a.nii", "-oout", "--log", "out"],
        ["check", "lv.vtu", "-q", "--html", "lv.vtu"],
        ["check", "lv.vtu", "-q", "--html", "link.vtu"],
        ["transfer", "lv.vtu", "other.vtu", "--field", "region", "-o", "lv.vtu"],
    ],
)
def test_a_file_that_the_command_names_is_not_written_over(
    words: list[str], here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before, names = (here / "lv.vtu").read_bytes(), {path.name for path in here.iterdir()}
    assert main(words) == 2
    assert "choose another" in capsys.readouterr().err
    assert (here / "lv.vtu").read_bytes() == before
    assert {path.name for path in here.iterdir()} == names


def test_a_log_of_its_own_is_written_again(here: Path) -> None:
    for _ in range(2):
        assert main(["check", "lv.vtu", "-q", "--log", "run.log"]) in (0, 1)
    assert (here / "run.log").read_text().count("command:") == 1


def test_words_that_are_no_files_are_passed_over(here: Path) -> None:
    require_unnamed(here / "run.log", "--log", ["lv.vtu", "--log", str(here / "run.log"), "a=\0", "=:", "-", ""])
    with pytest.raises(OptionError, match="names too"):
        require_unnamed(here / "run.log", "--log", [f"b=c={here / 'run.log'}:1"])


@pytest.mark.parametrize(
    "words", [["annotate", "out/mesh.vtu"], ["mesh", "--surface", "lv=out/mesh.vtu", "--surface", "epi=lv.vtu"]]
)
def test_a_run_s_own_files_are_no_input_of_the_next_in_its_folder(
    words: list[str], here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "out").mkdir()
    (here / "lv.vtu").rename(here / "out" / "mesh.vtu")
    (here / "out" / "run.json").write_text('{"files": ["mesh.vtu", "run.json"]}')
    assert main([*words, "-o", "out"]) == 2
    assert "'out/mesh.vtu' is a file of the run in 'out', which the new one would replace" in capsys.readouterr().err
    assert {path.name for path in (here / "out").iterdir()} == {"mesh.vtu", "run.json"}
