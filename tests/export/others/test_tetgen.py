"""TetGen: a mesh by either of its files, and files that are not what they say."""

from __future__ import annotations

from pathlib import Path

import pytest

import femprep as fp
from femprep.errors import FileError


def written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


NODES = "# nodes\n4 3 0 0\n1 0 0 0\n2 9 0 0\n3 0 9 0\n4 0 0 9\n"


@pytest.mark.parametrize("named", [".node", ".ele"])
def test_a_mesh_of_tetgen_by_either_of_its_files(tmp_path: Path, named: str) -> None:
    written(tmp_path / "a.node", NODES)
    written(tmp_path / "a.ele", "1 4 1\n1 1 2 3 4 7\n")
    assert fp.read_mesh(tmp_path / f"a{named}").region.tolist() == [7]


@pytest.mark.parametrize(
    ("nodes", "elements", "words"),
    [
        *(
            (NODES, f"{head}\n", "lists no tetrahedra")
            for head in ("0 4 648650", "-0 4 648650", "-1 4 2147483648", "1 4 -1")
        ),
        ("0 3 2000000000 0\n", "1 4 0\n1 1 2 3 4\n", "lists no nodes"),
        (NODES, "1 4 2000000000\n1 1 2 3 4\n", "1 tetrahedra of 2000000004 numbers, in 25 bytes"),
        (NODES, "1 10 0\n1 1 2 3 4 5 6 7 8 9 10\n", "ten nodes, which are not read; run TetGen without -o2"),
        (NODES, "1 4\n1 1 2 3 4\n", "damaged"),
        (NODES, None, r"a\.ele' is missing"),
    ],
)
def test_tetgen_files_that_are_not_what_they_say(tmp_path: Path, nodes: str, elements: str | None, words: str) -> None:
    path = written(tmp_path / "a.node", nodes)
    if elements is not None:
        written(tmp_path / "a.ele", elements)
    with pytest.raises(FileError, match=words):
        fp.read_mesh(path)
