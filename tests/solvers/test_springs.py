"""Springs of the pericardium in CalculiX and dolfinx: forces of base, springs and pressure balance."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from meshes import APEX_HEIGHT, BASE_HEIGHT, truncated_ellipsoid
from solver_tools import (
    calculix_results,
    pressure_loads,
    require_program,
    require_system_module,
    run_calculix,
    run_system_python,
)

import femprep as fp
from femprep.export.abaqus.calculix import inflate
from femprep.export.deck.names import facet_nodes
from femprep.mesh.elements import ELEMENTS
from femprep.model import FACET_TAGS

pytestmark = pytest.mark.solver

KPA = 1e-3  # of a deck in mm, N and MPa; 1 kPa/mm as well
HERE = Path(__file__).parent


def held(kind: str, stiffness: float, **changes: int) -> fp.VolumeMesh:
    mesh = truncated_ellipsoid(kind, **changes)
    height = (mesh.points[:, 2] - APEX_HEIGHT) / (BASE_HEIGHT - APEX_HEIGHT)
    return fp.add_pericardium(mesh.with_data(point={"apicobasal": height}), stiffness=stiffness)


def spring_forces(mesh: fp.VolumeMesh, displacement: np.ndarray) -> np.ndarray:
    """Forces ``(n, 3)`` of the springs on the wall: minus k A n (n . u), at all points but those of the base."""
    names = ("pericardium", "pericardium_area", "pericardium_normal")
    stiffness, area, normal = (np.asarray(mesh.point_data[name]) for name in names)
    size = stiffness * area * KPA * np.sum(normal * displacement, axis=1)
    size[facet_nodes(mesh, FACET_TAGS["base"])] = 0.0
    return -size[:, None] * normal


def free_loads(mesh: fp.VolumeMesh) -> np.ndarray:
    loads = pressure_loads(mesh, KPA)
    loads[facet_nodes(mesh, FACET_TAGS["base"])] = 0.0
    return loads


@pytest.mark.parametrize("kind", list(ELEMENTS))
@pytest.mark.parametrize("unit", ["mm", "cm"])
def test_calculix_balances_base_springs_and_pressure(kind: str, unit: str, tmp_path: Path) -> None:
    mesh = held(kind, 0.5)
    per_mm, per_newton = {"mm": (1.0, 1.0), "cm": (0.1, 1e5)}[unit]
    fp.write_mesh(mesh, tmp_path / "lv.inp", step="inflation", length_unit=unit)
    result = run_calculix(tmp_path / "lv.inp")
    assert result.returncode == 0, result.stdout[-2000:]
    assert "WARNING" not in result.stdout
    reaction, displacement = calculix_results(tmp_path / "lv.dat")
    springs = spring_forces(mesh, displacement / per_mm).sum(axis=0)
    pressure = free_loads(mesh).sum(axis=0)
    assert np.abs(reaction / per_newton + springs + pressure).max() <= 1e-6 * np.linalg.norm(pressure)
    assert np.linalg.norm(springs) > 0.1 * np.linalg.norm(pressure)  # and they do hold it
    fp.write_mesh(truncated_ellipsoid(kind), tmp_path / "free.inp", step="inflation", length_unit=unit)
    assert run_calculix(tmp_path / "free.inp").returncode == 0
    _, free = calculix_results(tmp_path / "free.dat")
    assert np.linalg.norm(displacement, axis=1).max() < 0.9 * np.linalg.norm(free, axis=1).max()


def test_inflation_that_is_checked_knows_the_springs() -> None:
    """``--solve ccx`` holds base and springs together against the pressure."""
    require_program("ccx")
    free, springs = (inflate(mesh)[0] for mesh in (truncated_ellipsoid("tetra"), held("tetra", 0.5)))
    assert free.converged
    assert springs.converged
    assert springs.reaction_misfit is not None
    assert springs.reaction_misfit <= 1e-6
    assert springs.greatest_displacement_mm < 0.9 * free.greatest_displacement_mm


def test_springs_are_linear_where_the_wall_is_not(tmp_path: Path) -> None:
    """Large deformations: the pressure follows the wall, the springs stay where they were."""
    mesh = held("tetra", 0.5)
    fp.write_mesh(mesh, tmp_path / "lv.inp", step="inflation", material="neo-hookean")
    with (tmp_path / "lv.inp").open("a") as deck:  # CalculiX' pressure lags an iteration; held, it comes to rest
        deck.write(
            "*STEP, NLGEOM=YES, INC=100\n*STATIC\n0.1, 1., 0.001, 0.1\n*NODE PRINT, NSET=base, TOTALS=ONLY\nRF\n"
        )
        deck.write("*NODE PRINT, NSET=NALL\nU\n*END STEP\n")
    assert run_calculix(tmp_path / "lv.inp").returncode == 0
    reaction, displacement = calculix_results(tmp_path / "lv.dat")
    pressure = free_loads(replace(mesh, points=mesh.points + displacement)).sum(axis=0)
    left = reaction + spring_forces(mesh, displacement).sum(axis=0) + pressure
    assert np.abs(left).max() <= 2e-6 * np.linalg.norm(pressure)


@pytest.mark.slow
def test_dolfinx_balances_and_tends_to_calculix(tmp_path: Path) -> None:
    """The same field as a Robin term: facet normals there, springs at points here; they meet on finer meshes."""
    require_system_module("dolfinx")
    off = []
    for number, fineness in enumerate(({"heights": 4, "around": 12}, {"heights": 8, "around": 24})):
        folder = tmp_path / str(number)
        folder.mkdir()
        mesh = held("tetra", 0.5, **fineness)
        fp.write_mesh(mesh, folder / "mesh.xdmf", format="dolfinx")
        with h5py.File(folder / "mesh.h5") as store:
            np.save(folder / "pericardium.npy", store["point_data/pericardium"][()].ravel() * KPA)
        text = run_system_python(HERE / "dolfinx_inflation.py", folder, "mesh.xdmf", "0.001", "0.03", "0.4")
        found = json.loads(next(line for line in text.splitlines() if line.startswith("RESULT"))[7:])
        base, springs, pressure = (np.array(found["forces"][name]) for name in ("base", "springs", "pressure"))
        # Of the whole pressure, that on the base's rim too, which goes straight into the support.
        assert np.abs(base + springs + pressure).max() <= 1e-6 * np.linalg.norm(pressure)
        assert np.linalg.norm(springs) > 0.1 * np.linalg.norm(pressure)
        fp.write_mesh(mesh, folder / "lv.inp", step="inflation")
        assert run_calculix(folder / "lv.inp").returncode == 0
        _, displacement = calculix_results(folder / "lv.dat")
        off.append(abs(found["greatest"] / np.linalg.norm(displacement, axis=1).max() - 1))
    assert off[0] < 0.1
    assert off[1] < 0.6 * off[0]
