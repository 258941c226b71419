"""FLAC3D, NASTRAN, Netgen, PERMAS, TetGen and Kratos: numbers beyond all, given twice, and what meshio mistakes."""

from __future__ import annotations

import gzip
from pathlib import Path

import meshio
import numpy as np
import pytest
from notices import reported

import femprep as fp
from femprep.errors import FileError

POINTS = "G 1 0 0 0\nG 2 10 0 0\nG 3 0 10 0\nG 4 0 0 10\nG 5 10 10 10\n"
ZONES = "Z T4 1 1 2 3 4\nZ T4 2 2 3 4 5\n"
GRIDS = "".join(
    f"GRID,{i},,{x},{y},{z}\n" for i, (x, y, z) in enumerate([(0, 0, 0), (9, 0, 0), (0, 9, 0), (0, 0, 9)], 1)
)
BULK = f"BEGIN BULK\n{GRIDS}CTETRA,1,1,1,2,3,4\nENDDATA\n"


def written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def test_a_flac3d_grid_and_its_groups(tmp_path: Path) -> None:
    one = fp.read_mesh(written(tmp_path / "a.f3grid", f'{POINTS}{ZONES}ZGROUP "lv" SLOT 1\n2\n'))
    assert one.n_cells == 2
    assert len(set(one.region.tolist())) == 2
    faces = 'F T3 1 1 2 3\nF T3 2 2 3 5\nZGROUP "lv" SLOT 1\n2\n'
    two = fp.read_mesh(written(tmp_path / "b.f3grid", f"{POINTS}{ZONES}{faces}"))
    assert set(two.region.tolist()) == {0}
    (notice,) = reported(two)
    assert notice == "groups zone:lv:1 are left out: meshio mistakes them where there are several types"


def test_a_number_that_a_flac3d_grid_cannot_hold_is_refused(tmp_path: Path) -> None:
    text = POINTS + ZONES.replace("T4 2", "T4 4000000000")
    with pytest.raises(FileError, match="numbers an element 4000000000, in"):
        fp.read_mesh(written(tmp_path / "a.f3grid", text))


def test_what_a_nastran_deck_numbers_twice_is_refused(tmp_path: Path) -> None:
    assert fp.read_mesh(written(tmp_path / "a.bdf", BULK)).n_cells == 1
    twice = BULK.replace("CTETRA", "GRID,4,,0,0,1\nCTETRA", 1)
    with pytest.raises(FileError, match="GRID 4 is defined 2 times"):
        fp.read_mesh(written(tmp_path / "b.bdf", twice))
    twice = BULK.replace("ENDDATA", "CTETRA,1,1,1,2,4,3\nENDDATA")
    with pytest.raises(FileError, match="element 1 is defined 2 times"):
        fp.read_mesh(written(tmp_path / "c.bdf", twice))


def test_points_of_nastran_in_axes_of_their_own_are_refused(tmp_path: Path) -> None:
    two = BULK.replace("CTETRA,1,1", "CTETRA,1,7").replace("ENDDATA", "CTRIA3,2,9,1,2,3\nENDDATA")
    mesh = fp.read_mesh(written(tmp_path / "a.bdf", two.replace("GRID,1,", "GRID,1,0")))
    assert (mesh.region.tolist(), mesh.facet_tag.tolist(), mesh.point_data) == ([7], [9], {})
    with pytest.raises(FileError, match=r"points in axes of their own \(CP of GRID\)"):
        fp.read_mesh(written(tmp_path / "b.bdf", BULK.replace("GRID,1,", "GRID,1,5")))
    for line in ("GRDSET,,5", "include 'more.bdf'"):
        with pytest.raises(FileError, match=f"{line[:6].upper()}.* is not read"):
            fp.read_mesh(written(tmp_path / "c.bdf", BULK.replace("BEGIN BULK", f"BEGIN BULK\n{line}")))


def test_zones_of_tecplot_and_su2(tmp_path: Path) -> None:
    points = "0 0 0\n9 0 0\n0 9 0\n0 0 9\n"
    zone = f"ZONE N=4, E=1, F=FEPOINT, ET=TETRAHEDRON\n{points}1 2 3 4\n"
    mesh = fp.read_mesh(written(tmp_path / "a.dat", f'VARIABLES="X" "Y" "Z"\n{zone}{zone}'))
    assert (mesh.n_cells, reported(mesh)) == (1, ["of 2 zones the first is read"])
    zone = f"NDIME= 3\nNELEM= 1\n10 0 1 2 3\nNPOIN= 4\n{points}"
    assert fp.read_mesh(written(tmp_path / "a.su2", f"NZONE= 1\n{zone}")).n_cells == 1
    with pytest.raises(FileError, match="has 2 zones"):
        fp.read_mesh(written(tmp_path / "b.su2", f"NZONE= 2\nIZONE= 1\n{zone}IZONE= 2\n{zone}"))


@pytest.mark.parametrize("nodes", ["0 1 2 3 4 5", "0 2 1 3 5 4"])
def test_a_wedge_of_su2_in_either_order(nodes: str, tmp_path: Path) -> None:
    """Its types are VTK's, whose documentation has the first triangle outward; Gmsh writes it so."""
    points = "0 0 0\n9 0 0\n0 9 0\n0 0 9\n9 0 9\n0 9 9\n"
    text = f"NDIME= 3\nNELEM= 1\n13 {nodes}\nNPOIN= 6\n{points}"
    assert fp.check(fp.read_mesh(written(tmp_path / "a.su2", text))).validity.inverted_elements == 0


def test_markers_of_su2_keep_their_names(tmp_path: Path) -> None:
    text = "NDIME= 3\nNELEM= 1\n10 0 1 2 3\nNPOIN= 4\n0 0 0\n9 0 0\n0 9 0\n0 0 9\nNMARK= 2\n"
    marks = "MARKER_TAG= {}\nMARKER_ELEMS= 1\n5 0 2 1\nMARKER_TAG= {}\nMARKER_ELEMS= 1\n5 0 1 3\n"
    mesh = fp.read_mesh(written(tmp_path / "a.su2", text + marks.format("lumen % inside", "rim")))
    assert mesh.facet_tag.tolist() == [mesh.info["tag_names"][name] for name in ("lumen", "rim")]
    mesh = fp.read_mesh(written(tmp_path / "b.su2", text + marks.format("7", "3")))
    assert (mesh.facet_tag.tolist(), mesh.info.get("tag_names")) == ([7, 3], None)
    for tags in (("3", "3"), ("lumen", "1")):
        with pytest.raises(FileError, match="twice the same, or numbers and names mixed"):
            fp.read_mesh(written(tmp_path / "c.su2", text + marks.format(*tags)))


def test_arrays_that_are_no_numbers_are_left_out(tmp_path: Path) -> None:
    """Netgen's numbers of regions that no integer holds become objects in meshio."""
    points = "points\n4\n0 0 0\n9 0 0\n0 9 0\n0 0 9\n"
    text = f"mesh3d\ndimension\n3\n{points}volumeelements\n1\n{{}} 4 1 3 2 4\nendmesh\n"
    assert fp.read_mesh(written(tmp_path / "a.vol", text.format(7))).region.tolist() == [7]
    spoiled = fp.read_mesh(written(tmp_path / "b.vol", text.format(10**30)))
    assert (spoiled.region.tolist(), spoiled.cell_data) == ([0], {})
    (notice,) = reported(spoiled)
    assert notice.startswith("netgen:index is left out")


def test_an_su2_mesh_that_is_cut_short_is_refused(tmp_path: Path) -> None:
    points = "NPOIN= 5\n0 0 0 0\n9 0 0 1\n0 9 0 2\n0 0 9 3\n9 9 9 4\n"
    mark = "NMARK= 1\nMARKER_TAG= epi\nMARKER_ELEMS= 1\n5 0 1 2\n"
    whole = f"NDIME= 3\n% made by hand\nNELEM= 2\n10 0 1 2 3 0\n10 1 2 3 4 1\n{points}{mark}"
    mesh = fp.read_mesh(written(tmp_path / "a.su2", whole))
    assert (mesh.n_cells, mesh.n_facets) == (2, 1)
    for row, words in (("10 0 1 2 3 0\n", "NELEM= 2 and lists 1"), ("9 9 9 4\n", "NPOIN= 5 and lists 4")):
        with pytest.raises(FileError, match=words):
            fp.read_mesh(written(tmp_path / "b.su2", whole.replace(row, "")))
    with pytest.raises(FileError, match="MARKER_ELEMS= 1 and lists 0"):
        fp.read_mesh(written(tmp_path / "c.su2", whole.replace("5 0 1 2\n", "")))


def test_a_wedge_of_flac3d_is_not_inside_out(tmp_path: Path) -> None:
    """Its triangles are its points 1, 2, 4 and 3, 5, 6, the fourth being above the first (FLAC3D's own picture)."""
    corners = [(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3), (1, 2, 0), (0, 2, 3)]
    points = "".join(f"G {i} {x} {y} {z}\n" for i, (x, y, z) in enumerate(corners, 1))
    mesh = fp.read_mesh(written(tmp_path / "a.f3grid", f"{points}Z W6 1 1 2 3 4 5 6\n"))
    assert fp.check(mesh).validity.inverted_elements == 0
    assert mesh.cells["wedge"].tolist() == [[0, 3, 1, 2, 5, 4]]


VOLUME = "mesh3d\ndimension\n3\npoints\n4\n0 0 0\n9 0 0\n0 9 0\n0 0 9\nvolumeelements\n1\n1 4 1 3 2 4\nendmesh\n"


def test_netgen_62_describes_faces(tmp_path: Path) -> None:
    """What it writes before the surface elements, meshio does not know."""
    faces = "# surfnr\tdomin\tdomout\ttlosurf\tbcprop\nfacedescriptors\n2\n0 1 0 0 1\n2 1 0 0 2\n\nvolumeelements"
    path = written(tmp_path / "a.vol", VOLUME.replace("volumeelements", faces))
    assert fp.read_mesh(path).n_cells == 1
    with pytest.raises(FileError, match=r"b\.vol' is damaged"):
        fp.read_mesh(written(tmp_path / "b.vol", VOLUME.replace("points\n4", "points\nx")))


def test_a_packed_netgen_mesh(tmp_path: Path) -> None:
    path = tmp_path / "a.vol.gz"
    path.write_bytes(gzip.compress(VOLUME.encode()))
    assert fp.read_mesh(path).n_cells == 1
    path.write_bytes(gzip.compress(VOLUME.encode() + b" " * 10_000_000))
    with pytest.raises(FileError, match="unpacks to more than 100 times its size"):
        fp.read_mesh(path)


PERMAS = (
    "$ENTER COMPONENT NAME=A\n$STRUCTURE\n$COOR\n1 0. 0. 0.\n2 9. 0. 0.\n3 0. 9. 0.\n5 0. 0. 9.\n!\n"
    "$ELEMENT TYPE=TET4\n1 1 2 3 5\n$END STRUCTURE\n$EXIT COMPONENT\n$FIN\n"
)


def test_a_permas_file(tmp_path: Path) -> None:
    assert fp.read_mesh(written(tmp_path / "a.post", PERMAS)).cells["tetra"].tolist() == [[0, 1, 2, 3]]
    for text, words in (
        (PERMAS.replace("!", "1 9. 9. 9.\n!"), "node 1 is defined 2 times"),
        (PERMAS.replace("1 1 2 3 5\n", "1 1 2 3 5\n1 1 2 3 5\n"), "element 1 is defined 2 times"),
        (PERMAS[: PERMAS.index("$END")], "its .STRUCTURE does not end"),
    ):
        with pytest.raises(FileError, match=words):
            fp.read_mesh(written(tmp_path / "b.dato", text))


def test_mid_side_nodes_of_permas_are_refused(tmp_path: Path) -> None:
    """meshio writes them between the corners, as PERMAS has them, and reads them as they stand."""
    rows = [("tetra10", np.arange(10)[None])]
    meshio.Mesh(np.random.default_rng(1).random((10, 3)), rows).write(tmp_path / "a.post")
    with pytest.raises(FileError, match="holds tetra10, whose order of nodes in PERMAS is not known"):
        fp.read_mesh(tmp_path / "a.post")


def test_kratos_and_cgns_are_refused(tmp_path: Path) -> None:
    """meshio takes nodes of the one by rows, whatever their numbers, and quadrilaterals of the other for solids."""
    with pytest.raises(FileError, match="let Kratos write VTK"):
        fp.read_mesh(written(tmp_path / "a.mdpa", "Begin Nodes\nEnd Nodes\n"))
    with pytest.raises(FileError, match="CGNS is not read"):
        fp.read_mesh(written(tmp_path / "a.cgns", "CGNS"))


NODES = "# nodes\n4 3 0 0\n1 0 0 0\n2 9 0 0\n3 0 9 0\n4 0 0 9\n"


@pytest.mark.parametrize("named", [".node", ".ele"])
def test_a_mesh_of_tetgen_by_either_of_its_files(tmp_path: Path, named: str) -> None:
    written(tmp_path / "a.node", NODES)
    written(tmp_path / "a.ele", "1 4 1\n1 1 2 3 4 7\n")
    assert fp.read_mesh(tmp_path / f"a{named}").region.tolist() == [7]


@pytest.mark.parametrize(
    ("nodes", "elements", "words"),
    [
        *(
            (NODES, f"{head}\n", "lists no tetrahedra")
            for head in ("0 4 648650", "-0 4 648650", "-1 4 2147483648", "1 4 -1")
        ),
        ("0 3 2000000000 0\n", "1 4 0\n1 1 2 3 4\n", "lists no nodes"),
        (NODES, "1 4 2000000000\n1 1 2 3 4\n", "1 tetrahedra of 2000000004 numbers, in 25 bytes"),
        (NODES, "1 10 0\n1 1 2 3 4 5 6 7 8 9 10\n", "ten nodes, which are not read; run TetGen without -o2"),
        (NODES, "1 4\n1 1 2 3 4\n", "damaged"),
        (NODES, None, r"a\.ele' is missing"),
    ],
)
def test_tetgen_files_that_are_not_what_they_say(tmp_path: Path, nodes: str, elements: str | None, words: str) -> None:
    path = written(tmp_path / "a.node", nodes)
    if elements is not None:
        written(tmp_path / "a.ele", elements)
    with pytest.raises(FileError, match=words):
        fp.read_mesh(path)
