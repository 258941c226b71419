"""Units of a mesh from a file: stated, given, guessed, or asked for where lengths matter."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from anatomy_meshes import ellipsoid, slab

import femprep as fp
from femprep.cli import main
from femprep.mesh.length_unit import UNIT, in_millimetres
from femprep.model import VolumeMesh
from femprep.model.units import plausible_units


def scaled(factor: float) -> VolumeMesh:
    """A left ventricle 127 mm from corner to corner, as from another program."""
    truth = ellipsoid("tetra").mesh
    return VolumeMesh(truth.points * factor, truth.cells, np.ones(truth.n_cells))


def write(path: Path, factor: float) -> Path:
    mesh = scaled(factor)
    meshio.Mesh(mesh.points, [("tetra", mesh.cells["tetra"])]).write(path)
    return path


def across(mesh: VolumeMesh) -> float:
    return float(np.linalg.norm(np.ptp(mesh.points, axis=0)))


@pytest.mark.parametrize(
    ("across", "units"),
    [
        (9.0, ["mm", "cm"]),  # a mouse's, or a child's in cm
        (15.4, ["mm", "cm"]),  # a rat's, or a man's in cm
        (40.0, ["mm"]),  # a rabbit's
        (4.5, ["cm"]),  # an infant's
        (0.12, ["m"]),
        (0.01, ["m"]),  # a mouse's
        (1.2e5, ["um"]),
        (1.5, ["cm"]),  # a rat's in cm
        (1e9, []),
    ],
)
def test_hearts_by_their_size(across: float, units: list[str]) -> None:
    assert plausible_units(across) == units


@pytest.mark.parametrize(("factor", "unit"), [(1.0, "mm"), (1e-3, "m"), (1e3, "um"), (0.04, "cm")])
def test_the_only_unit_that_gives_a_heart_is_taken_and_is_a_notice(factor: float, unit: str, tmp_path: Path) -> None:
    mesh = fp.read_mesh(write(tmp_path / "heart.vtk", factor))
    assert mesh.info[UNIT] == {"unit": unit, "by": "guess"}
    assert any(f"to be in {unit}:" in one["what"] for one in mesh.info["notices"])
    assert 30.0 < across(mesh) < 300.0


def test_where_two_units_are_possible_lengths_stay_and_what_needs_them_asks(tmp_path: Path) -> None:
    path = write(tmp_path / "heart.vtk", 0.1)
    mesh = fp.read_mesh(path)
    np.testing.assert_allclose(across(mesh), across(scaled(0.1)))
    assert fp.check(mesh).passed
    for needs in (
        lambda: fp.write_mesh(mesh, tmp_path / "heart.pts"),
        lambda: fp.write_mesh(mesh, tmp_path / "heart.inp", length_unit="cm"),
        lambda: fp.write_mesh(mesh, tmp_path / "heart.inp", step="inflation"),
        lambda: fp.check(mesh, purpose="electrophysiology"),
        lambda: fp.annotate(mesh),
    ):
        with pytest.raises(fp.InputError, match=r"--unit mm \(.* --unit cm \("):
            needs()
    # A file of femprep's own keeps the doubt.
    again = fp.read_mesh(fp.write_mesh(mesh, tmp_path / "kept.vtu")[0])
    with pytest.raises(fp.InputError, match="--unit cm"):
        fp.write_mesh(again, tmp_path / "heart.pts")


def test_the_option_answers_and_the_deck_has_the_size_of_the_heart(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = str(write(tmp_path / "heart.vtk", 0.1))
    assert main(["convert", path, str(tmp_path / "heart.pts"), "--format", "opencarp"]) == 2
    assert "--unit cm" in capsys.readouterr().err
    assert not (tmp_path / "heart.pts").exists()
    assert main(["convert", path, str(tmp_path / "heart.pts"), "--unit", "cm"]) == 0
    micrometres = np.loadtxt(tmp_path / "heart.pts", skiprows=1)
    np.testing.assert_allclose(np.linalg.norm(np.ptp(micrometres, axis=0)), 1e3 * across(scaled(1.0)), rtol=1e-6)
    assert main(["refine", path, "-o", str(tmp_path / "fine.pts"), "--unit", "cm"]) == 0
    assert main(["refine", path, "-o", str(tmp_path / "fine.pts"), "--format", "opencarp"]) == 2
    assert main(["check", path, "--purpose", "electrophysiology"]) == 2
    assert main(["convert", path, str(tmp_path / "plain.inp")]) == 0
    assert "--unit cm" in capsys.readouterr().out


def test_a_wall_of_more_than_a_litre_is_no_heart(tmp_path: Path) -> None:
    mesh = fp.read_mesh(write(tmp_path / "large.vtk", 2.5))
    with pytest.raises(fp.InputError, match="volume of"):
        fp.write_mesh(mesh, tmp_path / "large.pts")


def test_a_block_is_taken_to_be_in_mm_and_written_in_any_unit(tmp_path: Path) -> None:
    block = slab("tetra", size=(10.0, 5.0, 3.0)).mesh
    block = in_millimetres(VolumeMesh(block.points, block.cells, np.ones(block.n_cells)))
    assert any("to be in mm" in one["what"] for one in block.info["notices"])
    fp.write_mesh(block, tmp_path / "block.pts")
    assert np.loadtxt(tmp_path / "block.pts", skiprows=1).max() == pytest.approx(1e3 * block.points.max())


@pytest.mark.parametrize(
    ("name", "head", "unit"),
    [
        ("heart.feb", ("<Mesh>", "<Module type='solid'><units>CGS</units></Module><Mesh>"), "cm"),
        (
            "heart.k",
            ("*KEYWORD\n", "*KEYWORD\n*CONTROL_UNITS\n$ length, time, mass\n        cm       sec        kg\n"),
            "cm",
        ),
    ],
)
def test_a_unit_that_the_file_states_counts(name: str, head: tuple[str, str], unit: str, tmp_path: Path) -> None:
    path = fp.write_mesh(scaled(0.1), tmp_path / name)[0]
    text = path.read_text().replace("femprep volume mesh; length mm", "a mesh")
    assert head[0] in text
    path.write_text(text.replace(*head, 1))
    mesh = fp.read_mesh(path)
    assert mesh.info[UNIT] == {"unit": unit, "by": "statement"}
    np.testing.assert_allclose(across(mesh), across(scaled(1.0)), rtol=1e-6)
    with pytest.raises(fp.FemprepError, match="states lengths in cm"):
        fp.read_mesh(path, unit="m")


def test_a_mesh_of_femprep_is_in_mm_without_a_word(tmp_path: Path) -> None:
    mouse = replace(scaled(0.1), info={"mesher": "sweep"})
    for name in ("heart.vtu", "heart.inp", "heart.msh", "heart.med"):
        back = fp.read_mesh(fp.write_mesh(mouse, tmp_path / name)[0])
        assert not back.info.get("notices")
        np.testing.assert_allclose(across(back), across(mouse), rtol=1e-9)
        fp.write_mesh(back, tmp_path / "heart.pts")


def test_a_unit_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(fp.OptionError, match="expected auto, mm"):
        fp.read_mesh(write(tmp_path / "heart.vtk", 1.0), unit="inch")
