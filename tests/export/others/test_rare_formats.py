"""FLAC3D, NASTRAN and Netgen: numbers beyond all, given twice, and groups that meshio mistakes."""

from __future__ import annotations

from pathlib import Path

import pytest

import femprep as fp
from femprep.errors import FileError

POINTS = "G 1 0 0 0\nG 2 10 0 0\nG 3 0 10 0\nG 4 0 0 10\nG 5 10 10 10\n"
ZONES = "Z T4 1 1 2 3 4\nZ T4 2 2 3 4 5\n"
GRIDS = "".join(
    f"GRID,{i},,{x},{y},{z}\n" for i, (x, y, z) in enumerate([(0, 0, 0), (9, 0, 0), (0, 9, 0), (0, 0, 9)], 1)
)
BULK = f"BEGIN BULK\n{GRIDS}CTETRA,1,1,1,2,3,4\nENDDATA\n"


def written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def test_a_flac3d_grid_and_its_groups(tmp_path: Path) -> None:
    one = fp.read_mesh(written(tmp_path / "a.f3grid", f'{POINTS}{ZONES}ZGROUP "lv" SLOT 1\n2\n'))
    assert one.n_cells == 2
    assert len(set(one.region.tolist())) == 2
    faces = 'F T3 1 1 2 3\nF T3 2 2 3 5\nZGROUP "lv" SLOT 1\n2\n'
    two = fp.read_mesh(written(tmp_path / "b.f3grid", f"{POINTS}{ZONES}{faces}"))
    assert set(two.region.tolist()) == {0}
    (notice,) = two.info["notices"]
    assert notice["what"] == "groups zone:lv:1 are left out: meshio mistakes them where there are several types"


def test_a_number_that_a_flac3d_grid_cannot_hold_is_refused(tmp_path: Path) -> None:
    text = POINTS + ZONES.replace("T4 2", "T4 4000000000")
    with pytest.raises(FileError, match="numbers an element 4000000000, in"):
        fp.read_mesh(written(tmp_path / "a.f3grid", text))


def test_what_a_nastran_deck_numbers_twice_is_refused(tmp_path: Path) -> None:
    assert fp.read_mesh(written(tmp_path / "a.bdf", BULK)).n_cells == 1
    twice = BULK.replace("CTETRA", "GRID,4,,0,0,1\nCTETRA", 1)
    with pytest.raises(FileError, match="GRID 4 is defined 2 times"):
        fp.read_mesh(written(tmp_path / "b.bdf", twice))
    twice = BULK.replace("ENDDATA", "CTETRA,1,1,1,2,4,3\nENDDATA")
    with pytest.raises(FileError, match="element 1 is defined 2 times"):
        fp.read_mesh(written(tmp_path / "c.bdf", twice))


def test_arrays_that_are_no_numbers_are_left_out(tmp_path: Path) -> None:
    """Netgen's numbers of regions that no integer holds become objects in meshio."""
    points = "points\n4\n0 0 0\n9 0 0\n0 9 0\n0 0 9\n"
    text = f"mesh3d\ndimension\n3\n{points}volumeelements\n1\n{{}} 4 1 3 2 4\nendmesh\n"
    assert "netgen:index" in fp.read_mesh(written(tmp_path / "a.vol", text.format(7))).cell_data
    assert fp.read_mesh(written(tmp_path / "b.vol", text.format(10**30))).cell_data == {}


def test_an_su2_mesh_that_is_cut_short_is_refused(tmp_path: Path) -> None:
    points = "NPOIN= 5\n0 0 0 0\n9 0 0 1\n0 9 0 2\n0 0 9 3\n9 9 9 4\n"
    mark = "NMARK= 1\nMARKER_TAG= epi\nMARKER_ELEMS= 1\n5 0 1 2\n"
    whole = f"NDIME= 3\n% made by hand\nNELEM= 2\n10 0 1 2 3 0\n10 1 2 3 4 1\n{points}{mark}"
    mesh = fp.read_mesh(written(tmp_path / "a.su2", whole))
    assert (mesh.n_cells, mesh.n_facets) == (2, 1)
    for row, words in (("10 0 1 2 3 0\n", "NELEM= 2 and lists 1"), ("9 9 9 4\n", "NPOIN= 5 and lists 4")):
        with pytest.raises(FileError, match=words):
            fp.read_mesh(written(tmp_path / "b.su2", whole.replace(row, "")))
    with pytest.raises(FileError, match="MARKER_ELEMS= 1 and lists 0"):
        fp.read_mesh(written(tmp_path / "c.su2", whole.replace("5 0 1 2\n", "")))
