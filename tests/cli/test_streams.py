"""Standard streams that are closed, or that cannot show every character, and a working folder that has gone."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from meshes import truncated_ellipsoid
from numba.core import event

import femprep as fp
from femprep.cli import main
from femprep.cli._progress import bars

pytestmark = pytest.mark.skipif(os.name != "posix", reason="by a shell")


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("streams") / "mesh.vtu"
    fp.write_mesh(truncated_ellipsoid("hexahedron"), path)
    return path


def shell(words: str, folder: Path, **environment: str) -> subprocess.CompletedProcess[bytes]:
    """What a command line of a shell gives; ``femprep`` is the one under test."""
    command = f'femprep() {{ "{sys.executable}" -m femprep "$@"; }}; {words}'
    return subprocess.run(["bash", "-c", command], cwd=folder, env={**os.environ, **environment}, capture_output=True)


def test_closed_streams_take_what_is_written(mesh: Path, tmp_path: Path) -> None:
    ended = shell(f"femprep convert {mesh} out.inp <&- >&- 2>&-", tmp_path)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, b"", b"")
    assert [path.name for path in tmp_path.iterdir()] == ["out.inp"]
    assert (tmp_path / "out.inp").read_bytes().startswith(b"*")


def test_what_is_said_with_standard_error_closed_does_not_go_among_the_output(tmp_path: Path) -> None:
    ended = shell("femprep check none.vtu 2>&-", tmp_path)
    assert (ended.returncode, ended.stdout, ended.stderr) == (2, b"", b"")


def test_a_report_is_whole_where_the_output_is_not_in_utf_8(mesh: Path, tmp_path: Path) -> None:
    ended = shell(f"femprep check {mesh}", tmp_path, PYTHONIOENCODING="latin-1", COLUMNS="80")
    assert ended.stderr == b""
    assert b"limits: " in ended.stdout
    assert b"@" in ended.stdout, "the bars of the histograms"
    assert b"?" not in ended.stdout
    assert not list(tmp_path.iterdir())


def test_bytes_of_a_name_that_are_no_text_are_shown_as_they_are(mesh: Path, tmp_path: Path) -> None:
    ended = shell(f"femprep convert {mesh} $'out\\xff.inp'", tmp_path, PYTHONIOENCODING="utf-8")
    assert (ended.returncode, ended.stdout.strip().split(b"/")[-1], ended.stderr) == (0, b"out\xff.inp", b"")


def test_a_working_folder_that_has_gone_is_one_line(
    mesh: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert main(["convert", str(mesh), "out.inp"]) == 2
    assert capsys.readouterr().err.startswith("femprep: error: the working folder cannot be used: No such file")
    assert main(["--help"]) == 0


def test_the_progress_line_says_that_kernels_are_compiled(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("rich.console.Console.is_terminal", True)
    with bars(quiet=False) as report:
        report("surfaces", 0.0)
        with event.trigger_event("numba:compile"), event.trigger_event("numba:compile"):
            pass
        report("surfaces", 1.0)
    lines = capsys.readouterr().err.split("\r")
    assert any("compiling" in line for line in lines)
    assert "compiling" not in lines[-1]
