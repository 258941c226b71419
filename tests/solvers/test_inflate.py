"""``--solve ccx``: a mesh inflated by the deck that is written; the reaction tells a wrong deck from a right one."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from meshes import mixed, truncated_ellipsoid
from solver_tools import pressure_loads, require_program

from femprep.errors import MissingDependencyError, OptionError
from femprep.export.abaqus import calculix
from femprep.export.abaqus.calculix import inflate
from femprep.export.abaqus.loads import pressure_loads as own_loads
from femprep.mesh.elements import ELEMENTS
from femprep.options import ExportOptions, Options
from femprep.preflight import check_options

KINDS = [*ELEMENTS, "mixed"]


def body(kind: str):
    return mixed() if kind == "mixed" else truncated_ellipsoid(kind)


@pytest.mark.parametrize("kind", KINDS)
def test_forces_of_a_pressure_are_those_written_from_the_shape_functions(kind: str) -> None:
    mesh = body(kind)
    found = own_loads(mesh.points, calculix._pressed(mesh), 1e-3)
    wanted = pressure_loads(mesh, 1e-3)
    assert np.abs(wanted).max() > 1e-6
    np.testing.assert_allclose(found, wanted, atol=1e-8 * np.abs(wanted).max())


@pytest.mark.solver
@pytest.mark.parametrize("kind", KINDS)
def test_reaction_balances_the_pressure_and_the_cavity_grows(kind: str) -> None:
    require_program("ccx")
    solution = inflate(body(kind))
    assert solution.solved
    assert solution.failure is None
    assert solution.pressure_kpa == 1.0
    assert solution.reaction_misfit <= 1e-6
    assert 0.05 < solution.greatest_displacement_mm < 5.0
    assert 1.0 < solution.cavity_ml / solution.cavity_rest_ml < 1.5


@pytest.mark.solver
def test_large_deformations_are_balanced_on_the_moved_wall() -> None:
    require_program("ccx")
    solution = inflate(truncated_ellipsoid("hexahedron"), ExportOptions(material="neo-hookean"))
    assert solution.solved
    assert solution.reaction_misfit <= 1e-3


@pytest.mark.solver
def test_inverted_element_is_told_and_not_solved() -> None:
    require_program("ccx")
    mesh = truncated_ellipsoid("tetra")
    block = np.array(mesh.cells["tetra"])
    block[7] = block[7][[0, 2, 1, 3]]
    solution = inflate(replace(mesh, cells={"tetra": block}))
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
    solution = inflate(truncated_ellipsoid("tetra"))
    assert solution.converged
    assert not solution.solved
    assert "misses the load" in solution.failure


def test_program_that_is_missing_is_told_before_any_meshing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(MissingDependencyError, match="calculix-ccx"):
        check_options(Options(solve="ccx"))


def test_mesh_without_a_base_is_refused_before_any_meshing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: "/usr/bin/ccx")
    with pytest.raises(OptionError, match="needs facets tagged base and endo"):
        check_options(Options(anatomy="whole-heart", solve="ccx"))
