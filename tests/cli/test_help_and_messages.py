"""What the command line says: help that fits, what was meant, messages and log, completion, tables of any width."""

from __future__ import annotations

import logging
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from rich.console import Console

from femprep.cli import main
from femprep.cli._app import COMMANDS, load
from femprep.cli._summary import print_methods
from femprep.cli._tables import print_table


@pytest.mark.parametrize("command", COMMANDS)
def test_no_help_is_cut_off_at_80_columns(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert main([command, "--help"]) == 0
    text = capsys.readouterr().out
    assert "…" not in text
    assert not re.search(r" \.\s", text), "words in brackets were taken for markup"
    assert not re.search(r"<(bool|int|str|float|list\[str\])>", text), "a type of Python is no word for a modeller"
    assert "]...]..." not in text
    assert max(map(len, text.splitlines())) <= 80
    for option in load(command).params:
        for name in (*option.opts, *option.secondary_opts):
            assert not name.startswith("--") or re.search(rf"{name}[ ,]", text), name


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ["mesh", "a.nii", "-o", "x", "--edgelength", "2"],
            "no such option --edgelength; did you mean '--edge-length'?",
        ),
        (["mesch"], "no such command 'mesch'; did you mean 'mesh'?"),
        (["frobnicate"], "no such command 'frobnicate'; femprep --help lists them"),
        (["check"], "missing argument"),
        (["mesh", "a.nii", "-o", "x", "--edge-length", "wide"], "'--edge-length'"),
    ],
)
def test_wrong_words_are_one_line(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 2
    text = capsys.readouterr().err
    assert said in text
    assert len(text.splitlines()) == 1
    assert text.startswith("femprep: error: ")


def test_python_m_femprep_is_the_command_line() -> None:
    done = subprocess.run([sys.executable, "-m", "femprep", "--version"], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("femprep ")


@pytest.mark.slow
def test_shells_complete_commands_options_and_choices() -> None:
    def offered(words: str) -> str:
        given = {
            "_FEMPREP_COMPLETE": "complete_bash",
            "COMP_WORDS": words,
            "COMP_CWORD": str(len(words.split(" ")) - 1),
        }
        done = subprocess.run(
            [sys.executable, "-m", "femprep"], env={**os.environ, **given}, capture_output=True, text=True, check=False
        )
        return done.stdout

    assert {"mesh", "surface", "compare"} <= set(offered("femprep ").split())
    assert "--edge-length" in offered("femprep mesh --edge").split()
    assert offered("femprep mesh --mesher s").split() == ["sweep"]


def test_log_holds_all_messages_and_the_screen_those_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "run.log"
    missing = str(tmp_path / "none.vtu")
    assert main(["check", missing, "--log", str(log)]) == 2
    text = log.read_text()
    assert "femprep 0" in text
    assert "Traceback" in text
    assert "FileError" in text
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert main(["check", missing, "-vv"]) == 2
    assert "DEBUG femprep.cli: what went wrong" in capsys.readouterr().err
    # What a command opened is closed at its end.
    assert main(["check", missing]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert [type(one) for one in logging.getLogger("femprep").handlers] == [logging.NullHandler]


def test_a_log_that_cannot_be_written_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "a.vtu", "--log", str(tmp_path / "none" / "run.log")]) == 2
    assert "cannot be written: No such file or directory; choose another --log" in capsys.readouterr().err


def test_the_methods_side_by_side_keep_their_figures(capsys: pytest.CaptureFixture[str]) -> None:
    figures = SimpleNamespace(
        method="slice-wise distances, remeshed",
        mean=0.123,
        p95=0.456,
        max=1.789,
        normals=12.3,
        in_slice=0.321,
        triangles=12345,
        q_mean=0.912,
        q_min=0.234,
        sound=True,
        seconds=1.25,
        failure=None,
    )
    print_methods("lv", [figures])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    shown = {word for line in lines for word in line.split()}
    assert {"0.123", "0.456", "1.79", "12.3", "0.321", "12345", "0.912", "0.234", "yes", "1.25"} <= shown


@pytest.mark.parametrize("width", [30, 50, 80, 200])
def test_a_table_of_any_width_shows_every_cell(width: int, capsys: pytest.CaptureFixture[str]) -> None:
    columns = ["", *(f"column {i}" for i in range(9)), "check"]
    words = "smallest dihedral angle in degrees is 3.21 and that is less than 10"
    rows = [[f"row {r}", *(f"{r}{i}.{i}{i}{i}" for i in range(9)), words] for r in range(3)]
    print_table(Console(width=width, highlight=False), "A [title]", columns, rows)
    text = capsys.readouterr().out
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= width
    for row in rows:
        assert all(cell in text for cell in row[1:-1])
    assert text.count("smallest") == 3
