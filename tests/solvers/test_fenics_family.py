"""dolfinx, legacy dolfin and scikit-fem read our files with their tags and agree with CalculiX."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from meshes import mixed, truncated_ellipsoid, with_fibres
from solver_tools import calculix_results, require_system_module, run_calculix, run_system_python

from femprep.export import write_mesh
from femprep.export.deck.split import to_tetrahedra
from femprep.mesh.elements import ELEMENTS
from femprep.model import FACET_TAGS, REGION_TAGS, VolumeMesh

HERE = Path(__file__).parent
YOUNG, POISSON, PRESSURE = 0.03, 0.4, 0.001  # MPa, -, MPa: the defaults of the inflation step


def calculix_greatest(mesh: VolumeMesh, folder: Path) -> float:
    write_mesh(mesh, folder / "lv.inp", step="inflation")
    assert run_calculix(folder / "lv.inp").returncode == 0
    _, displacement = calculix_results(folder / "lv.dat")
    return float(np.linalg.norm(displacement, axis=1).max())


def run(program: str, folder: Path, *more: str, file: str = "mesh.xdmf") -> dict[str, Any]:
    script = HERE / f"{program}_inflation.py"
    text = run_system_python(script, folder, file, str(PRESSURE), str(YOUNG), str(POISSON), *more)
    found: dict[str, Any] = json.loads(next(line for line in text.splitlines() if line.startswith("RESULT"))[7:])
    return found


def volumes_and_areas(mesh: VolumeMesh) -> tuple[dict[str, float], dict[str, float]]:
    """Of a mesh of linear tetrahedra, by upper-case name."""
    p = mesh.points[mesh.cells["tetra"]]
    volume = np.linalg.det(p[:, 1:] - p[:, :1]) / 6
    q = mesh.points[mesh.facets["triangle"]]
    area = np.linalg.norm(np.cross(q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]), axis=1) / 2
    return (
        {name.upper(): float(volume[mesh.region == tag].sum()) for name, tag in mesh.region_names.items()},
        {name.upper(): float(area[mesh.facet_tag == tag].sum()) for name, tag in mesh.facet_names.items()},
    )


@pytest.mark.slow
@pytest.mark.solver
@pytest.mark.parametrize(
    ("program", "format", "module"),
    # Old FEniCS compiles for ten seconds and more.
    [("dolfinx", "dolfinx", "dolfinx"), ("fenics", "fenics", "dolfin")],
)
@pytest.mark.parametrize("kind", ["tetra", "wedge", "mixed"])
def test_tags_and_displacement(program: str, format: str, module: str, kind: str, tmp_path: Path) -> None:
    require_system_module(module)
    mesh = with_fibres(mixed() if kind == "mixed" else truncated_ellipsoid(kind))
    write_mesh(mesh, tmp_path / "mesh.xdmf", format=format)
    with h5py.File(tmp_path / "mesh.h5") as store:
        np.save(tmp_path / "fiber.npy", store["cell_data/fiber"][()])
    found = run(program, tmp_path)
    tets = to_tetrahedra(mesh)
    volumes, areas = volumes_and_areas(tets)
    assert found["volumes"] == pytest.approx(volumes, rel=1e-12)
    assert found["areas"] == pytest.approx(areas, rel=1e-12)
    assert (found["cells"], found["points"]) == (tets.n_cells, len(tets.points))
    p = tets.points[tets.cells["tetra"]]
    volume = np.linalg.det(p[:, 1:] - p[:, :1]) / 6
    for name, tag in tets.region_names.items():
        integral = volume[tets.region == tag] @ np.asarray(tets.cell_data["fiber"])[tets.region == tag]
        np.testing.assert_allclose(found["fibres"][name.upper()], integral, rtol=1e-11, atol=1e-8)
    assert found["greatest"] == pytest.approx(calculix_greatest(tets, tmp_path), rel=1e-6)


@pytest.mark.slow
@pytest.mark.solver
@pytest.mark.parametrize("format", ["gmsh", "gmsh41"])
def test_dolfinx_reads_the_msh_through_gmsh(format: str, tmp_path: Path) -> None:
    require_system_module("dolfinx")
    gmsh = pytest.importorskip("gmsh")
    mesh = truncated_ellipsoid("tetra")
    write_mesh(mesh, tmp_path / "lv.msh", format=format)
    found = run("dolfinx", tmp_path, "1", gmsh.__file__, file="lv.msh")
    volumes, areas = volumes_and_areas(mesh)
    assert found["volumes"] == pytest.approx(volumes, rel=1e-12)
    assert found["areas"] == pytest.approx(areas, rel=1e-12)
    assert found["greatest"] == pytest.approx(calculix_greatest(mesh, tmp_path), rel=1e-6)


@pytest.mark.slow
@pytest.mark.solver
@pytest.mark.parametrize("written", ["hexahedron", "hexahedron20"])
def test_dolfinx_solves_on_hexahedra(written: str, tmp_path: Path) -> None:
    require_system_module("dolfinx")
    write_mesh(truncated_ellipsoid(written), tmp_path / "mesh.xdmf", format="dolfinx")
    mesh = truncated_ellipsoid("hexahedron")
    found = run("dolfinx", tmp_path)
    assert found["cells"] == mesh.n_cells
    assert found["greatest"] == pytest.approx(calculix_greatest(mesh, tmp_path), rel=1e-6)


@pytest.mark.slow
@pytest.mark.solver
def test_dolfinx_solves_on_quadratic_tetrahedra(tmp_path: Path) -> None:
    require_system_module("dolfinx")
    mesh = truncated_ellipsoid("tetra10", curved=True)
    write_mesh(mesh, tmp_path / "mesh.xdmf", format="dolfinx")
    found = run("dolfinx", tmp_path, "2")
    assert (found["cells"], found["points"]) == (mesh.n_cells, len(mesh.points))
    straight = volumes_and_areas(to_tetrahedra(mesh))[0]
    assert 1.01 < sum(found["volumes"].values()) / sum(straight.values()) < 1.1  # bent outwards


@pytest.mark.solver
def test_scikit_fem_on_the_msh_agrees_with_calculix(tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra", heights=6, around=18, layers=3)
    write_mesh(mesh, tmp_path / "lv.msh")
    assert scikit_fem_greatest(tmp_path / "lv.msh", "P1") == pytest.approx(calculix_greatest(mesh, tmp_path), rel=1e-6)


@pytest.mark.solver
def test_scikit_fem_p2_agrees_with_calculix_on_ten_node_tetrahedra(tmp_path: Path) -> None:
    write_mesh(truncated_ellipsoid("tetra"), tmp_path / "lv.msh")
    wanted = calculix_greatest(truncated_ellipsoid("tetra10"), tmp_path)
    assert scikit_fem_greatest(tmp_path / "lv.msh", "P2") == pytest.approx(wanted, rel=1e-6)


def scikit_fem_greatest(path: Path, degree: str) -> float:
    """Greatest displacement of the same inflation, by scikit-fem on a ``.msh`` with named groups."""
    skfem = pytest.importorskip("skfem")
    from skfem.helpers import dot
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    mesh = skfem.Mesh.load(path)
    assert set(mesh.boundaries) >= {"endo", "epi", "base", "apex"}
    assert set(mesh.subdomains) >= {"lv", "septum"}
    element = skfem.ElementVector({"P1": skfem.ElementTetP1, "P2": skfem.ElementTetP2}[degree]())
    basis = skfem.Basis(mesh, element)
    endo = skfem.FacetBasis(mesh, element, facets=mesh.boundaries["endo"])
    stiffness = linear_elasticity(*lame_parameters(YOUNG, POISSON)).assemble(basis)
    load = skfem.LinearForm(lambda v, w: -PRESSURE * dot(w.n, v)).assemble(endo)
    solution = skfem.solve(*skfem.condense(stiffness, load, D=basis.get_dofs("base")))
    dofs = [basis.nodal_dofs] if degree == "P1" else [basis.nodal_dofs, basis.edge_dofs]
    return float(max(np.linalg.norm(solution[d], axis=0).max() for d in dofs))


@pytest.mark.parametrize("format", ["gmsh", "gmsh41"])
@pytest.mark.parametrize("kind", [*ELEMENTS, "mixed"])
def test_gmsh_opens_it_with_its_groups(format: str, kind: str, tmp_path: Path) -> None:
    gmsh = pytest.importorskip("gmsh")
    mesh = mixed() if kind == "mixed" else truncated_ellipsoid(kind, curved=True)
    write_mesh(mesh, tmp_path / "lv.msh", format=format)
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.logger.start()
        gmsh.open(str(tmp_path / "lv.msh"))
        said = gmsh.logger.get()
        gmsh.logger.stop()
        assert not [line for line in said if not line.startswith("Info")]
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        points = np.empty((len(tags), 3))
        points[np.asarray(tags) - 1] = np.reshape(coordinates, (-1, 3))
        assert np.array_equal(points, mesh.points)
        groups = {gmsh.model.getPhysicalName(dim, tag): (dim, tag) for dim, tag in gmsh.model.getPhysicalGroups()}
        names = {name: (3, REGION_TAGS[name]) for name in ("lv", "septum")}
        assert groups == names | {name: (2, FACET_TAGS[name]) for name in ("endo", "epi", "base", "apex")}
        for dim, of_dim in ((3, mesh.region), (2, mesh.facet_tag)):
            for tag in np.unique(of_dim):
                _, found, _ = gmsh.model.mesh.getElements(dim, gmsh.model.getEntitiesForPhysicalGroup(dim, tag)[0])
                assert sum(map(len, found)) == np.sum(of_dim == tag)
        for element in gmsh.model.mesh.getElementTypes(3):
            elements, _ = gmsh.model.mesh.getElementsByType(element)
            # The wrong order of mid-side nodes turns elements inside out somewhere.
            assert np.min(gmsh.model.mesh.getElementQualities(elements, "minDetJac")) > 0
    finally:
        gmsh.finalize()
