"""Units, step and material of a deck from the command line."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from meshes import truncated_ellipsoid, with_fibres

from femprep.cli import main
from femprep.cli._configuration import read_options
from femprep.errors import OptionError
from femprep.export import write_mesh
from femprep.model import FACET_TAGS


@pytest.fixture
def mesh(tmp_path: Path) -> Path:
    write_mesh(with_fibres(truncated_ellipsoid("tetra")), tmp_path / "lv.vtu")
    return tmp_path / "lv.vtu"


def points(deck: Path) -> np.ndarray:
    block = re.split(r"^\*", deck.read_text().split("*NODE", 1)[1], maxsplit=1, flags=re.MULTILINE)[0]
    return np.array([line.split(",")[1:] for line in block.splitlines()[1:] if line.strip()], dtype=float)


def test_convert_is_a_mesh_alone_in_mm_where_nothing_is_asked(mesh: Path) -> None:
    assert main(["convert", str(mesh), str(mesh.with_name("a.inp"))]) == 0
    text = mesh.with_name("a.inp").read_text()
    assert "*STEP" not in text
    np.testing.assert_allclose(points(mesh.with_name("a.inp")), truncated_ellipsoid("tetra").points, atol=1e-9)


def test_convert_writes_the_unit_the_step_and_the_material_it_is_told(mesh: Path) -> None:
    deck = mesh.with_name("b.inp")
    arguments = ["--length-unit", "m", "--step", "inflation", "--young-modulus", "20", "--poisson-ratio", "0.3"]
    assert main(["convert", str(mesh), str(deck), *arguments, "--pressure", "2"]) == 0
    text = deck.read_text()
    # Metres, newtons and pascals.
    assert "*ELASTIC\n20000, 0.3\n" in text
    assert "endo, P, 2000\n" in text
    np.testing.assert_allclose(points(deck), truncated_ellipsoid("tetra").points * 1e-3, atol=1e-12)


@pytest.mark.parametrize(
    ("material", "line"),
    [
        # C10 = E / 4 / (1 + nu), D1 = 6 (1 - 2 nu) / E, in MPa.
        ("neo-hookean", f"*HYPERELASTIC, NEO HOOKE\n{0.03 / 4 / 1.4:.12g}, {6 * 0.2 / 0.03:.12g}\n"),
        ("orthotropic", "*ELASTIC, TYPE=ENGINEERING CONSTANTS\n0.15, 0.03, 0.03,"),
    ],
)
def test_convert_takes_every_material(mesh: Path, material: str, line: str) -> None:
    deck = mesh.with_name("c.inp")
    arguments = ["--step", "inflation", "--material", material, "--fibre-stiffness", "5"]
    assert main(["convert", str(mesh), str(deck), *arguments]) == 0
    assert line in deck.read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--length-unit", "inch"], "option --length-unit is 'inch'"),
        (["--step", "inflation", "--poisson-ratio", "0.5"], "option --poisson-ratio is 0.5"),
        (["--material", "steel"], "option --material is 'steel'"),
        (["--material", "neo-hookean"], "--material is of the step, and none is written; add --step inflation"),
        (["--pericardium", "0"], "option --pericardium is 0.0"),
        (["--step", "inflation", "--pressure", "high"], "--pressure 'high' is not a number of kPa"),
        (["--step", "inflation", "--pressure", "1", "--pressure", "2"], "--pressure '1' is not"),
        (["--step", "inflation", "--pressure", "lv=1", "--pressure", "lv=2"], "--pressure lv is given twice"),
        (["--step", "inflation", "--pressure", "rv=1"], "'rv'; the cavities of this mesh are lv"),
    ],
)
def test_wrong_option_of_a_deck_is_one_line(
    mesh: Path, arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    out = mesh.with_name("d.inp")
    assert main(["convert", str(mesh), str(out), *arguments]) == 2
    said = capsys.readouterr().err.strip()
    assert re.search(words, said)
    assert "\n" not in said
    assert not out.exists()


def test_mesh_passes_unit_and_step_on(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    seen = {}

    def run(segmentation: Path, out: Path, options: object, **_: object) -> int:
        seen["options"] = options
        return 0

    monkeypatch.setattr("femprep.cli.mesh.mesh_file", run)
    assert main(["mesh", "a.nii", "-o", str(tmp_path / "o"), "--length-unit", "cm", "--step", "inflation"]) == 0
    assert seen["options"] == read_options(None, export__length_unit="cm", export__step="inflation")
    assert (seen["options"].export.length_unit, seen["options"].export.step) == ("cm", "inflation")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("two.inp", ["endo_lv, P, 0.0015\n", "endo_rv, P, 0.0005\n"]),
        ("two.feb", ['surface="endo_lv">\n<pressure lc="1">0.0015<', 'surface="endo_rv">\n<pressure lc="1">0.0005<']),
        ("svmultiphysics/inflation_lv.dat", ["1.0 0.0015\n"]),
        ("svmultiphysics/inflation_rv.dat", ["1.0 0.0005\n"]),
        ("svmultiphysics/inflation.xml", ["> inflation_lv.dat <", "> inflation_rv.dat <"]),
    ],
)
def test_every_deck_has_the_pressure_of_each_ventricle(tmp_path: Path, name: str, words: list[str]) -> None:
    wall = truncated_ellipsoid("tetra")
    endo = np.flatnonzero(wall.facet_tag == FACET_TAGS["endo"])
    tag = np.array(wall.facet_tag)
    tag[endo] = np.where(np.arange(len(endo)) % 2, FACET_TAGS["endo_lv"], FACET_TAGS["endo_rv"])
    write_mesh(replace(wall, facet_tag=tag), tmp_path / "two.vtu")
    folder = name.partition("/")[0]
    out = ["--format", folder] if folder == "svmultiphysics" else []
    pressures = ["--pressure", "lv=1.5", "--pressure", "rv=0.5"]
    command = ["convert", str(tmp_path / "two.vtu"), str(tmp_path / folder), *out, "--step", "inflation", *pressures]
    assert main(command) == 0
    text = (tmp_path / name).read_text()
    assert all(word in text for word in words)


def test_options_of_a_step_that_is_not_there_are_refused_by_mesh(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["mesh", "heart.nii.gz", "-o", str(tmp_path / "out"), "--preset", "acdc", "--pressure", "lv=1"]) == 2
    assert "--solve ccx or --step inflation" in capsys.readouterr().err


def test_pressures_of_a_configuration(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("[export.pressure]\nlv = 1.5\nrv = 0.5\n")
    assert read_options(tmp_path / "a.toml").export.pressure == {"lv": 1.5, "rv": 0.5}
    (tmp_path / "b.toml").write_text('[export]\npressure = "high"\n')
    with pytest.raises(OptionError, match=r"export\.pressure' is 'high'"):
        read_options(tmp_path / "b.toml")
