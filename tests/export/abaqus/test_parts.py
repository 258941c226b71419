"""Abaqus decks of several parts, each with numbers of its own and put where its instance says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femprep.errors import FileError
from femprep.export import read_mesh
from femprep.mesh.measures.volume_elements import all_volumes
from femprep.model import REGION_TAGS

CORNERS = "1, 0, 0, 0\n2, 10, 0, 0\n3, 0, 10, 0\n4, 0, 0, 10\n"
DECK = f"""*Heading
*Part, name=Ventricle
*Node
{CORNERS}*Element, type=C3D4
1, 1, 2, 3, 4
*Elset, elset=Scar
1,
*End Part
*Part, name=Atrium
*Node
{CORNERS}*Element, type=C3D4
1, 1, 2, 3, 4
*End Part
*Assembly, name=Assembly
*Instance, name=Ventricle-1, part=Ventricle
*End Instance
*Instance, name=Atrium-1, part=Atrium
20, 0, 0
20, 0, 0, 20, 0, 1, 90
*End Instance
*Elset, elset=inner, instance=Atrium-1
1,
*Surface, type=ELEMENT, name=endo
inner, S1
Ventricle-1.1, S2
*End Assembly
"""


def test_parts_keep_numbers_of_their_own_and_lie_where_they_are_put(tmp_path: Path) -> None:
    (tmp_path / "heart.inp").write_text(DECK)
    mesh = read_mesh(tmp_path / "heart.inp")
    assert mesh.cells["tetra"].tolist() == [[0, 1, 2, 3], [4, 5, 6, 7]]
    np.testing.assert_allclose(all_volumes(mesh.points, mesh.cells), 1000.0 / 6.0)
    np.testing.assert_allclose(mesh.points[:4], [[0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10]])
    # Moved by 20 along x, then a quarter turn about the z axis through (20, 0, 0).
    np.testing.assert_allclose(mesh.points[4:], [[20, 0, 0], [20, 10, 0], [10, 0, 0], [20, 0, 10]], atol=1e-12)
    # S1 has corners 1, 2 and 3 of its element, S2 1, 4 and 2.
    assert {frozenset(row) for row in mesh.facets["triangle"].tolist()} == {frozenset((4, 5, 6)), frozenset((0, 3, 1))}
    assert len(np.unique(mesh.facet_tag)) == 1
    assert mesh.region.tolist() == [REGION_TAGS["scar"], mesh.info["tag_names"]["inner"]]


def test_elements_of_no_set_are_named_after_their_part(tmp_path: Path) -> None:
    (tmp_path / "heart.inp").write_text(
        DECK.replace("*Elset, elset=inner", "*Nset, nset=inner").replace("inner, S1\n", "")
    )
    mesh = read_mesh(tmp_path / "heart.inp")
    assert mesh.region.tolist() == [REGION_TAGS["scar"], mesh.info["tag_names"]["atrium"]]


def test_elements_written_within_an_instance_are_its_parts(tmp_path: Path) -> None:
    body = f"0, 0, 5\n*Node\n{CORNERS}*Element, type=C3D4\n1, 1, 2, 3, 4\n"
    assembly = f"*Assembly, name=B\n*Instance, name=A-1, part=A\n{body}*End Instance\n*End Assembly\n"
    (tmp_path / "heart.inp").write_text(f"*Part, name=A\n*End Part\n{assembly}")
    mesh = read_mesh(tmp_path / "heart.inp")
    assert mesh.cells["tetra"].tolist() == [[0, 1, 2, 3]]
    assert mesh.points.tolist() == [[0, 0, 5], [10, 0, 5], [0, 10, 5], [0, 0, 15]]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("part=Atrium", "part=Ventricle", "part 'Ventricle' is placed twice"),
        ("part=Atrium", "part=Vein", "instance 'Atrium-1' is of part 'Vein', which is not there"),
        (
            "1, 1, 2, 3, 4\n*End Part\n*Assembly",
            "1, 1, 2, 3, 9\n*End Part\n*Assembly",
            "node 9 is used but not defined",
        ),
    ],
)
def test_parts_that_do_not_fit_are_told(tmp_path: Path, old: str, new: str, words: str) -> None:
    (tmp_path / "heart.inp").write_text(DECK.replace(old, new))
    with pytest.raises(FileError, match=words):
        read_mesh(tmp_path / "heart.inp")
