"""``femprep refine`` on files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.cli import main


@pytest.fixture
def mesh(tmp_path: Path) -> Path:
    path = tmp_path / "mesh.vtu"
    fp.write_mesh(truncated_ellipsoid("wedge"), path)
    return path


def test_refines_a_file_and_says_what_the_surfaces_are(mesh: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = mesh.with_name("fine.vtu")
    assert main(["refine", str(mesh), "-o", str(out), "--levels", "2"]) == 0
    coarse, fine = fp.read_mesh(mesh), fp.read_mesh(out)
    assert fine.n_cells == 64 * coarse.n_cells
    assert fine.facet_names == coarse.facet_names
    assert fine.region_names == coarse.region_names
    np.testing.assert_array_equal(fine.cell_data["parent"], np.repeat(np.arange(coarse.n_cells), 64))
    assert fine.info["refinement"]["levels"] == 2
    shown = capsys.readouterr().out
    assert f"{coarse.n_cells} elements -> {fine.n_cells}" in shown
    assert "note: that new nodes lie on smooth surfaces" in shown or "smooth surfaces through the nodes" in shown
    assert main(["check", str(out), "--quiet"]) in (0, 1)


@pytest.mark.parametrize("levels", ["0", "9"])
def test_levels_out_of_range_write_nothing(mesh: Path, levels: str, capsys: pytest.CaptureFixture[str]) -> None:
    out = mesh.with_name("fine.vtu")
    assert main(["refine", str(mesh), "-o", str(out), "--levels", levels]) == 2
    error = capsys.readouterr().err
    assert f"levels is {levels}" in error
    assert len(error.strip().splitlines()) == 1
    assert not out.exists()


def test_missing_file_and_unknown_format_are_one_line(mesh: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["refine", "none.vtu", "-o", "fine.vtu"]) == 2
    assert "none.vtu" in capsys.readouterr().err
    assert main(["refine", str(mesh), "-o", str(mesh.with_name("fine.what"))]) == 2
    assert not mesh.with_name("fine.what").exists()


@pytest.mark.parametrize(
    ("name", "words"), [("fine.what", "no ending of a known format"), ("none/fine.vtu", "does not exist")]
)
def test_where_it_cannot_be_written_nothing_is_computed(
    name: str, words: str, mesh: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("femprep.export.read_mesh", None)
    assert main(["refine", str(mesh), "-o", str(mesh.parent / name)]) == 2
    assert words in capsys.readouterr().err
