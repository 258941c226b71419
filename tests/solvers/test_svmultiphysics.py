"""svMultiPhysics solves what we write: displacements at every point beside CalculiX'.

It writes no reactions; where displacements agree at every point with those of CalculiX, whose reactions balance, so do
its own. The linear material is that of small displacements in both, the neo-Hookean energy the same.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from built_programs import run_svmultiphysics
from meshes import APEX_HEIGHT, BASE_HEIGHT, mixed, truncated_ellipsoid, with_fibres
from solver_tools import calculix_large, calculix_results, run_calculix

import femprep as fp
from femprep.export import write_mesh
from femprep.model import VolumeMesh

pytestmark = pytest.mark.solver

#: How far displacements may lie apart, as a share of the greatest: integration is not the same in every element.
APART = {"tetra": 1e-6, "tetra10": 1e-3, "hexahedron": 1e-6, "hexahedron20": 1e-5}


def inflated(mesh: VolumeMesh, folder: Path, **changes: object) -> np.ndarray:
    write_mesh(mesh, folder / "lv", format="svmultiphysics", step="inflation", **changes)
    return run_svmultiphysics(folder / "lv")[1]


@pytest.mark.parametrize("kind", list(APART))
def test_linear_deck(kind: str, tmp_path: Path) -> None:
    mesh = truncated_ellipsoid(kind)
    found = inflated(mesh, tmp_path)
    write_mesh(mesh, tmp_path / "lv.inp", step="inflation")
    assert run_calculix(tmp_path / "lv.inp").returncode == 0
    _, wanted = calculix_results(tmp_path / "lv.dat")
    greatest = np.linalg.norm(wanted, axis=1).max()
    assert greatest > 1.0
    assert np.abs(found - wanted).max() <= APART[kind] * greatest


@pytest.mark.parametrize("fibres", [False, True], ids=["plain", "fibres"])
@pytest.mark.parametrize("kind", [kind for kind in APART if kind != "hexahedron20"])
def test_neo_hookean_deck(kind: str, fibres: bool, tmp_path: Path) -> None:
    mesh = truncated_ellipsoid(kind)
    found = inflated(with_fibres(mesh) if fibres else mesh, tmp_path, material="neo-hookean")
    _, wanted = calculix_large(mesh, tmp_path, material="neo-hookean")
    assert np.abs(found - wanted).max() <= APART[kind] * np.linalg.norm(wanted, axis=1).max()


@pytest.mark.parametrize("unit", ["cm", "m"])
def test_units_change_numbers_not_physics(unit: str, tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra")
    wanted = inflated(mesh, tmp_path, material="neo-hookean")
    (tmp_path / unit).mkdir()
    found = inflated(mesh, tmp_path / unit, material="neo-hookean", length_unit=unit)
    assert np.abs(found / {"cm": 0.1, "m": 1e-3}[unit] - wanted).max() <= 1e-6 * np.abs(wanted).max()


def test_pericardium_is_that_of_calculix_on_finer_meshes(tmp_path: Path) -> None:
    """A Robin condition on facets there, springs at points here: they meet on finer meshes."""
    off = []
    for number, fineness in enumerate(({"heights": 4, "around": 12}, {"heights": 8, "around": 24})):
        mesh = truncated_ellipsoid("tetra", **fineness)
        height = (mesh.points[:, 2] - APEX_HEIGHT) / (BASE_HEIGHT - APEX_HEIGHT)
        held = fp.add_pericardium(mesh.with_data(point={"apicobasal": height}), stiffness=0.5)
        folder = tmp_path / str(number)
        folder.mkdir()
        found = np.linalg.norm(inflated(held, folder, material="neo-hookean"), axis=1).max()
        _, wanted = calculix_large(held, folder, material="neo-hookean")
        free = np.linalg.norm(calculix_large(mesh, folder, material="neo-hookean")[1], axis=1).max()
        assert found < 0.9 * free
        off.append(abs(found / np.linalg.norm(wanted, axis=1).max() - 1))
    assert off[0] < 0.1
    assert off[1] < 0.6 * off[0]


@pytest.mark.parametrize(
    ("mesh", "changes", "words"),
    [
        (truncated_ellipsoid("wedge"), {}, "elements of one type"),
        (truncated_ellipsoid("wedge15"), {}, "elements of one type"),
        (truncated_ellipsoid("hexahedron20"), {"material": "neo-hookean"}, "on the faces of hexahedron20"),
        (mixed(), {}, "elements of one type"),
        (with_fibres(truncated_ellipsoid("tetra")), {"material": "orthotropic"}, "no orthotropic material"),
    ],
    ids=["wedge", "wedge15", "hexahedron20", "mixed", "orthotropic"],
)
def test_what_it_has_not_is_refused(mesh: VolumeMesh, changes: dict[str, str], words: str, tmp_path: Path) -> None:
    with pytest.raises(fp.InputError, match=words):
        write_mesh(mesh, tmp_path / "lv", format="svmultiphysics", step="inflation", **changes)
    assert list(tmp_path.iterdir()) == []
    write_mesh(mesh, tmp_path / "lv", format="svmultiphysics")  # without a step every mesh is written
