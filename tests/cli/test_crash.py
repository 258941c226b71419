"""Whatever nobody foresaw ends in status 3, one line and a file to send; nothing half made is left."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import femprep as fp
from femprep.cli import main
from femprep.phantoms import lv_ellipsoid

ONE_LINE = "femprep: error: "


@pytest.fixture
def heart(tmp_path: Path) -> Path:
    path = tmp_path / "heart.nii.gz"
    fp.write_segmentation(lv_ellipsoid().segmentation(spacing=(3.0, 3.0, 10.0)), path)
    return path


@pytest.fixture
def fails(
    heart: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[[Callable[[], None]], tuple[int, str, list[Path]]]:
    """Let a stage in the middle of a run do something; status, what was said, and files in the working folder."""

    def go(what: Callable[[], None]) -> tuple[int, str, list[Path]]:
        def stage(*_: object, **__: object) -> None:
            what()

        work = tmp_path / "work"
        work.mkdir()
        monkeypatch.chdir(work)
        monkeypatch.setattr("femprep.pipeline.lay_out", stage)
        status = main(["mesh", str(heart), "-o", "made/out", "--preset", "acdc", "--mesher", "sweep"])
        return status, capsys.readouterr().err, sorted(work.iterdir())

    return go


def raising(error: BaseException) -> Callable[[], None]:
    def fail() -> None:
        raise error

    return fail


def recursing() -> None:
    recursing()


@pytest.mark.parametrize(
    ("what", "name"),
    [
        (raising(ValueError("zero-size array\nto reduction operation")), "ValueError"),
        (raising(ZeroDivisionError()), "ZeroDivisionError"),
        (raising(OSError(5, "Input/output error")), "OSError"),
        (raising(SystemExit(1)), "SystemExit"),  # what libraries do
        (recursing, "RecursionError"),
    ],
)
def test_unforeseen(fails: Callable[..., tuple[int, str, list[Path]]], what: Callable[[], None], name: str) -> None:
    status, said, left = fails(what)
    assert status == 3
    assert said.count("\n") == 1
    assert said.startswith(f"{ONE_LINE}{name}: ")
    assert [path.name[:14] for path in left] == ["femprep-crash-"]
    assert repr(str(left[0])) in said


def test_what_the_file_tells(fails: Callable[..., tuple[int, str, list[Path]]], heart: Path) -> None:
    text = fails(raising(ValueError("zero-size array")))[2][0].read_text()
    told = ["Traceback (most recent call last)", "ValueError: zero-size array", "'--mesher' 'sweep'", "numpy "]
    told += [f"femprep {fp.__version__}", hashlib.sha256(heart.read_bytes()).hexdigest(), heart.name]
    assert [words for words in told if words not in text] == []


def test_memory_that_ran_out_is_foreseen(fails: Callable[..., tuple[int, str, list[Path]]]) -> None:
    status, said, left = fails(lambda: np.empty((2**20, 2**25)))
    assert status == 3
    assert said.count("\n") == 1
    assert "memory ran out" in said
    assert "edge length" in said
    assert left == []


def test_working_folder_that_cannot_be_written(
    heart: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    work, other = tmp_path / "gone", tmp_path / "other"
    work.mkdir()
    other.mkdir()
    monkeypatch.chdir(work)
    monkeypatch.setattr("tempfile.tempdir", str(other))
    monkeypatch.setattr("femprep.pipeline.lay_out", lambda *_: work.rmdir() or 1 / 0)
    assert main(["mesh", str(heart), "-o", str(tmp_path / "out"), "--preset", "acdc", "--mesher", "sweep"]) == 3
    assert repr(str(next(other.iterdir()))) in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_warnings_of_libraries_stay_off_the_screen(
    fails: Callable[..., tuple[int, str, list[Path]]], tmp_path: Path
) -> None:
    def warn() -> None:
        warnings.warn("overflow", RuntimeWarning, stacklevel=1)
        raise fp.InputError("the reason")

    status, said, _ = fails(warn)
    assert (status, said) == (2, f"{ONE_LINE}the reason\n")


def test_control_characters_of_a_name_are_shown_not_sent(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "a\x1b[2Jb.vtu"]) == 2
    said = capsys.readouterr().err
    assert "\x1b" not in said
    assert "\\x1b[2Jb.vtu" in said


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no full device")
def test_output_that_cannot_be_printed(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "femprep", "schema", "--where"]
    with open("/dev/full", "w") as full:
        ended = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, env=os.environ, check=False)
    assert ended.returncode == 3
    assert ended.stderr.count("\n") == 1
    assert "no room" in ended.stderr


@pytest.mark.parametrize("option", ["--template", "--sizing", "--config", "--out"])
def test_names_that_the_system_refuses(
    option: str, heart: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments = ["mesh", str(heart), "-o", "out", "--preset", "acdc", option, "a" * 5000]
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == [heart.name]


def test_a_shell_that_completes_words_is_answered(tmp_path: Path) -> None:
    words = {"_FEMPREP_COMPLETE": "complete_bash", "COMP_WORDS": "femprep me", "COMP_CWORD": "1"}
    ended = subprocess.run(
        [sys.executable, "-m", "femprep"], env={**os.environ, **words}, capture_output=True, text=True, cwd=tmp_path
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    assert "mesh" in ended.stdout
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_reader_that_has_gone_is_no_error(tmp_path: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    ended = subprocess.run(
        [sys.executable, "-m", "femprep", "mesh", "--help"],
        stdout=write,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
    )
    os.close(write)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert list(tmp_path.iterdir()) == []
