"""Patch tests: every element we write reproduces a linear displacement of its boundary, with one stress."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from meshes import tag_boundary, truncated_ellipsoid
from scipy.spatial import cKDTree
from solver_tools import calculix_results, pressure_loads, run_calculix
from wall_shapes import ellipsoids, plane_z

from femprep.export import write_mesh
from femprep.export.deck.names import facet_nodes
from femprep.mesh.elements import ELEMENTS
from femprep.model import FACET_TAGS, VolumeMesh
from femprep.volume import tetrahedralize
from femprep.volume.refine import refine
from femprep.wall import build_wall

pytestmark = pytest.mark.solver

#: Displacement gradient: no symmetry, all components, small.
GRADIENT = np.array([[0.010, 0.004, -0.006], [-0.002, -0.008, 0.005], [0.007, 0.003, 0.006]])
YOUNG, POISSON = 0.03, 0.4


def patch(kind: str) -> VolumeMesh:
    """An irregular mesh: its inner corners moved about, mid-side nodes in the middle of their edges."""
    mesh = truncated_ellipsoid(kind, heights=3, around=10, layers=3)
    ((_, cells),) = mesh.cells.items()
    points = np.array(mesh.points)
    corners = np.unique(cells[:, : ELEMENTS[kind].corners])
    inner = np.setdiff1d(corners, boundary(mesh))
    points[inner] += np.random.default_rng(1).uniform(-0.3, 0.3, (len(inner), 3))
    if ELEMENTS[kind].quadratic:
        for column, (a, b) in enumerate(ELEMENTS[kind].edges, ELEMENTS[kind].corners):
            points[cells[:, column]] = 0.5 * (points[cells[:, a]] + points[cells[:, b]])
    return replace(mesh, points=points)


def boundary(mesh: VolumeMesh) -> np.ndarray:
    return np.unique(np.concatenate([nodes.ravel() for nodes in mesh.facets.values()]))


def solved(mesh: VolumeMesh, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Displacements of all nodes, and stresses (xx, yy, zz, xy, xz, yz) at all integration points, by CalculiX."""
    write_mesh(mesh, folder / "patch.inp")
    wanted = mesh.points @ GRADIENT.T
    rows = [
        f"{node + 1}, {k + 1}, {k + 1}, {wanted[node, k]:.13e}" for node in boundary(mesh).tolist() for k in range(3)
    ]
    step = ["*MATERIAL, NAME=patch", "*ELASTIC", f"{YOUNG}, {POISSON}", "*SOLID SECTION, ELSET=EALL, MATERIAL=patch"]
    step += ["*STEP", "*STATIC", "*BOUNDARY", *rows, "*NODE PRINT, NSET=NALL", "U"]
    step += ["*EL PRINT, ELSET=EALL", "S", "*END STEP", ""]
    with (folder / "patch.inp").open("a") as deck:
        deck.write("\n".join(step))
    result = run_calculix(folder / "patch.inp")
    assert result.returncode == 0, result.stdout[-2000:]
    text = (folder / "patch.dat").read_text()
    number = r"\s+(-?\d\.\d+E[+-]\d+)"
    displacement, stress = text.split("stresses")
    found = np.array(re.findall(rf"^\s*\d+{number * 3}\s*$", displacement, flags=re.MULTILINE), dtype=float)
    return found, np.array(re.findall(rf"^\s*\d+\s+\d+{number * 6}", stress, flags=re.MULTILINE), dtype=float)


def constant_stress() -> np.ndarray:
    """The stress of the linear field, by Hooke's law."""
    strain = 0.5 * (GRADIENT + GRADIENT.T)
    lame, shear = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON)), YOUNG / (2 * (1 + POISSON))
    stress = lame * np.trace(strain) * np.eye(3) + 2 * shear * strain
    return stress[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


@pytest.mark.parametrize("kind", list(ELEMENTS))
def test_linear_displacement_is_reproduced(kind: str, tmp_path: Path) -> None:
    mesh = patch(kind)
    inner = np.setdiff1d(np.arange(len(mesh.points)), boundary(mesh))
    assert len(inner) >= 30
    displacement, stress = solved(mesh, tmp_path)
    wanted = mesh.points @ GRADIENT.T
    assert displacement.shape == wanted.shape
    # CalculiX prints seven digits.
    assert np.abs(displacement - wanted)[inner].max() <= 1e-6 * np.abs(wanted).max()
    assert len(stress) >= mesh.n_cells
    assert np.abs(stress - constant_stress()).max() <= 1e-5 * np.abs(constant_stress()).max()


@pytest.mark.parametrize("kind", list(ELEMENTS))
def test_linear_displacement_is_reproduced_on_a_refined_mesh(kind: str, tmp_path: Path) -> None:
    """Levels are conforming: a node that hangs, or an interface not shared, would break the one stress."""
    mesh = truncated_ellipsoid(kind, heights=2, around=8, layers=2)
    if ELEMENTS[kind].quadratic:  # cut along its curves it has curved elements, which no rule integrates exactly
        mesh = replace(mesh, facets={}, facet_tag=np.empty(0, dtype=np.int32))
    fine = refine(mesh, 1)
    fine = tag_boundary(replace(fine, facets={}, facet_tag=np.empty(0, dtype=np.int32)))
    inner = np.setdiff1d(np.arange(len(fine.points)), boundary(fine))
    displacement, stress = solved(fine, tmp_path)
    wanted = fine.points @ GRADIENT.T
    assert np.abs(displacement - wanted)[inner].max() <= 1e-6 * np.abs(wanted).max()
    assert len(stress) >= fine.n_cells
    assert np.abs(stress - constant_stress()).max() <= 1e-5 * np.abs(constant_stress()).max()


QUADRATIC = [name for name in ELEMENTS if ELEMENTS[name].quadratic]


@pytest.mark.parametrize("kind", QUADRATIC)
def test_two_middles_exchanged_are_noticed(kind: str, tmp_path: Path) -> None:
    """The oracle itself can fail: mid-side nodes of one element in the wrong order."""
    mesh = patch(kind)
    block = np.array(mesh.cells[kind])
    corners = ELEMENTS[kind].corners
    block[5, [corners, corners + 1]] = block[5, [corners + 1, corners]]
    with pytest.raises(AssertionError, match="nonpositive jacobian"):
        solved(replace(mesh, cells={kind: block}), tmp_path)


@pytest.mark.parametrize("kind", QUADRATIC)
def test_a_middle_not_shared_with_the_neighbours_is_noticed(kind: str, tmp_path: Path) -> None:
    mesh = patch(kind)
    block = np.array(mesh.cells[kind])
    inside = ~np.isin(block, boundary(mesh))
    inside[:, : ELEMENTS[kind].corners] = False
    row, column = np.argwhere(inside)[0]
    points = np.concatenate([mesh.points, mesh.points[block[row, column]][None]])
    block[row, column] = len(mesh.points)
    torn = replace(mesh, points=points, cells={kind: block})
    displacement, _ = solved(torn, tmp_path)
    wanted = torn.points @ GRADIENT.T
    assert np.abs(displacement - wanted).max() > 1e-3 * np.abs(wanted).max()


@pytest.mark.slow
def test_curved_ten_node_tetrahedra_agree_with_scikit_fem(tmp_path: Path) -> None:
    """Inflation of a wall meshed with --order 2: C3D10 and P2 give the same displacement at every node."""
    skfem = pytest.importorskip("skfem")
    from skfem.helpers import ddot, eye, sym_grad, trace

    epi, endo = ellipsoids(vertices=400)
    wall = build_wall(epi=epi, endo={"lv": endo}, base=plane_z(10.0))
    mesh = tetrahedralize(wall, edge_length=7.0, order=2, quality="fast", mean_ratio=0.7, retries=0)
    assert mesh.info["quadratic"]["curved_edges"] > 300
    write_mesh(mesh, tmp_path / "lv.inp", step="inflation", young_modulus=30.0, poisson_ratio=0.4, pressure=1.0)
    result = run_calculix(tmp_path / "lv.inp")
    assert result.returncode == 0, result.stdout[-2000:]
    _, displacement = calculix_results(tmp_path / "lv.dat")

    grid = skfem.MeshTet2(mesh.points.T.copy(), mesh.cells["tetra10"].T.copy())
    # Order 2: the four points that C3D10 has.
    basis = skfem.Basis(grid, skfem.ElementVector(skfem.ElementTetP2()), intorder=2)
    lame, shear = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON)), YOUNG / (2 * (1 + POISSON))

    @skfem.BilinearForm
    def stiffness(u, v, _):
        strain = sym_grad(u)
        return ddot(lame * eye(trace(strain), 3) + 2 * shear * strain, sym_grad(v))

    distance, node = cKDTree(mesh.points).query(basis.doflocs.T)
    assert distance.max() < 1e-9
    component = np.empty(basis.N, dtype=int)
    for k in range(3):
        component[np.concatenate([basis.nodal_dofs[k], basis.edge_dofs[k]])] = k
    load = pressure_loads(mesh, 1e-3)[node, component]
    held = np.flatnonzero(np.isin(node, facet_nodes(mesh, FACET_TAGS["base"])))
    solution = skfem.solve(*skfem.condense(stiffness.assemble(basis), load, D=held))
    found = np.empty_like(mesh.points)
    found[node, component] = solution
    assert np.linalg.norm(displacement, axis=1).max() > 0.1
    assert np.abs(found - displacement).max() <= 1e-6 * np.abs(displacement).max()
