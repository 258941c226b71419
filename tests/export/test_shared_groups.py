"""Physical groups of Gmsh and families of MED that share elements, or are turned over."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from meshes import truncated_ellipsoid
from notices import reported

import femprep as fp

MESH = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
3 57 "lesion"
3 58 "whole"
$EndPhysicalNames
$Entities
0 0 0 2
1 0 0 0 1 1 1 {} 0
2 0 0 0 1 1 1 {} 0
$EndEntities
$Nodes
1 5 1 5
3 1 0 5
1
2
3
4
5
0 0 0
9 0 0
0 9 0
0 0 9
9 9 9
$EndNodes
$Elements
2 2 1 2
3 1 4 1
1 1 2 3 4
3 2 4 1
2 2 5 3 4
$EndElements
"""


TOLD = "an element has one region: groups {} lack those that are in another group as well"


def read(path: Path, *groups: str) -> fp.VolumeMesh:
    path.write_text(MESH.format(*groups))
    return fp.read_mesh(path)


@pytest.mark.parametrize("first", ["2 57 58", "2 58 57", "1 -57"])
def test_a_group_of_all_elements_hides_no_other(first: str, tmp_path: Path) -> None:
    mesh = read(tmp_path / "a.msh", first, "1 58")
    assert mesh.region.tolist() == [57, 58]
    assert mesh.info["tag_names"] == {"lesion": 57, "whole": 58}
    assert not reported(mesh)


def test_a_group_that_lacks_elements_is_told(tmp_path: Path) -> None:
    mesh = read(tmp_path / "a.msh", "2 58 57", "1 9")
    assert mesh.region.tolist() == [57, 9]
    (notice,) = reported(mesh)
    assert notice == TOLD.format("whole")


def test_groups_of_med(tmp_path: Path) -> None:
    """The first group of a family named its elements: of two families in one of all elements it made one region."""
    points = np.array([(0, 0, 0), (9, 0, 0), (0, 9, 0), (0, 0, 9), (9, 9, 9.0)])
    cells = [("tetra", np.array([[0, 1, 2, 3], [1, 4, 2, 3]]))]
    mesh = meshio.Mesh(points, cells, cell_data={"cell_tags": [np.array([-1, -2])]})
    mesh.cell_tags = {-1: ["whole", "left"], -2: ["whole", "right"]}
    mesh.write(tmp_path / "a.med")
    found = fp.read_mesh(tmp_path / "a.med")
    names = found.info["tag_names"]
    assert found.region.tolist() == [names["left"], names["right"]]
    assert not reported(found)
    meshio.Mesh(points, cells).write(tmp_path / "c.med")
    assert fp.read_mesh(tmp_path / "c.med").region.tolist() == [0, 0]
    mesh.cell_tags = {-1: ["left", "tip"], -2: []}
    mesh.write(tmp_path / "b.med")
    (notice,) = reported(fp.read_mesh(tmp_path / "b.med"))
    assert notice == TOLD.format("tip")


def test_a_number_of_ours_that_names_something_else_is_changed(tmp_path: Path) -> None:
    """A region 5 is the right atrium to femprep: the file's of that number was shown and treated as one."""
    path = tmp_path / "a.msh"
    path.write_text(MESH.format("1 5", "1 58").replace('3 57 "lesion"', '3 5 "lesion"'))
    mesh = fp.read_mesh(path)
    assert dict(mesh.region_names) == {"lesion": 51, "whole": 58}
    (notice,) = reported(mesh)
    assert notice == "numbers that are femprep's of something else are changed: 'lesion' from 5 to 51"
    report = fp.check(mesh)
    assert list(report.regions) == ["lesion", "whole"]
    assert {one.region for one in report.worst} <= {"lesion", "whole"}
    assert "lesion" in repr(mesh)


def test_a_changed_number_is_none_of_a_group_without_a_name(tmp_path: Path) -> None:
    path = tmp_path / "a.msh"
    path.write_text(MESH.format("1 5", "1 51").replace('3 57 "lesion"', '3 5 "lesion"'))
    assert dict(fp.read_mesh(path).region_names) == {"tag_51": 51, "lesion": 52}


def test_numbers_of_facets_are_never_shown_as_regions(tmp_path: Path) -> None:
    points = np.array([(0, 0, 0), (9, 0, 0), (0, 9, 0), (0, 0, 9)], dtype=float)
    data = {"medit:ref": [np.array([1]), np.array([1])]}
    cells = [("tetra", np.array([[0, 1, 2, 3]])), ("triangle", np.array([[0, 2, 1]]))]
    meshio.Mesh(points, cells, cell_data=data).write(tmp_path / "a.mesh")
    mesh = fp.read_mesh(tmp_path / "a.mesh")
    assert (dict(mesh.region_names), dict(mesh.facet_names)) == ({"lv": 1}, {"tag_1": 1})


@pytest.mark.parametrize("version", [4.1, 2.2])
@pytest.mark.parametrize("binary", [0, 1])
def test_gmsh_itself_with_groups_that_share_elements(version: float, binary: int, tmp_path: Path) -> None:
    """Version 2 lists an element once for each of its groups, 4.1 names several groups of one entity."""
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        for x in (0, 1):
            gmsh.model.occ.addBox(x, 0, 0, 1, 1, 1)
        gmsh.model.occ.fragment([(3, 1)], [(3, 2)])
        gmsh.model.occ.synchronize()
        for name, tag, boxes in (("left", 60, [1]), ("right", 61, [2]), ("whole", 62, [1, 2])):
            gmsh.model.addPhysicalGroup(3, boxes, tag, name=name)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.7)
        gmsh.model.mesh.generate(3)
        count = sum(map(len, gmsh.model.mesh.getElements(3)[1]))
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(str(tmp_path / "a.msh"))
        gmsh.model.removePhysicalGroups([(3, 61), (3, 62)])
        gmsh.option.setNumber("Mesh.SaveAll", 1)
        gmsh.write(str(tmp_path / "b.msh"))
    finally:
        gmsh.finalize()
    mesh = fp.read_mesh(tmp_path / "a.msh")
    assert (mesh.n_cells, dict(mesh.region_names)) == (count, {"left": 60, "right": 61})
    assert fp.check(mesh).validity.duplicate_elements == 0
    everything = fp.read_mesh(tmp_path / "b.msh")
    assert everything.n_cells == count
    # Of version 2 Gmsh saves all with no groups.
    assert set(everything.region.tolist()) == ({0, 60} if version == 4.1 else {0})


@pytest.mark.parametrize("version", ["gmsh", "gmsh41"])
@pytest.mark.parametrize(
    ("old", "new", "region", "facets"),
    [
        ('"epi"', '"wall"', "wall", ["endo", "wall", "base", "apex"]),
        ('"epi"', '"lv"', "wall", ["endo", "lv", "base", "apex"]),
        ('"wall"', '"epi"', "epi", ["endo", "epi", "base", "apex"]),
        ('"base"', '"epi"', "wall", ["endo", "epi_102", "epi_103", "apex"]),
    ],
)
def test_groups_of_one_name(version: str, old: str, new: str, region: str, facets: list[str], tmp_path: Path) -> None:
    """meshio keeps one group of a name: the facets of a volume's name had none."""
    mesh = truncated_ellipsoid("tetra")
    mesh = replace(mesh, region=mesh.region * 0 + 51, info={"tag_names": {"wall": 51}})
    fp.write_mesh(mesh, tmp_path / "a.msh", format=version)
    text = (tmp_path / "a.msh").read_text()
    (tmp_path / "a.msh").write_text(text.replace(old, new))
    found = fp.read_mesh(tmp_path / "a.msh")
    assert found.region_names == {region: 51}
    counts = {name: int(np.sum(found.facet_tag == tag)) for name, tag in found.facet_names.items()}
    assert counts == {name: int(np.sum(mesh.facet_tag == tag)) for name, tag in zip(facets, (101, 102, 103, 104))}
