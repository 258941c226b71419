"""What README and docstrings say is so."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

import femprep
from femprep.cli._app import COMMANDS, HIDDEN
from femprep.export.table import markdown_table

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
    for name in COMMANDS.keys() - HIDDEN:
        assert f"femprep {name} " in README


def test_table_of_formats_is_that_of_the_code() -> None:
    assert markdown_table().strip() in README


def test_files_it_names_are_there() -> None:
    root = Path(__file__).parent.parent
    for name in re.findall(r"(?:examples|tests)/[\w./]+\.(?:py|png|md)", README):
        assert (root / name).is_file(), name
