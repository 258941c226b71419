"""Numbers as Fortran writes them, which Abaqus, LS-DYNA and NASTRAN take; what is no number, with its row."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.errors import FileError, InputError
from femprep.export.deck.reals import real, reals


@pytest.mark.parametrize("text", ["1.0D+01", "1.0d1", "1.0+1", "10.", "+10", "1.E1", " .1+2 "])
def test_a_number_in_every_way(text: str) -> None:
    assert real(text, text) == 10.0
    assert reals([[text, "2"], ["3", text]]).tolist() == [[10, 2], [3, 10]]


@pytest.mark.parametrize("text", ["", "1.0X1", "10,0", "D1", "1+", "--1"])
def test_what_is_none(text: str) -> None:
    with pytest.raises(InputError, match=r"is no number; write it as 10\.5 or 1\.05E\+01"):
        real(text, "7, 0, 0")


def test_what_febio_does_not_take() -> None:
    with pytest.raises(InputError, match=r"'1\.0D1' in the row '0,1\.0D1' is no number"):
        reals([["0", "1.0D1"]], fortran=False)


@pytest.mark.parametrize(
    ("ending", "row"), [("inp", "1, {}, 0.0, 0.0\n"), ("k", "       1{:>16}             0.0             0.0\n")]
)
def test_decks(ending: str, row: str, tmp_path: Path) -> None:
    path = fp.write_mesh(truncated_ellipsoid("tetra"), tmp_path / f"a.{ending}")[0]
    head, _first, rest = re.split(r"(?m)^( *1, .*\n| {7}1.*\n)", path.read_text(), maxsplit=1)
    path.write_text(head + row.format("7.0D+00") + rest)
    assert fp.read_mesh(path).points[0].tolist() == [7.0, 0.0, 0.0]
    path.write_text(head + row.format("7.0X+00") + rest)
    with pytest.raises(FileError, match=r"'7\.0X\+00' in the row '1.* is no number"):
        fp.read_mesh(path)
