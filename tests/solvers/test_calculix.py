"""CalculiX solves what we write: the reactions tell whether nodes, faces, sets and orientation are right."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from meshes import mixed, truncated_ellipsoid
from solver_tools import calculix_results, pressure_loads, run_calculix

from femprep.export import write_mesh
from femprep.export.deck.names import facet_nodes
from femprep.mesh.elements import ELEMENTS
from femprep.model import FACET_TAGS, VolumeMesh

pytestmark = pytest.mark.solver

KPA = 1e-3  # of a deck in mm, N and MPa


def solved(mesh: VolumeMesh, folder: Path, **changes: object) -> tuple[np.ndarray, np.ndarray]:
    write_mesh(mesh, folder / "lv.inp", step="inflation", **changes)
    result = run_calculix(folder / "lv.inp")
    assert result.returncode == 0, result.stdout[-2000:]
    assert "WARNING" not in result.stdout, result.stdout[-2000:]
    return calculix_results(folder / "lv.dat")


def expected_reaction(mesh: VolumeMesh, pressure: float = KPA) -> np.ndarray:
    """Minus the forces on all nodes that are free; those on held nodes go straight into the support."""
    loads = pressure_loads(mesh, pressure)
    loads[facet_nodes(mesh, FACET_TAGS["base"])] = 0.0
    return -loads.sum(axis=0)


@pytest.mark.parametrize("kind", [*ELEMENTS, "mixed"])
def test_total_reaction_on_the_base_balances_the_pressure(kind: str, tmp_path: Path) -> None:
    mesh = mixed() if kind == "mixed" else truncated_ellipsoid(kind)
    reaction, displacement = solved(mesh, tmp_path)
    wanted = expected_reaction(mesh)
    assert np.all(np.abs(wanted) > 1e-4)  # no component is zero by symmetry
    assert np.abs(reaction - wanted).max() <= 1e-6 * np.linalg.norm(wanted)
    assert len(displacement) == len(mesh.points)
    assert np.abs(displacement[facet_nodes(mesh, FACET_TAGS["base"])]).max() == 0.0
    assert 0.05 < np.linalg.norm(displacement, axis=1).max() < 5.0


def test_reaction_is_p_a_n_over_three_on_plane_triangles(tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra", heights=8, around=24, layers=3)
    reaction, _ = solved(mesh, tmp_path)
    endo = mesh.facets["triangle"][mesh.facet_tag == FACET_TAGS["endo"]]
    a, b, c = (mesh.points[endo[:, i]] for i in range(3))
    force = -KPA * np.cross(b - a, c - a) / 2 / 3
    free = ~np.isin(endo, facet_nodes(mesh, FACET_TAGS["base"]))
    wanted = -(force * free.sum(axis=1)[:, None]).sum(axis=0)
    assert np.abs(reaction - wanted).max() <= 1e-6 * np.linalg.norm(wanted)


@pytest.mark.parametrize(("unit", "length", "force"), [("cm", 0.1, 1e5), ("m", 1e-3, 1.0)])
def test_units_change_numbers_not_physics(unit: str, length: float, force: float, tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra")
    reaction, displacement = solved(mesh, tmp_path, length_unit=unit)
    (tmp_path / "mm").mkdir()
    reaction_mm, displacement_mm = solved(mesh, tmp_path / "mm")
    np.testing.assert_allclose(displacement, displacement_mm * length, rtol=2e-6, atol=1e-9 * length)
    np.testing.assert_allclose(reaction, reaction_mm * force, rtol=1e-6)


def test_deck_without_a_step_is_a_mesh_alone(tmp_path: Path) -> None:
    write_mesh(truncated_ellipsoid("tetra"), tmp_path / "lv.inp")
    text = (tmp_path / "lv.inp").read_text()
    assert "*STEP" not in text
    assert "*MATERIAL" not in text


@pytest.mark.parametrize("kind", ["tetra", "wedge", "hexahedron"])
def test_flipped_element_makes_it_fail(kind: str, tmp_path: Path) -> None:
    mesh = truncated_ellipsoid(kind)
    block = np.array(mesh.cells[kind])
    half = ELEMENTS[kind].nodes // 2
    swap = [0, 2, 1, 3] if kind == "tetra" else [*range(half, 2 * half), *range(half)]
    block[7] = block[7][swap]
    broken = replace(mesh, cells={kind: block})
    write_mesh(broken, tmp_path / "lv.inp", step="inflation")
    result = run_calculix(tmp_path / "lv.inp")
    assert result.returncode == 201
    assert "nonpositive jacobian" in result.stdout


def test_surface_on_the_wrong_face_is_noticed(tmp_path: Path) -> None:
    """The oracle itself can fail: one wrong face label breaks the balance."""
    mesh = truncated_ellipsoid("tetra")
    write_mesh(mesh, tmp_path / "lv.inp", step="inflation")
    deck = tmp_path / "lv.inp"
    head, tail = deck.read_text().split("*SURFACE, NAME=endo, TYPE=ELEMENT\n")
    line, rest = tail.split("\n", 1)
    other = {"1": "2", "2": "3", "3": "4", "4": "1"}[line[-1]]
    deck.write_text(f"{head}*SURFACE, NAME=endo, TYPE=ELEMENT\n{line[:-1]}{other}\n{rest}")
    assert run_calculix(deck).returncode == 0
    reaction, _ = calculix_results(tmp_path / "lv.dat")
    wanted = expected_reaction(mesh)
    assert np.abs(reaction - wanted).max() > 1e-4 * np.linalg.norm(wanted)
