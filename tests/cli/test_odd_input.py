"""Outputs, logs and configurations that are not what they should be: one line, and nothing of theirs lost."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.cli import main

ONE_LINE = "femprep: error: "


@pytest.fixture
def mesh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return fp.write_mesh(truncated_ellipsoid("tetra", heights=2, around=6, layers=1), tmp_path / "mesh.vtu")[0]


def refusal(capsys: pytest.CaptureFixture[str], folder: Path) -> str:
    """The one line that was said."""
    lines = [line for line in capsys.readouterr().err.splitlines() if line.strip()]
    assert len(lines) == 1, lines
    assert lines[0].startswith(ONE_LINE)
    assert not list(folder.glob("femprep-crash-*"))
    return lines[0]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a pipe")
def test_a_mesh_does_not_take_the_place_of_a_pipe(
    mesh: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It did, and would have of a device: ``/dev/null`` would have been a deck from then on."""
    os.mkfifo(tmp_path / "out.inp")
    assert main(["convert", str(mesh), "out.inp"]) == 2
    assert "is no regular file" in refusal(capsys, tmp_path)
    assert stat.S_ISFIFO((tmp_path / "out.inp").stat().st_mode)


@pytest.mark.parametrize("arguments", [["check", "--html", "out.svg"], ["bullseye", "--field", "aha", "out.svg"]])
def test_names_that_lead_to_each_other(
    arguments: list[str], mesh: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from second_images import ventricle

    heart = fp.write_mesh(ventricle("tetra", 3, 2), tmp_path / "heart.vtu")[0]
    (tmp_path / "out.svg").symlink_to("other")
    (tmp_path / "other").symlink_to("out.svg")
    assert main([arguments[0], str(heart), *arguments[1:]]) == 2
    assert "'out.svg' cannot be written: Too many levels of symbolic links" in refusal(capsys, tmp_path)


def test_schemas_into_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "kept").write_text("mine")
    assert main(["schema", str(tmp_path / "kept")]) == 2
    assert "cannot be written: File exists; choose another" in refusal(capsys, tmp_path)
    assert (tmp_path / "kept").read_text() == "mine"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is full")
def test_a_log_on_a_full_disk(mesh: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["convert", str(mesh), "out.inp", "--log", "/dev/full"]) == 3
    assert "log '/dev/full' cannot be written whole, no room is left" in refusal(capsys, tmp_path)
    assert not (tmp_path / "out.inp").exists()


def test_a_number_of_a_hundred_thousand_digits(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "options.toml"
    path.write_text("volume.edge_length = " + "9" * 100_000)
    assert main(["mesh", "none.nii", "-o", str(tmp_path / "out"), "--config", str(path)]) == 2
    assert "is not valid TOML" in refusal(capsys, tmp_path)


@pytest.mark.parametrize(("ending", "kind"), [(".vtu", "vtu"), (".msh", "gmsh22")])
def test_elements_that_are_not_read_are_told(
    ending: str, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Pyramids of a mesh of others were left out without a word."""
    import meshio
    import numpy as np

    corners = 30.0 * np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    points = np.concatenate([corners, corners + 30.0 * np.eye(3)[2], [[15, 15, 60]]])
    cells = [("hexahedron", np.arange(8)[None]), ("pyramid", np.array([[4, 5, 6, 7, 8]]))]
    path = tmp_path / f"mesh{ending}"
    meshio.write(path, meshio.Mesh(points, cells), kind)
    said = "note: elements of types pyramid of the file are left out"
    for arguments in (["convert", str(path), str(tmp_path / "out.inp")], ["check", str(path)]):
        assert main(arguments) in (0, 1)
        assert said in capsys.readouterr().out
    meshio.write(path, meshio.Mesh(points, cells[1:]), kind)
    capsys.readouterr()  # what meshio prints while it writes
    assert main(["check", str(path)]) == 2
    assert "holds no volume elements (found pyramid)" in refusal(capsys, tmp_path)
