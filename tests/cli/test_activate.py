"""``femprep activate``: a mesh with fibres in, the map and the Purkinje fibres out."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest
from anatomy_meshes import ellipsoid

import femprep as fp
from femprep.cli import main


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    mesh = fp.add_fibres(ellipsoid("hexahedron", size=4, layers=2).mesh)
    path = tmp_path_factory.mktemp("mesh") / "mesh.vtu"
    fp.write_mesh(mesh, path)
    return path


@pytest.mark.skipif(find_spec("fractal_tree") is None, reason="fractal-tree is not installed")
def test_a_mesh_gets_fibres_and_times(stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "beat.vtu"
    beside = ",".join(f"{x:.3f}" for x in fp.read_mesh(stored).points[-1] + [0.0, 0.0, 2.0])
    arguments = ["--generations", "4", "--speed", "3", f"--root-lv={beside}"]
    assert main(["activate", str(stored), "-o", str(out), *arguments]) == 0
    found = fp.read_mesh(out)
    assert found.purkinje is not None
    assert found.purkinje.speed == 3.0
    assert found.info["activation"]["begins"] == "junctions of the Purkinje fibres"
    assert found.point_data["activation"].min() > 0
    assert (tmp_path / "beat_purkinje.vtp").is_file()
    shown = capsys.readouterr().out
    assert "mm of Purkinje fibres" in shown
    assert "note: the root given for the lv was brought " in shown
    # What a mesh has is used, and goes on into other formats.
    again = tmp_path / "again.k"
    assert main(["activate", str(out), "-o", str(again), "--no-purkinje", "--quiet"]) == 0
    assert "*ELEMENT_BEAM" in again.read_text()


def test_without_fibres_of_its_own_the_beat_begins_on_the_endocardium(stored: Path, tmp_path: Path) -> None:
    out = tmp_path / "beat.vtu"
    assert main(["activate", str(stored), "-o", str(out), "--no-purkinje", "-q"]) == 0
    found = fp.read_mesh(out)
    assert found.purkinje is None
    assert found.point_data["activation"].min() == 0.0


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--fibre-speed", "-1"], "option --fibre-speed is -1.0"),
        (["--root-lv", "1,2"], "--root-lv '1,2' is not X,Y,Z"),
        (["--picture", "map.jpg", "--no-purkinje"], ".png"),
        (["--branch-length", "4", "--no-purkinje"], "--branch-length shapes the Purkinje fibres"),
    ],
    ids=["speed", "root", "picture", "idle"],
)
def test_one_line_and_nothing_written(
    more: list[str], words: str, stored: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["activate", str(stored), "-o", str(tmp_path / "beat.vtu"), *more]) == 2
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_mesh_without_fibres_is_refused_before_a_tree_grows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("femprep.activation.growth.require_growth", lambda: None)
    monkeypatch.setattr("femprep.activation.add_purkinje", None)
    fp.write_mesh(ellipsoid("hexahedron", size=4, layers=2).mesh, tmp_path / "mesh.vtu")
    assert main(["activate", str(tmp_path / "mesh.vtu"), "-o", str(tmp_path / "beat.vtu")]) == 2
    assert "fibres, which the mesh does not have" in capsys.readouterr().err
