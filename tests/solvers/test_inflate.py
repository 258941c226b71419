"""``--solve ccx``: a mesh inflated by the deck that is written, its reaction, and whether its strains are valid."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
from meshes import mixed, truncated_ellipsoid, with_fibres
from solver_tools import pressure_loads, require_program

from femprep.cli import main
from femprep.errors import InputError, MissingDependencyError, OptionError
from femprep.export import write_mesh
from femprep.export.abaqus import calculix
from femprep.export.abaqus.calculix import inflate
from femprep.export.abaqus.loads import pressure_loads as own_loads
from femprep.export.deck.names import facet_nodes
from femprep.image import write_segmentation
from femprep.mesh.elements import ELEMENTS
from femprep.model import FACET_TAGS, VolumeMesh
from femprep.model.blocks import chosen_rows
from femprep.options import ExportOptions, Options
from femprep.phantoms import lv_ellipsoid
from femprep.preflight import check_options

KINDS = [*ELEMENTS, "mixed"]


def body(kind: str) -> VolumeMesh:
    return mixed() if kind == "mixed" else truncated_ellipsoid(kind)


def two_cavities() -> VolumeMesh:
    """The same wall as if its endocardium were that of two cavities, on either side of x = 0."""
    mesh = truncated_ellipsoid("tetra")
    centres = np.concatenate([mesh.points[block].mean(axis=1) for block in mesh.facets.values()])
    endo = mesh.facet_tag == FACET_TAGS["endo"]
    left = centres[:, 0] < mesh.points[:, 0].mean()
    tag = np.where(endo, np.where(left, FACET_TAGS["endo_lv"], FACET_TAGS["endo_rv"]), mesh.facet_tag)
    return replace(mesh, facet_tag=tag)


@pytest.mark.parametrize("kind", KINDS)
def test_forces_of_a_pressure_are_those_written_from_the_shape_functions(kind: str) -> None:
    mesh = body(kind)
    found = own_loads(mesh.points, chosen_rows(mesh.facets, mesh.facet_tag == FACET_TAGS["endo"]), 1e-3)
    wanted = pressure_loads(mesh, 1e-3)
    assert np.abs(wanted).max() > 1e-6
    np.testing.assert_allclose(found, wanted, atol=1e-8 * np.abs(wanted).max())


@pytest.mark.solver
@pytest.mark.parametrize("kind", KINDS)
def test_reaction_balances_the_pressure_and_the_cavity_grows(kind: str) -> None:
    require_program("ccx")
    solution, inflated = inflate(body(kind))
    assert solution.status == "solved"
    assert solution.reason == ""
    assert solution.reaction_misfit <= 1e-6
    assert 0.05 < solution.greatest_displacement_mm < 5.0
    (cavity,) = solution.cavities
    assert (cavity.name, cavity.pressure_kpa) == ("lv", 1.0)
    assert 1.0 < cavity.inflated_ml / cavity.rest_ml < 1.5
    assert 0.02 < solution.strain <= solution.greatest_strain < 0.15
    assert inflated.n_cells == len(inflated.cell_data["strain"])


@pytest.mark.solver
def test_large_deformations_are_balanced_on_the_moved_wall() -> None:
    require_program("ccx")
    solution, _ = inflate(truncated_ellipsoid("hexahedron"), ExportOptions(material="neo-hookean"))
    assert solution.status == "solved"
    assert solution.reaction_misfit <= 1e-3


@pytest.mark.solver
@pytest.mark.parametrize("pressure", [3.0, 40.0])
def test_strains_beyond_the_material_are_doubtful_and_the_advice_helps(pressure: float) -> None:
    require_program("ccx")
    mesh = truncated_ellipsoid("tetra")
    solution, _ = inflate(mesh, ExportOptions(pressure=pressure))
    assert solution.status == "doubtful"
    assert solution.failure is None
    assert "--pressure" in solution.reason
    assert ("inside out" in solution.reason) == (solution.inverted_elements > 0) == (pressure == 40.0)
    share = float(solution.reason.split("lower --pressure to ")[1].split(" %")[0]) / 100
    lower, _ = inflate(mesh, ExportOptions(pressure=pressure * share))
    assert lower.status == "solved"
    assert lower.strain > 0.8 * lower.strain_limit


@pytest.mark.solver
def test_pressure_beyond_what_a_neo_hookean_wall_holds_fails_with_how_far_it_came() -> None:
    require_program("ccx")
    mesh = truncated_ellipsoid("tetra")
    solution, inflated = inflate(mesh, ExportOptions(material="neo-hookean", pressure=8.0))
    assert solution.status == "failed"
    assert inflated is None
    assert solution.cavities[0].inflated_ml is None
    reached = float(solution.message.split("it came to ")[1].split(" %")[0])
    assert 10 < reached < 100
    lower, _ = inflate(mesh, ExportOptions(material="neo-hookean", pressure=0.9 * 8.0 * reached / 100))
    assert lower.converged


@pytest.mark.solver
def test_each_cavity_has_its_own_pressure() -> None:
    require_program("ccx")
    mesh = two_cavities()
    both, one = inflate(mesh)
    alone, _ = inflate(mesh, ExportOptions(pressure={"lv": 1.5, "rv": 0.5}))
    left, lv = inflate(mesh, ExportOptions(pressure={"lv": 1.0}))
    right, rv = inflate(mesh, ExportOptions(pressure={"rv": 1.0}))
    assert [(c.name, c.pressure_kpa) for c in alone.cavities] == [("lv", 1.5), ("rv", 0.5)]
    assert [c.pressure_kpa for c in left.cavities] == [1.0, 0.0]
    assert all(each.failure is None for each in (both, alone, left, right))
    # Linear: the displacements of both pressures are the sum of those of each.
    moved = [each.point_data["displacement"] for each in (one, lv, rv)]
    np.testing.assert_allclose(moved[0], moved[1] + moved[2], atol=1e-5)
    assert np.abs(moved[1] - moved[2]).max() > 0.1


def test_pressure_of_a_cavity_that_is_not_there_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: "/usr/bin/ccx")
    with pytest.raises(InputError, match="cavities of this mesh are lv"):
        inflate(truncated_ellipsoid("tetra"), ExportOptions(pressure={"rv": 1.0}))
    with pytest.raises(OptionError, match="'rv'"):
        check_options(Options(solve="ccx", export={"pressure": {"rv": 1.0}}))


@pytest.mark.solver
@pytest.mark.parametrize("kind", ["tetra", "hexahedron20"])
def test_fields_of_the_solution_are_read_by_vtk(kind: str, tmp_path: Path) -> None:
    """Strain and stress agree by Hooke's law where strains are small; and the stress is in global axes."""
    require_program("ccx")
    mesh = with_fibres(truncated_ellipsoid(kind))
    # An orthotropic material with the same moduli in all directions: its fibres must not matter.
    options = ExportOptions(pressure=1e-3, material="orthotropic", fibre_stiffness=1.0)
    solution, inflated = inflate(mesh, options)
    write_mesh(inflated, tmp_path / "solution.vtu")
    grid = pv.read(tmp_path / "solution.vtu")
    moved = np.asarray(grid.point_data["displacement"])
    assert np.linalg.norm(moved, axis=1).max() == pytest.approx(solution.greatest_displacement_mm)
    assert np.abs(moved[facet_nodes(mesh, FACET_TAGS["base"])]).max() == 0.0
    np.testing.assert_allclose(grid.points, mesh.points)
    strain, stress = (np.asarray(grid.cell_data[name]).reshape(-1, 3, 3) for name in ("strain", "stress"))
    young, nu = options.young_modulus, options.poisson_ratio
    trace = np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    wanted = young / (1 + nu) * (strain + nu / (1 - 2 * nu) * trace)
    np.testing.assert_allclose(stress, wanted, atol=1e-5 * np.abs(wanted).max())
    np.testing.assert_allclose(grid.cell_data["principal_strain"].max(), solution.greatest_strain)


@pytest.mark.solver
def test_strain_of_large_deformations_is_that_of_the_displacement() -> None:
    """Green-Lagrange strain, whose principal values are those that VTK finds from the displacement alone."""
    require_program("ccx")
    _, inflated = inflate(truncated_ellipsoid("tetra"), ExportOptions(material="neo-hookean", pressure=2.0))
    green = np.linalg.eigvalsh(inflated.cell_data["strain"].reshape(-1, 3, 3))
    largest = np.abs(np.sqrt(1 + 2 * green) - 1).max(axis=1)
    assert largest.max() > 0.1
    np.testing.assert_allclose(inflated.cell_data["principal_strain"], largest, atol=1e-5)


@pytest.mark.solver
def test_inverted_element_is_told_and_not_solved() -> None:
    require_program("ccx")
    mesh = truncated_ellipsoid("tetra")
    block = np.array(mesh.cells["tetra"])
    block[7] = block[7][[0, 2, 1, 3]]
    solution, _ = inflate(replace(mesh, cells={"tetra": block}))
    assert not solution.converged
    assert "nonpositive jacobian" in solution.message
    assert "CalculiX did not solve" in solution.failure


@pytest.mark.solver
def test_deck_whose_pressure_lies_on_a_wrong_face_is_told_by_the_reaction(monkeypatch: pytest.MonkeyPatch) -> None:
    require_program("ccx")

    def write_wrong(mesh, folder: Path, stem: str, options) -> None:
        written(mesh, folder, stem, options)
        deck = folder / f"{stem}.inp"
        head, tail = deck.read_text().split("*SURFACE, NAME=endo, TYPE=ELEMENT\n")
        line, rest = tail.split("\n", 1)
        other = {"1": "2", "2": "3", "3": "4", "4": "1"}[line[-1]]
        deck.write_text(f"{head}*SURFACE, NAME=endo, TYPE=ELEMENT\n{line[:-1]}{other}\n{rest}")

    written = calculix.write
    monkeypatch.setattr(calculix, "write", write_wrong)
    solution, _ = inflate(truncated_ellipsoid("tetra"))
    assert solution.converged
    assert solution.status == "failed"
    assert "misses the load" in solution.failure


def test_program_that_is_missing_is_told_before_any_meshing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(MissingDependencyError, match="calculix-ccx"):
        check_options(Options(solve="ccx"))


def test_mesh_without_a_base_is_refused_before_any_meshing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: "/usr/bin/ccx")
    with pytest.raises(OptionError, match="needs facets tagged base and endo"):
        check_options(Options(anatomy="whole-heart", solve="ccx"))


@pytest.mark.solver
@pytest.mark.parametrize(("pressure", "status"), [(0.5, "solved"), (4.0, "doubtful")])
def test_folder_of_a_run_shows_the_solution(
    pressure: float, status: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    require_program("ccx")
    write_segmentation(lv_ellipsoid().segmentation(spacing=(2.0, 2.0, 8.0)), tmp_path / "heart.nii.gz")
    command = ["mesh", str(tmp_path / "heart.nii.gz"), "--preset", "acdc", "-o", str(tmp_path / "out")]
    deck = ["--solve", "ccx", "--pressure", f"lv={pressure}"]
    # Neither status fails the run: the mesh is good.
    assert main([*command, "--mesher", "sweep", "--edge-length", "7", "--vertices", "300", *deck]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    solution = record["solution"]
    assert solution["status"] == status
    assert f"linear: {status}" in shown
    assert [cavity["pressure_kpa"] for cavity in solution["cavities"]] == [pressure]
    assert solution["cavities"][0]["inflated_ml"] > solution["cavities"][0]["rest_ml"] > 50
    assert "solution.vtu" in record["files"]
    page = (tmp_path / "out" / "report.html").read_text()
    assert 'id="solution"' in page
    assert (solution["reason"] in record["notices"]) == (status == "doubtful")
    # At the top of the page and beside the cavities.
    assert page.count('<span class="light amber"></span> ') == (2 if status == "doubtful" else 0)
