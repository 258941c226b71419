"""AVS UCD files: a node, a cell and a row of data has a number of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import femprep as fp
from femprep.errors import FileError

UCD = """# made by hand
5 2 1 1 0
1 0 0 0
2 10 0 0
3 0 10 0
4 0 0 10
9 10 10 10
1 7 tet 1 2 3 4
2 8 tet 2 3 4 9
1 1
height, mm
1 0.5
2 1.5
3 2.5
4 3.5
9 4.5
1 1
load, kPa
1 10.0
2 20.0
"""


def read(folder: Path, old: str = "", new: str = "") -> fp.VolumeMesh:
    path = folder / "mesh.avs"
    assert old in UCD
    path.write_text(UCD.replace(old, new, 1) if old else UCD)
    return fp.read_mesh(path)


def test_data_are_those_of_their_numbers(tmp_path: Path) -> None:
    mesh = read(tmp_path, "1 10.0\n2 20.0", "2 20.0\n1 10.0")
    np.testing.assert_array_equal(mesh.cell_data["load"], [10.0, 20.0])
    np.testing.assert_array_equal(mesh.point_data["height"], [0.5, 1.5, 2.5, 3.5, 4.5])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("9 10 10 10", "4 10 10 10", "node 4 is defined 2 times"),
        ("2 8 tet", "1 8 tet", "cell 1 is defined 2 times"),
        ("2 20.0", "1 20.0", "row of data of cell 1 is defined 2 times"),
        ("9 4.5", "4 4.5", "row of data of node 4 is defined 2 times"),
        ("9 4.5", "8 4.5", "row of data of node of another number"),
    ],
)
def test_what_is_numbered_as_another_is_refused(old: str, new: str, words: str, tmp_path: Path) -> None:
    """What had no row of data was what was in the memory."""
    with pytest.raises(FileError, match=words):
        read(tmp_path, old, new)
