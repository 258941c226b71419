"""Physical groups of Gmsh that share elements, or are turned over."""

from __future__ import annotations

from pathlib import Path

import femprep as fp

MESH = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
3 7 "lesion"
3 8 "whole"
$EndPhysicalNames
$Entities
0 0 0 2
1 0 0 0 1 1 1 {} 0
2 0 0 0 1 1 1 1 8 0
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


def read(path: Path, groups: str) -> fp.VolumeMesh:
    path.write_text(MESH.format(groups))
    return fp.read_mesh(path)


def test_a_group_that_lacks_elements_is_told(tmp_path: Path) -> None:
    mesh = read(tmp_path / "a.msh", "2 7 8")
    assert mesh.region.tolist() == [7, 8]
    assert mesh.info["tag_names"] == {"lesion": 7, "whole": 8}
    (notice,) = mesh.info["notices"]
    assert notice["what"] == "the group 'whole' lacks 1 of its 2 elements, which are in another one as well"
    assert "notices" not in read(tmp_path / "b.msh", "1 7").info


def test_a_group_turned_over_is_the_same_group(tmp_path: Path) -> None:
    mesh = read(tmp_path / "a.msh", "1 -7")
    assert mesh.region.tolist() == [7, 8]
    assert mesh.info["tag_names"] == {"lesion": 7, "whole": 8}
