"""A Medit file that does not end with ``End``: a part of it may be lost, and a notice says so."""

from __future__ import annotations

from pathlib import Path

from meshes import truncated_ellipsoid

from femprep.export import read_mesh, write_mesh


def test_a_file_without_its_end_is_told(tmp_path: Path) -> None:
    (path,) = write_mesh(truncated_ellipsoid("tetra"), tmp_path / "lv.mesh")
    whole = read_mesh(path)
    assert "notices" not in whole.info
    path.write_text(path.read_text().partition("\nEnd\n")[0])
    cut = read_mesh(path)
    assert cut.n_cells == whole.n_cells
    assert [notice["what"] for notice in cut.info["notices"]] == [
        "the file has no End, and was read to where it ends: whether it is cut short cannot be told"
    ]


def test_nothing_is_read_behind_the_end(tmp_path: Path) -> None:
    (path,) = write_mesh(truncated_ellipsoid("tetra"), tmp_path / "lv.mesh")
    whole = read_mesh(path)
    path.write_text(path.read_text() + "Tetrahedra\n1\n1 2 3 4 99\n")
    found = read_mesh(path)
    assert found.region_names == whole.region_names
    assert found.n_cells == whole.n_cells
    assert "notices" not in found.info
