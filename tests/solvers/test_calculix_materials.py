"""CalculiX on a neo-Hookean and on an orthotropic wall: large deformations balance, and the fibres decide."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from meshes import truncated_ellipsoid, with_fibres
from solver_tools import calculix_results, pressure_loads, run_calculix

from femprep.errors import InputError
from femprep.export import write_mesh
from femprep.export.deck.fibres import directions
from femprep.export.deck.material import orthotropic
from femprep.export.deck.names import facet_nodes
from femprep.model import FACET_TAGS, VolumeMesh
from femprep.options import ExportOptions

pytestmark = pytest.mark.solver

KPA = 1e-3

#: A second step at constant load. CalculiX takes the pressure on the wall as it was one iteration before, and stops
#: where that changes little; holding the load lets the two come together.
HOLD = """*STEP, NLGEOM=YES, INC=100
*STATIC
0.1, 1., 0.001, 0.1
*NODE PRINT, NSET=base, TOTALS=ONLY
RF
*NODE PRINT, NSET=NALL
U
*END STEP
"""


def solved(mesh: VolumeMesh, folder: Path, hold: str = "", **changes: object) -> tuple[np.ndarray, np.ndarray]:
    write_mesh(mesh, folder / "lv.inp", step="inflation", **changes)
    with (folder / "lv.inp").open("a") as deck:
        deck.write(hold)
    result = run_calculix(folder / "lv.inp")
    assert result.returncode == 0, result.stdout[-2000:]
    return calculix_results(folder / "lv.dat")


@pytest.mark.parametrize("kind", ["tetra", pytest.param("tetra10", marks=pytest.mark.slow), "wedge", "hexahedron"])
def test_neo_hookean_balances_the_pressure_on_the_deformed_wall(kind: str, tmp_path: Path) -> None:
    mesh = truncated_ellipsoid(kind)
    reaction, displacement = solved(mesh, tmp_path, HOLD, material="neo-hookean", pressure=2.0)
    deformed = replace(mesh, points=mesh.points + displacement)
    base = facet_nodes(mesh, FACET_TAGS["base"])

    def balance(state: VolumeMesh) -> np.ndarray:
        loads = pressure_loads(state, 2.0 * KPA)
        loads[base] = 0.0
        return -loads.sum(axis=0)

    wanted = balance(deformed)
    assert np.abs(reaction - wanted).max() <= 2e-6 * np.linalg.norm(wanted)
    # The pressure follows the wall: the reaction of the undeformed state is another one.
    assert np.abs(reaction - balance(mesh)).max() > 0.02 * np.linalg.norm(wanted)


def test_neo_hookean_tends_to_linear_as_the_pressure_falls(tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra")
    errors = []
    for pressure in (0.04, 0.02):
        _, soft = solved(mesh, tmp_path, material="neo-hookean", pressure=pressure)
        _, linear = solved(mesh, tmp_path, material="linear", pressure=pressure)
        errors.append(np.abs(soft - linear).max() / np.abs(linear).max())
    assert errors[1] < 0.02
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)  # the difference is of first order in the pressure


def test_orthotropic_wall_agrees_with_scikit_fem(tmp_path: Path) -> None:
    mesh = with_fibres(truncated_ellipsoid("tetra"))
    _, displacement = solved(mesh, tmp_path, material="orthotropic", fibre_stiffness=5.0)
    wanted = orthotropic_displacement(mesh, ExportOptions(fibre_stiffness=5.0))
    greatest = np.abs(wanted).max()
    assert np.abs(displacement - wanted).max() <= 1e-6 * greatest
    # Without the fibres' directions, or with fibres along the coordinate axis, the answer is another one.
    along_x = mesh.with_data(
        cell={"fiber": np.tile([1.0, 0, 0], (mesh.n_cells, 1)), "sheet": np.tile([0, 1.0, 0], (mesh.n_cells, 1))}
    )
    _, other = solved(along_x, tmp_path, material="orthotropic", fibre_stiffness=5.0)
    assert np.abs(other - wanted).max() > 0.1 * greatest
    assert (
        np.abs(other - orthotropic_displacement(along_x, ExportOptions(fibre_stiffness=5.0))).max() <= 1e-6 * greatest
    )


def test_reversed_and_turned_fibres(tmp_path: Path) -> None:
    """A fibre has no sign, but an angle: reversing changes nothing, the mirrored helix does."""
    mesh = with_fibres(truncated_ellipsoid("tetra"))
    _, first = solved(mesh, tmp_path, material="orthotropic")
    reversed_ = mesh.with_data(cell={"fiber": -np.asarray(mesh.cell_data["fiber"])})
    _, second = solved(reversed_, tmp_path, material="orthotropic")
    np.testing.assert_allclose(second, first, rtol=1e-5, atol=1e-6 * np.abs(first).max())
    mirrored = np.asarray(mesh.cell_data["fiber"]) * [1.0, 1.0, -1.0]
    _, third = solved(mesh.with_data(cell={"fiber": mirrored}), tmp_path, material="orthotropic")
    assert np.abs(third - first).max() > 0.05 * np.abs(first).max()


def test_orthotropic_material_without_fibres_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="needs fibres"):
        write_mesh(truncated_ellipsoid("tetra"), tmp_path / "lv.inp", step="inflation", material="orthotropic")


def orthotropic_displacement(mesh: VolumeMesh, options: ExportOptions) -> np.ndarray:
    """Displacements ``(n, 3)``, mm, of linear tetrahedra with the same moduli, assembled here by scikit-fem."""
    skfem = pytest.importorskip("skfem")
    from skfem.helpers import sym_grad

    m = orthotropic(options)
    compliance = np.zeros((6, 6))
    compliance[:3, :3] = [
        [1 / m.e1, -m.nu12 / m.e1, -m.nu13 / m.e1],
        [-m.nu12 / m.e1, 1 / m.e2, -m.nu23 / m.e2],
        [-m.nu13 / m.e1, -m.nu23 / m.e2, 1 / m.e3],
    ]
    compliance[3:, 3:] = np.diag([1 / m.g12, 1 / m.g13, 1 / m.g23])
    stiffness = np.linalg.inv(compliance) * KPA
    pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
    tensor = np.zeros((3, 3, 3, 3))
    for a, (i, j) in enumerate(pairs):
        for b, (k, n) in enumerate(pairs):
            for p, q in {(i, j), (j, i)}:
                for r, s in {(k, n), (n, k)}:
                    tensor[p, q, r, s] = stiffness[a, b]
    found = directions(mesh)
    assert found is not None
    frame = np.stack([*found, np.cross(*found)], axis=1)  # rows: fibre, sheet, normal
    turned = np.einsum("ijkl,eip,ejq,ekr,els->pqrse", tensor, frame, frame, frame, frame, optimize=True)

    grid = skfem.MeshTet(mesh.points.T.copy(), mesh.cells["tetra"].T.copy(), sort_t=False)
    basis = skfem.Basis(grid, skfem.ElementVector(skfem.ElementTetP1()))

    @skfem.BilinearForm
    def form(u, v, _):  # type: ignore[no-untyped-def]
        return np.einsum("ijklm,ijmq,klmq->mq", turned, sym_grad(v), sym_grad(u))

    matrix = form.assemble(basis)
    load = np.zeros(basis.N)
    load[basis.nodal_dofs.T.ravel()] = pressure_loads(mesh, options.pressure * KPA).ravel()
    held = basis.nodal_dofs[:, facet_nodes(mesh, FACET_TAGS["base"])].ravel()
    solution = skfem.solve(*skfem.condense(matrix, load, D=held))
    return np.asarray(solution[basis.nodal_dofs].T)
