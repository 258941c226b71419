"""Decks that take other files in: read with them, or refused with the file that is missing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from meshes import truncated_ellipsoid, with_fibres
from slow_params import slow_but

from femprep.errors import FileError
from femprep.export import read_mesh, write_format

POINTS = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
NODES = "".join(f"{n}, {x}, {y}, {z}\n" for n, (x, y, z) in enumerate(POINTS, 1))


def test_an_abaqus_deck_takes_in_nodes_and_elements(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "nodes.txt").write_text(NODES)
    (tmp_path / "parts" / "elements.inp").write_text("*ELEMENT, TYPE=C3D4, ELSET=lv\n1, 1, 2, 3, 4\n")
    (tmp_path / "mesh.inp").write_text("*NODE, INPUT=nodes.txt\n*INCLUDE, INPUT=parts\\elements.inp\n")
    (tmp_path / "deck.inp").write_text('*HEADING\nheart\n*Include, input="mesh.inp"\n*STEP\n*END STEP\n')
    mesh = read_mesh(tmp_path / "deck.inp")
    assert mesh.points.tolist() == POINTS
    assert mesh.cells["tetra"].tolist() == [[0, 1, 2, 3]]
    assert set(mesh.region_names) == {"lv"}


def test_data_lines_go_on_in_the_file_taken_in(tmp_path: Path) -> None:
    first, rest = NODES.split("\n", 1)
    (tmp_path / "rest.txt").write_text(rest)
    (tmp_path / "deck.inp").write_text(
        f"*NODE\n{first}\n*INCLUDE, INPUT=rest.txt\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n"
    )
    assert read_mesh(tmp_path / "deck.inp").points.tolist() == POINTS


@pytest.mark.parametrize(("name", "main"), [("ls-dyna", "mesh.k"), ("febio", "mesh.feb")])
def test_a_mesh_in_a_file_of_its_own_is_that_of_the_deck(tmp_path: Path, name: str, main: str) -> None:
    mesh = with_fibres(truncated_ellipsoid("tetra"))
    write_format(mesh, tmp_path, name)
    alone = read_mesh(tmp_path / main)
    if name == "ls-dyna":
        (tmp_path / "deck.k").write_text(
            f"*KEYWORD\n$ loads below\n*INCLUDE\n$ the mesh\n{main}\n*CONTROL_TERMINATION\n1.0\n*END\n"
        )
    else:
        sections = "".join(f'<{section} from="{main}"/>' for section in ("Mesh", "MeshData"))
        (tmp_path / "deck.feb").write_text(f'<febio_spec version="4.0"><Module type="solid"/>{sections}</febio_spec>\n')
    found = read_mesh(tmp_path / f"deck{Path(main).suffix}")
    np.testing.assert_array_equal(found.points, alone.points)
    np.testing.assert_array_equal(found.cells["tetra"], alone.cells["tetra"])
    np.testing.assert_array_equal(found.facet_tag, alone.facet_tag)
    np.testing.assert_array_equal(found.cell_data["fiber"], alone.cell_data["fiber"])


INCLUDES = {
    "deck.inp": "*HEADING\n*INCLUDE, INPUT={}\n",
    "deck.k": "*KEYWORD\n*INCLUDE\n{}\n*END\n",
    "deck.feb": '<febio_spec version="4.0"><Mesh from="{}"/></febio_spec>\n',
}


@pytest.mark.parametrize("deck", INCLUDES)
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("gone.txt", "takes in the file 'gone.txt', which is not in its folder"),
        ("../outside.txt", "takes in the file '../outside.txt', which lies elsewhere"),
        ("/etc/hostname", "takes in the file '/etc/hostname', which lies elsewhere"),
        ("{deck}", "cannot take in itself"),
    ],
)
def test_a_file_that_cannot_be_taken_in_is_named(tmp_path: Path, deck: str, name: str, words: str) -> None:
    (tmp_path / deck).write_text(INCLUDES[deck].format(name.format(deck=deck)))
    with pytest.raises(FileError, match=words):
        read_mesh(tmp_path / deck)


def test_what_lsdyna_would_move_is_refused(tmp_path: Path) -> None:
    (tmp_path / "deck.k").write_text("*KEYWORD\n*INCLUDE_TRANSFORM\nmesh.k\n*END\n")
    with pytest.raises(FileError, match=r"\*INCLUDE_TRANSFORM is not followed"):
        read_mesh(tmp_path / "deck.k")


def test_a_febio_file_without_the_section_asked_for_is_told(tmp_path: Path) -> None:
    (tmp_path / "other.feb").write_text('<febio_spec version="4.0"></febio_spec>')
    (tmp_path / "deck.feb").write_text(INCLUDES["deck.feb"].format("other.feb"))
    with pytest.raises(FileError, match=r"takes its Mesh from 'other\.feb', which has none"):
        read_mesh(tmp_path / "deck.feb")


@pytest.mark.parametrize("suffix", slow_but([".inp"], [".inp", ".k", ".feb"]))
def test_files_that_double_with_each_step_come_to_an_end(tmp_path: Path, suffix: str) -> None:
    doubled = {
        ".inp": "*INCLUDE, INPUT={0}\n*INCLUDE, INPUT={0}\n",
        ".k": "*KEYWORD\n*INCLUDE\n{0}\n{0}\n*END\n",
        ".feb": '<febio_spec version="4.0"><Mesh from="{0}"/><Mesh from="{0}"/></febio_spec>\n',
    }[suffix]
    for step in range(40):
        (tmp_path / f"{step}{suffix}").write_text(doubled.format(f"{step + 1}{suffix}"))
    (tmp_path / f"40{suffix}").write_text('<febio_spec version="4.0"><Mesh/></febio_spec>' if suffix == ".feb" else "")
    with pytest.raises(FileError, match="one more than the 1000 that a deck may take in"):
        read_mesh(tmp_path / f"0{suffix}")
