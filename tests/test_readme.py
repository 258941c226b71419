"""What README and docstrings say is so."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

import femprep
from femprep.cli._app import COMMANDS

README = (Path(__file__).parent.parent / "README.md").read_text()


def test_ten_lines_run() -> None:
    outcome = doctest.testmod(femprep, optionflags=doctest.ELLIPSIS)
    assert outcome.attempted >= 10
    assert outcome.failed == 0


def test_every_name_in_the_ten_lines_is_public() -> None:
    names = set(re.findall(r"\bfp\.(\w+)", README))
    assert {"read_segmentation", "fit_surface", "build_wall", "tetrahedralize", "check", "write_mesh"} <= names
    assert names <= set(femprep.__all__)


def test_every_command_is_shown() -> None:
    for name in COMMANDS:
        assert re.search(rf"femprep {name}\b", README)


def test_the_two_commands_stand_alone() -> None:
    blocks = re.findall(r"^```\n(.*?)\n```$", README, re.DOTALL | re.MULTILINE)
    assert blocks[0].endswith("femprep demo -o demo")
    assert blocks[1].endswith("python -m pytest -n auto")
    assert all("\n" not in block for block in blocks[:2])


def test_it_is_two_screens() -> None:
    assert len(README) <= 6500
    assert len(README.splitlines()) <= 110
