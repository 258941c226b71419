"""A real left ventricle, from the label map to the solvers: what comes out of the main job is what they solve."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from solver_tools import calculix_results, pressure_loads, run_calculix

from femprep import add_fibres, mesh_segmentation, read_segmentation
from femprep.export import read_mesh, write_format, write_mesh
from femprep.export.deck.names import facet_nodes
from femprep.model import FACET_TAGS, VolumeMesh

pytestmark = [pytest.mark.data, pytest.mark.solver, pytest.mark.slow]


@pytest.fixture(scope="module")
def mesh(data: Path) -> VolumeMesh:
    found = sorted(data.glob("acdc/training/patient007/*frame01_gt.nii.gz"))
    if not found:
        pytest.skip("the ACDC maps are not there")
    seg = read_segmentation(found[0], preset="acdc")
    run = mesh_segmentation(seg, volume={"edge_length": 4.0}, preset="acdc")
    return add_fibres(run.mesh)


@pytest.mark.parametrize("material", ["linear", "orthotropic"])
def test_reaction_on_the_base_balances_the_pressure(mesh: VolumeMesh, material: str, tmp_path: Path) -> None:
    write_mesh(mesh, tmp_path / "lv.inp", step="inflation", material=material)
    result = run_calculix(tmp_path / "lv.inp")
    assert result.returncode == 0, result.stdout[-2000:]
    reaction, displacement = calculix_results(tmp_path / "lv.dat")
    loads = pressure_loads(mesh, 1e-3)
    loads[facet_nodes(mesh, FACET_TAGS["base"])] = 0.0
    wanted = -loads.sum(axis=0)
    assert np.abs(reaction - wanted).max() <= 1e-6 * np.linalg.norm(wanted)
    assert 0.5 < np.linalg.norm(displacement, axis=1).max() < 20.0


@pytest.mark.parametrize(
    ("format", "name"),
    [
        ("vtu", "mesh.vtu"),
        ("abaqus", "mesh.inp"),
        ("dolfinx", "dolfinx/mesh.xdmf"),
        ("gmsh41", "mesh41.msh"),
        ("med", "mesh.med"),
    ],
)
def test_fibres_and_tags_come_back(mesh: VolumeMesh, format: str, name: str, tmp_path: Path) -> None:
    write_format(mesh, tmp_path, format)
    back = read_mesh(tmp_path / name)
    assert np.abs(back.points - mesh.points).max() <= 1e-13
    assert np.array_equal(back.cells["tetra"], mesh.cells["tetra"])
    assert back.facet_names == mesh.facet_names
    assert [np.sum(back.facet_tag == t) for t in mesh.facet_names.values()] == [
        np.sum(mesh.facet_tag == t) for t in mesh.facet_names.values()
    ]
    assert np.abs(np.asarray(back.cell_data["fiber"]) - np.asarray(mesh.cell_data["fiber"])).max() <= 1e-15
