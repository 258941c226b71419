"""``--pericardium`` of convert and mesh: springs in the deck, or one line why not."""

from __future__ import annotations

from pathlib import Path

import pytest
from meshes import APEX_HEIGHT, BASE_HEIGHT, truncated_ellipsoid

import femprep as fp
from femprep.cli import main
from femprep.pipeline import mesh_segmentation


def stored(folder: Path, coordinates: bool) -> Path:
    mesh = truncated_ellipsoid("tetra")
    if coordinates:
        mesh = mesh.with_data(point={"apicobasal": (mesh.points[:, 2] - APEX_HEIGHT) / (BASE_HEIGHT - APEX_HEIGHT)})
    fp.write_mesh(mesh, folder / "mesh.vtu")
    return folder / "mesh.vtu"


def test_convert_puts_springs_into_the_step(tmp_path: Path) -> None:
    mesh, deck = stored(tmp_path, True), tmp_path / "lv.inp"
    assert main(["convert", str(mesh), str(deck), "--step", "inflation", "--pericardium", "0.5"]) == 0
    text = deck.read_text()
    assert text.count("*EQUATION") == text.count(", 1, -1., ") > 30
    assert "*SPRING, ELSET=pericardium_springs\n1\n1.\n" in text
    assert "*NSET, NSET=basal_ring\n" in text
    # They are no part of the mesh that is read back, and a deck without a step holds none.
    back = fp.read_mesh(deck)
    assert (len(back.points), back.n_cells) == (180, 576)
    assert main(["convert", str(mesh), str(tmp_path / "bare.inp"), "--pericardium", "0.5"]) == 0
    assert "SPRING" not in (tmp_path / "bare.inp").read_text()


def test_fields_come_back_from_a_vtu(tmp_path: Path) -> None:
    mesh = stored(tmp_path, True)
    assert main(["convert", str(mesh), str(tmp_path / "two.vtu"), "--pericardium", "2"]) == 0
    found = fp.read_mesh(tmp_path / "two.vtu").point_data
    assert found["pericardium"].max() == pytest.approx(2.0, rel=1e-4)
    assert {"pericardium_area", "pericardium_normal", "basal_ring"} <= set(found)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [(["--pericardium", "1"], "apicobasal"), (["--pericardium", "-1"], "option --pericardium is -1.0")],
    ids=["no coordinates", "negative"],
)
def test_one_line_and_nothing_written(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mesh = stored(tmp_path, False)
    assert main(["convert", str(mesh), str(tmp_path / "lv.inp"), *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1
    assert not (tmp_path / "lv.inp").exists()


def test_a_run_needs_fibres_for_it() -> None:
    with pytest.raises(fp.OptionError, match="add fibres"):
        mesh_segmentation(None, pericardium={"stiffness": 1.0})  # type: ignore[arg-type]
    assert fp.Options(fibres={}, pericardium={}).pericardium.stiffness == 1.0
