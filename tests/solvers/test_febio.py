"""FEBio solves what we write, to normal termination: displacements beside CalculiX', reactions beside the pressure.

CalculiX' linear material in a step of large displacements is the law of St. Venant and Kirchhoff, as FEBio's isotropic
and orthotropic elastic ones are; the neo-Hookean energy is the same in both decks.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from built_programs import run_febio
from meshes import APEX_HEIGHT, BASE_HEIGHT, mixed, truncated_ellipsoid, with_fibres
from solver_tools import calculix_large, pressure_loads, robin_force

import femprep as fp
from femprep.export import write_mesh
from femprep.export.deck.names import facet_nodes
from femprep.model import FACET_TAGS, VolumeMesh

pytestmark = pytest.mark.solver

KPA = 1e-3  # of a deck in mm, N and MPa
MATERIALS = ("linear", "neo-hookean", "orthotropic")
#: What makes an element of FEBio's CalculiX' one: integration points, and no field of pressures of its own.
SAME = {"tet10": 'elem_type="TET10G4_S3"', "hex8": 'type="elastic-solid"', "penta6": 'type="elastic-solid"'}
#: How far greatest displacements may lie apart where both integrate an element alike, and where they do not: FEBio has
#: six points in a wedge of six nodes, CalculiX two; eight in one of fifteen nodes, CalculiX nine.
APART = {"tetra": 1e-6, "tetra10": 1e-6, "hexahedron": 1e-6, "hexahedron20": 2e-4, "wedge": 0.05, "wedge15": 2e-3}


def held(mesh: VolumeMesh) -> VolumeMesh:
    """With a pericardium of 0.5 kPa/mm at the apex."""
    height = (mesh.points[:, 2] - APEX_HEIGHT) / (BASE_HEIGHT - APEX_HEIGHT)
    return fp.add_pericardium(mesh.with_data(point={"apicobasal": height}), stiffness=0.5)


def inflated(mesh: VolumeMesh, folder: Path, *, same: bool, **changes: object) -> tuple[str, np.ndarray, np.ndarray]:
    """What FEBio says, displacements and reactions; with the integration of CalculiX' elements where asked for."""
    write_mesh(mesh, folder / "lv.feb", step="inflation", **changes)
    if same:
        text = (folder / "lv.feb").read_text()
        for kind, asked in SAME.items():
            if f'type="{kind}"' in text:
                text = text.replace("<SolidDomain ", f"<SolidDomain {asked} ")
        (folder / "lv.feb").write_text(text)
    return run_febio(folder / "lv.feb")


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("kind", list(APART))
def test_greatest_displacement_is_that_of_calculix(kind: str, material: str, tmp_path: Path) -> None:
    mesh = with_fibres(truncated_ellipsoid(kind))
    _, displacement, _ = inflated(mesh, tmp_path, same=True, material=material)
    _, wanted = calculix_large(mesh, tmp_path, material=material)
    greatest = np.linalg.norm(wanted, axis=1).max()
    assert greatest > 1.0
    assert np.linalg.norm(displacement, axis=1).max() == pytest.approx(greatest, rel=APART[kind])
    if APART[kind] <= 1e-6:  # at every point, not in the greatest alone
        assert np.abs(displacement - wanted).max() <= 1e-6 * greatest


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("kind", [*APART, "mixed"])
def test_deck_as_written_is_solved_and_balances(kind: str, material: str, tmp_path: Path) -> None:
    mesh = with_fibres(mixed() if kind == "mixed" else truncated_ellipsoid(kind))
    said, displacement, reaction = inflated(mesh, tmp_path, same=False, material=material)
    assert "ERROR" not in said
    assert "WARNING" not in said.upper().replace("NO WARNING", "")
    base = facet_nodes(mesh, FACET_TAGS["base"])
    assert np.abs(displacement[base]).max() == 0.0
    assert np.abs(np.delete(reaction, base, axis=0)).max() == 0.0
    # The pressure on the deformed wall, that on the rim included.
    loads = pressure_loads(replace(mesh, points=mesh.points + displacement), KPA).sum(axis=0)
    assert np.abs(reaction.sum(axis=0) + loads).max() <= 1e-5 * np.linalg.norm(loads)


def test_without_fibres(tmp_path: Path) -> None:
    """Fibres change nothing where the material has none."""
    mesh = truncated_ellipsoid("tetra")
    _, plain, _ = inflated(mesh, tmp_path, same=False)
    _, fibred, _ = inflated(with_fibres(mesh), tmp_path, same=False)
    assert np.abs(plain - fibred).max() <= 1e-9


@pytest.mark.parametrize("unit", ["cm", "m"])
def test_units_change_numbers_not_physics(unit: str, tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra")
    _, wanted, _ = inflated(mesh, tmp_path, same=False)
    _, found, _ = inflated(mesh, tmp_path, same=False, length_unit=unit)
    length = {"cm": 0.1, "m": 1e-3}[unit]
    assert np.abs(found / length - wanted).max() <= 1e-5 * np.abs(wanted).max()


@pytest.mark.parametrize("sign", [1, -1], ids=["push", "pull"])
@pytest.mark.parametrize("kind", ["tetra", "tetra10", "wedge", "hexahedron", "hexahedron20", "mixed"])
def test_springs_of_the_pericardium_push_and_pull(kind: str, sign: int, tmp_path: Path) -> None:
    """Base, springs and pressure balance: to what FEBio's integration of curved facets differs from the one here."""
    mesh = held(mixed() if kind == "mixed" else truncated_ellipsoid(kind))
    write_mesh(mesh, tmp_path / "lv.feb", step="inflation", material="neo-hookean", pressure=0.5)
    text = (tmp_path / "lv.feb").read_text()
    (tmp_path / "lv.feb").write_text(text.replace('<pressure lc="1">', '<pressure lc="1">' + "-" * (sign < 0)))
    said, displacement, reaction = run_febio(tmp_path / "lv.feb")
    assert "ERROR" not in said
    along = np.sum(np.asarray(mesh.point_data["pericardium_normal"]) * displacement, axis=1)
    assert (sign * along)[np.asarray(mesh.point_data["pericardium"]) > 0].min() > 0.1
    moved = replace(mesh, points=mesh.points + displacement)
    pressure = pressure_loads(moved, sign * 0.5 * KPA).sum(axis=0)
    springs = robin_force(mesh, displacement, np.asarray(mesh.point_data["pericardium"]) * KPA)
    assert np.linalg.norm(springs) > 0.1 * np.linalg.norm(pressure)
    left = np.abs(reaction.sum(axis=0) + springs + pressure).max()
    assert left <= (1e-6 if kind == "tetra" else 1e-3) * np.linalg.norm(pressure)


def test_springs_are_those_of_calculix_on_finer_meshes(tmp_path: Path) -> None:
    """On facets there, at points here: they meet on finer meshes."""
    off = []
    for number, fineness in enumerate(({"heights": 4, "around": 12}, {"heights": 8, "around": 24})):
        mesh = truncated_ellipsoid("tetra", **fineness)
        folder = tmp_path / str(number)
        folder.mkdir()
        _, found, _ = inflated(held(mesh), folder, same=True, material="neo-hookean")
        _, wanted = calculix_large(held(mesh), folder, material="neo-hookean")
        _, free = calculix_large(mesh, folder, material="neo-hookean")
        most, wanted_most, free_most = (np.linalg.norm(u, axis=1).max() for u in (found, wanted, free))
        assert most < 0.9 * free_most
        off.append(abs(most / wanted_most - 1))
    assert off[0] < 0.1
    assert off[1] < 0.6 * off[0]


@pytest.mark.parametrize("unit", ["cm", "m"])
def test_springs_in_other_units(unit: str, tmp_path: Path) -> None:
    mesh = held(truncated_ellipsoid("tetra"))
    _, wanted, _ = inflated(mesh, tmp_path, same=False)
    _, found, _ = inflated(mesh, tmp_path, same=False, length_unit=unit)
    assert np.abs(found / {"cm": 0.1, "m": 1e-3}[unit] - wanted).max() <= 1e-5 * np.abs(wanted).max()


def test_fibres_decide(tmp_path: Path) -> None:
    """The oracle itself can fail: fibres the other way round give another displacement."""
    mesh = with_fibres(truncated_ellipsoid("tetra"))
    _, one, _ = inflated(mesh, tmp_path, same=False, material="orthotropic")
    mirrored = np.asarray(mesh.cell_data["fiber"]) * [1.0, 1.0, -1.0]
    _, other, _ = inflated(mesh.with_data(cell={"fiber": mirrored}), tmp_path, same=False, material="orthotropic")
    assert np.abs(one - other).max() > 0.05 * np.abs(one).max()
