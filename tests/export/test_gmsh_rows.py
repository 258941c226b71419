"""Data of Gmsh's files go to the nodes and elements they are of, and as many rows are read as there are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import femprep as fp
from femprep.errors import FileError

DATA = '${0}Data\n1\n"{1}"\n1\n0\n3\n0\n1\n{2}\n{3}\n$End{0}Data\n'
#: Nodes 11 to 15, elements 21 and 22, in text of both versions.
MESHES = {
    "2.2": "$Nodes\n5\n11 0 0 0\n12 9 0 0\n13 0 9 0\n14 0 0 9\n15 9 9 9\n$EndNodes\n"
    "$Elements\n2\n21 4 2 1 1 11 12 13 14\n22 4 2 1 1 12 13 14 15\n$EndElements\n",
    "4.1": "$Nodes\n1 5 11 15\n3 1 0 5\n11\n12\n13\n14\n15\n0 0 0\n9 0 0\n0 9 0\n0 0 9\n9 9 9\n$EndNodes\n"
    "$Elements\n1 2 21 22\n3 1 4 2\n21 11 12 13 14\n22 12 13 14 15\n$EndElements\n",
}


def read(folder: Path, version: str, *data: str, change: tuple[str, str] = ("", "")) -> fp.VolumeMesh:
    path = folder / "mesh.msh"
    assert change[0] in MESHES[version]
    mesh = MESHES[version].replace(*change, 1) if change[0] else MESHES[version]
    path.write_text(f"$MeshFormat\n{version} 0 8\n$EndMeshFormat\n{mesh}{''.join(data)}")
    return fp.read_mesh(path)


@pytest.mark.parametrize("version", MESHES)
def test_data_go_to_what_they_are_of(version: str, tmp_path: Path) -> None:
    """meshio looks at the order of rows alone."""
    heights = DATA.format("Node", "height", 5, "15 5\n11 1\n13 3\n12 2\n14 4")
    loads = DATA.format("Element", "load", 2, "22 2.5\n21 1.5")
    earlier = heights.replace("15 5\n", "15 9\n")  # of another time, under the same name
    mesh = read(tmp_path, version, earlier, heights, loads)
    np.testing.assert_array_equal(mesh.point_data["height"], [1, 2, 3, 4, 5])
    np.testing.assert_array_equal(mesh.cell_data["load"], [1.5, 2.5])


@pytest.mark.parametrize("version", MESHES)
@pytest.mark.parametrize(
    ("data", "words"),
    [
        (DATA.format("Element", "load", 2, "21 1.5\n20 2.5"), "has 'load' of other nodes or elements"),
        (DATA.format("Element", "load", 2, "21 1.5\n21 1.5\n22 2.5"), "'load' has 2 rows and lists 3"),
        (DATA.format("Node", "height", 5, "11 1\n12 2\n13 3\n14 4\n14 5"), "has 'height' of other nodes or elem"),
    ],
)
def test_data_of_others_are_refused(version: str, data: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(FileError, match=words):
        read(tmp_path, version, data)


@pytest.mark.parametrize(
    ("version", "row", "words"),
    [
        ("2.2", "21 4 2 1 1 11 12 13 14\n", "2 elements and lists 3"),
        ("4.1", "22 12 13 14 15\n", "2 elements and lists 3"),
        ("2.2", "12 9 0 0\n", "more than the 5 nodes"),
        ("4.1", "9 0 0\n", "more than the 5 nodes"),
    ],
)
def test_rows_that_are_too_many_are_refused(version: str, row: str, words: str, tmp_path: Path) -> None:
    """The last one was left out, or all coordinates moved on by one."""
    with pytest.raises(FileError, match=words):
        read(tmp_path, version, change=(row, row + row))


@pytest.mark.parametrize("version", MESHES)
def test_heads_longer_than_the_file_are_refused(version: str, tmp_path: Path) -> None:
    """meshio read lines for ever."""
    data = DATA.format("Element", "load", 2, "21 1.5\n22 2.5").replace("\n1\n0\n3\n", "\n9223372036854775808\n0\n3\n")
    with pytest.raises(FileError, match="its data have 9223372036854775808 tags"):
        read(tmp_path, version, data)


@pytest.mark.parametrize("version", MESHES)
@pytest.mark.parametrize("node", ["-1", "-4294967281", "0", "00", "18446744073709551627"])
def test_elements_of_nodes_below_one_are_refused(version: str, node: str, tmp_path: Path) -> None:
    """meshio counts these from the end of its table, or they wrap around: an element of others' nodes was read."""
    row = " 11 12 13 14\n"
    for place in range(4):
        words = row.split()
        words[place] = node
        with pytest.raises(FileError):
            read(tmp_path, version, change=(row, f" {' '.join(words)}\n"))


def test_tags_of_elements_may_be_none_or_turned_over(tmp_path: Path) -> None:
    """0 is no group; below it are groups turned over, and ghosts of partitions."""
    mesh = read(tmp_path, "2.2", change=("21 4 2 1 1", "21 4 2 0 0"))
    assert mesh.region.tolist() == [0, 1]
    assert read(tmp_path, "2.2", change=("21 4 2 1 1", "21 4 2 -1 1")).region.tolist() == [1, 1]
    assert read(tmp_path, "2.2", change=("21 4 2 1 1", "21 4 4 1 1 1 -2")).region.tolist() == [1, 1]
