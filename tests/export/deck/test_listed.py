"""Decks whose keywords move, copy or make nodes and elements, or keep cards in other columns, are refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from notices import reported

import femprep as fp
from femprep.errors import FileError

POINTS = [(0, 0, 0), (9, 0, 0), (0, 9, 0), (0, 0, 9)]
NODES = "".join(f"{i}, {x}, {y}, {z}\n" for i, (x, y, z) in enumerate(POINTS, 1))
ABAQUS = f"*NODE, NSET=all\n{NODES}*ELEMENT, TYPE=C3D4, ELSET=lv\n1, 1, 2, 3, 4\n"
CARDS = "".join(f"{i:8d}{x:16.6f}{y:16.6f}{z:16.6f}\n" for i, (x, y, z) in enumerate(POINTS, 1))
SOLID = "*ELEMENT_SOLID\n       1       1       1       2       3       4       4       4       4       4\n"
LSDYNA = f"*KEYWORD\n*NODE\n{CARDS}*PART\nlv\n         1         1         1\n{SOLID}*END\n"


def read(path: Path, text: str) -> fp.VolumeMesh:
    path.write_text(text)
    return fp.read_mesh(path)


@pytest.mark.parametrize(
    "rows", ["*NGEN\n1, 3, 1\n", "*ELGEN, ELSET=lv\n1, 2, 0, 1\n", "*NMAP, NSET=all\n0., 0., 0.\n"]
)
def test_abaqus_decks_that_make_their_mesh(rows: str, tmp_path: Path) -> None:
    assert read(tmp_path / "a.inp", ABAQUS).n_cells == 1
    with pytest.raises(FileError, match="is not read; by it nodes or elements are others than those listed"):
        read(tmp_path / "b.inp", ABAQUS + rows)


def test_abaqus_nodes_in_axes_of_their_own(tmp_path: Path) -> None:
    assert read(tmp_path / "a.inp", "*SYSTEM\n" + ABAQUS.replace("NSET=all", "SYSTEM=R")).n_cells == 1
    for text in ("*SYSTEM\n1., 0., 0.\n" + ABAQUS, ABAQUS.replace("NSET=all", "SYSTEM=C")):
        with pytest.raises(FileError, match=r"in axes of their own \(\*SYSTEM\)"):
            read(tmp_path / "b.inp", text)


def test_rows_of_an_abaqus_surface_that_name_no_face_are_told(tmp_path: Path) -> None:
    mesh = read(tmp_path / "a.inp", ABAQUS + "*SURFACE, NAME=epi\nlv, s1\nlv,\nlv, SPOS\n")
    assert mesh.n_facets == 1
    (notice,) = reported(mesh)
    assert notice == "rows of the surface 'epi' are left out, which name no face S1 to S6 of elements: 2"


@pytest.mark.parametrize("rows", ["*NODE_TRANSFORM\n", "*PART_MOVE\n", "*PART_DUPLICATE\n", "*NODE_MERGE_SET\n"])
def test_lsdyna_decks_that_move_or_merge(rows: str, tmp_path: Path) -> None:
    assert read(tmp_path / "a.k", LSDYNA).n_cells == 1
    with pytest.raises(FileError, match="is not read; by it nodes or elements are others than those listed"):
        read(tmp_path / "b.k", LSDYNA.replace("*END", f"{rows}         1         1\n*END"))


@pytest.mark.parametrize(
    "change", [("*KEYWORD", "*KEYWORD LONG=Y"), ("*KEYWORD", "*KEYWORD i10=y"), ("*NODE", "*NODE %")]
)
def test_lsdyna_cards_in_other_columns(change: tuple[str, str], tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"long cards .* are not read; write standard ones"):
        read(tmp_path / "a.k", LSDYNA.replace(*change, 1))


def test_lsdyna_parts_go_by_their_whole_titles_and_segment_sets_by_their_numbers(tmp_path: Path) -> None:
    """Of "left ventricle" and "left atrium" the first word made one region; sets without a title were lost."""
    two = LSDYNA.replace(
        "*END\n", SOLID.split("\n", 1)[1].replace("       1       1       1", "       2       2       1")
    )
    # As PyDyna writes it, with attributes behind the nodes.
    two += f"*SET_SEGMENT\n         7{4 * '       0.0'}MECH\n{1:10d}{2:10d}{3:10d}{3:10d}{2 * '       0.0'}\n*END\n"
    for first, second, names in (
        ("left ventricle", "left atrium", ["left ventricle", "left atrium"]),
        ("wall", "wall", ["wall_1", "wall_2"]),
        ("wall", "", ["wall", None]),
    ):
        more = f"lv\n{1:10d}{1:10d}{1:10d}\n"
        assert more in two
        text = two.replace(more, f"{first}\n{1:10d}{1:10d}{1:10d}\n{second}\n{2:10d}{1:10d}{1:10d}\n")
        mesh = read(tmp_path / "a.k", text)
        own = mesh.info["tag_names"]
        assert mesh.region.tolist() == [2 if name is None else own[name] for name in names]
        assert mesh.facet_tag.tolist() == [7]


def test_febio_with_two_meshes_or_facets_of_seven_nodes(tmp_path: Path) -> None:
    nodes = "".join(f'<node id="{i}">{x},{y},{z}</node>' for i, (x, y, z) in enumerate(POINTS, 1))
    elements = '<Elements type="tet4" name="lv"><elem id="1">1,2,3,4</elem></Elements>'
    facets = '<Surface name="epi"><tri3 id="1">1,3,2</tri3><tri7 id="2">1,2,3,4,1,2,3</tri7></Surface>'
    text = f'<febio_spec version="4.0"><Mesh><Nodes>{nodes}</Nodes>{elements}{facets}</Mesh></febio_spec>'
    mesh = read(tmp_path / "a.feb", text)
    assert (mesh.n_cells, mesh.n_facets, mesh.info["source"]["left_out"]) == (1, 1, ["tri7"])
    with pytest.raises(FileError, match="holds several sections Mesh"):
        read(tmp_path / "b.feb", text.replace("</febio_spec>", "<Mesh/></febio_spec>"))
