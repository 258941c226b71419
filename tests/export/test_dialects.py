"""Formats as other programs write them: other cases, tabs, partitions, containers."""

from __future__ import annotations

import re
from pathlib import Path

import meshio
import numpy as np
import pytest
import pyvista
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.errors import FileError


def plain(kind: str = "tetra") -> meshio.Mesh:
    mesh = truncated_ellipsoid(kind)
    return meshio.Mesh(mesh.points, [(kind, mesh.cells[kind])], cell_data={"region": [mesh.region]})


@pytest.mark.parametrize("change", [str.lower, str.upper])
@pytest.mark.parametrize("kind", ["tetra", "hexahedron"])
def test_xdmf_of_other_case_with_its_numbers_inline(kind: str, change, tmp_path: Path) -> None:
    plain(kind).write(tmp_path / "a.xdmf", data_format="XML")
    text = (tmp_path / "a.xdmf").read_text()
    (tmp_path / "b.xdmf").write_text(re.sub('(?<=TopologyType=")[^"]*', lambda found: change(found[0]), text))
    one, other = fp.read_mesh(tmp_path / "a.xdmf"), fp.read_mesh(tmp_path / "b.xdmf")
    assert np.array_equal(one.cells[kind], other.cells[kind])
    assert np.array_equal(one.region, other.region)
    assert np.array_equal(one.region, plain(kind).cell_data["region"][0])


def test_tetgen_with_tabs(tmp_path: Path) -> None:
    mesh = plain()
    mesh.cell_data = {}
    mesh.write(tmp_path / "a.node")
    for ending in (".node", ".ele"):
        file = tmp_path / f"a{ending}"
        file.write_text(file.read_text().replace(" ", "\t"))
    assert fp.read_mesh(tmp_path / "a.ele").n_cells == len(mesh.cells[0].data)


@pytest.mark.parametrize("blocks", [1, 2])
def test_vtkhdf(blocks: int, tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra")
    grid = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: mesh.cells["tetra"]}, mesh.points)
    from vtkmodules.vtkIOHDF import vtkHDFWriter

    writer = vtkHDFWriter()
    writer.SetFileName(str(tmp_path / "a.vtkhdf"))
    writer.SetInputData(grid if blocks == 1 else pyvista.MultiBlock([grid.extract_cells(range(9)), grid]))
    writer.Write()
    assert fp.read_mesh(tmp_path / "a.vtkhdf").n_cells == mesh.n_cells + (9 if blocks == 2 else 0)


@pytest.mark.parametrize("binary", [0, 1])
def test_gmsh_with_partitions(binary: int, tmp_path: Path) -> None:
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.option.setNumber("Mesh.PartitionCreateTopology", binary)
        gmsh.model.occ.addBox(0, 0, 0, 20, 20, 20)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [1], 60, "wall")
        gmsh.model.addPhysicalGroup(2, [1], 70, "side")
        gmsh.model.mesh.generate(3)
        count = len(gmsh.model.mesh.getElementsByType(4)[0])
        gmsh.model.mesh.partition(2)
        gmsh.write(str(tmp_path / "a.msh"))
    finally:
        gmsh.finalize()
    mesh = fp.read_mesh(tmp_path / "a.msh")
    assert mesh.n_cells == count
    assert mesh.region_names == {"wall": 60}
    assert "side" in mesh.facet_names


def test_an_unknown_ending_and_a_format_that_fails_are_named(tmp_path: Path) -> None:
    (tmp_path / "a.xyz").write_text("no mesh")
    with pytest.raises(FileError, match=r"'\.xyz' of no known format"):
        fp.read_mesh(tmp_path / "a.xyz")
    (tmp_path / "a.xdmf").write_text("<Xdmf Version='3.0'><Domain><Grid><Topology/></Grid></Domain></Xdmf>")
    with pytest.raises(FileError, match="xdmf"):
        fp.read_mesh(tmp_path / "a.xdmf")


def test_a_surface_is_told_what_can_be_done_with_it(tmp_path: Path) -> None:
    pyvista.Sphere().cast_to_unstructured_grid().save(tmp_path / "a.vtu")
    with pytest.raises(FileError, match="femprep mesh --surface"):
        fp.read_mesh(tmp_path / "a.vtu")
