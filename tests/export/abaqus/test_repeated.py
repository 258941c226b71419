"""Nodes and elements that a deck defines again, or in part: as in Abaqus, and that is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from notices import reported

import femprep as fp
from femprep.errors import FileError

DECK = """*NODE
1, 0., 0., 0.
2, 10., 0., 0.
3, 0., 10., 0.
4, 0., 0., 10.
5, 10., 10., 10.
*ELEMENT, TYPE=C3D4, ELSET=lv
1, 1, 2, 3, 4
2, 2, 3, 4, 5
"""


def read(folder: Path, more: str) -> fp.VolumeMesh:
    path = folder / "mesh.inp"
    path.write_text(DECK + more)
    return fp.read_mesh(path)


def told(mesh: fp.VolumeMesh) -> list[str]:
    return reported(mesh)


def test_the_last_node_counts(tmp_path: Path) -> None:
    mesh = read(tmp_path, "*NODE\n2, 20., 0., 0.\n")
    assert mesh.points[mesh.cells["tetra"][0, 1]].tolist() == [20.0, 0.0, 0.0]
    assert len(mesh.points) == 5
    assert told(mesh) == ["definitions of 1 nodes and 0 elements are repeated: the last one was taken, as in Abaqus"]


def test_the_last_element_counts(tmp_path: Path) -> None:
    mesh = read(tmp_path, "*ELEMENT, TYPE=C3D4, ELSET=lv\n1, 2, 1, 3, 5\n")
    assert mesh.n_cells == 2
    assert {tuple(sorted(row)) for row in mesh.cells["tetra"].tolist()} == {(0, 1, 2, 4), (1, 2, 3, 4)}
    assert told(mesh) == ["definitions of 0 nodes and 1 elements are repeated: the last one was taken, as in Abaqus"]


def test_once_is_not_told(tmp_path: Path) -> None:
    mesh = read(tmp_path, "")
    assert told(mesh) == []
    np.testing.assert_array_equal(mesh.cells["tetra"], [[0, 1, 2, 3], [1, 2, 3, 4]])


def test_coordinates_that_are_not_given_are_0(tmp_path: Path) -> None:
    mesh = read(tmp_path, "*NODE\n2, 20.\n5, , 10., 10.\n")
    ends = mesh.points[mesh.cells["tetra"][1, [0, 3]]]  # nodes 2 and 5
    assert ends.tolist() == [[20.0, 0.0, 0.0], [0.0, 10.0, 10.0]]
    assert told(mesh)[1:] == ["2 nodes have fewer than three coordinates: 0 for the others, as in Abaqus"]


def test_a_node_without_a_number_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="is no number"):
        read(tmp_path, "*NODE\n, 1., 2., 3.\n")
