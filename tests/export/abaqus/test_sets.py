"""Element sets of a deck: which one names a region where several hold an element, in any case, and part by part."""

from __future__ import annotations

from pathlib import Path

import pytest
from notices import reported

import femprep as fp
from femprep.errors import FileError

POINTS = [(0, 0, 0), (9, 0, 0), (0, 9, 0), (0, 0, 9), (9, 9, 9), (20, 20, 0)]
NODES = "".join(f"{i}, {x}, {y}, {z}\n" for i, (x, y, z) in enumerate(POINTS, 1))
DECK = f"*NODE\n{NODES}*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n2, 5, 4, 3, 2\n3, 3, 2, 5, 6\n"
WHOLE, LEFT, RIGHT = (
    "*ELSET, ELSET={}\n{}\n".format(*one) for one in (("whole", "1, 2, 3"), ("a", "1"), ("b", "2, 3"))
)


def read(path: Path, text: str) -> fp.VolumeMesh:
    path.write_text(text)
    return fp.read_mesh(path)


def names_of(mesh: fp.VolumeMesh, tags: list[int]) -> list[str]:
    own = {number: name for name, number in mesh.info["tag_names"].items()}
    return [own[tag] for tag in tags]


@pytest.mark.parametrize(
    ("sets", "regions"),
    [
        (WHOLE + LEFT + RIGHT, "a b b"),
        (WHOLE, "whole whole whole"),
        (LEFT + RIGHT.replace("=b", "=A").replace("2, 3", "2"), "a a"),
        ("*ELSET, ELSET=probe\n1\n*ELSET, ELSET=wall\n1, 2\n" + RIGHT + "*SOLID SECTION, ELSET=WALL\n", "wall wall b"),
    ],
)
def test_a_set_with_a_material_comes_first_and_one_of_all_last(sets: str, regions: str, tmp_path: Path) -> None:
    mesh = read(tmp_path / "a.inp", DECK + sets)
    assert names_of(mesh, [tag for tag in mesh.region.tolist() if tag]) == regions.split()


def test_sets_that_share_elements_are_told(tmp_path: Path) -> None:
    mesh = read(tmp_path / "a.inp", DECK + LEFT + "*ELSET, ELSET=tip\n1, 2\n" + RIGHT)
    (notice,) = reported(mesh)
    assert notice == "an element has one region: groups tip, b lack those that are in another group as well"
    assert not reported(read(tmp_path / "b.inp", DECK + WHOLE + LEFT + RIGHT))


def test_sets_and_surfaces_of_one_name_in_two_parts_stay_apart(tmp_path: Path) -> None:
    """The names that Abaqus/CAE gives, Set-1 and Surf-1, begin anew in each part."""
    body = DECK + "*ELSET, ELSET=Set-1\n1, 2, 3\n*SURFACE, NAME=Surf-1\nSet-1, S1\n"
    parts = "".join(f"*PART, NAME={name}\n{body}*END PART\n" for name in ("Left", "Right"))
    placed = "".join(f"*INSTANCE, NAME={name}-1, PART={name}\n*END INSTANCE\n" for name in ("Left", "Right"))
    mesh = read(tmp_path / "a.inp", f"{parts}*ASSEMBLY, NAME=A\n{placed}*END ASSEMBLY\n")
    assert names_of(mesh, mesh.region.tolist()) == ["left_Set-1"] * 3 + ["right_Set-1"] * 3
    assert names_of(mesh, mesh.facet_tag.tolist()) == ["left_Surf-1"] * 3 + ["right_Surf-1"] * 3


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("2, 3\n", "2, 3.5\n", "an element 3.5, expected a whole number"),
        ("2, 3\n", "2, -3\n", "an element -3, expected a whole number"),
        ("1, 0, 0, 0\n", "1.5, 0, 0, 0\n", "the list of nodes holds 1.5, expected whole numbers"),
    ],
)
def test_numbers_that_are_not_whole_are_refused(old: str, new: str, match: str, tmp_path: Path) -> None:
    """The first was taken for the name of a set that is not there, the last one for node 1."""
    text = DECK + LEFT + RIGHT
    assert old in text
    with pytest.raises(FileError, match=match):
        read(tmp_path / "a.inp", text.replace(old, new))


@pytest.mark.parametrize("keyword", ["ELSET, ELSET", "NSET, NSET"])
def test_a_range_is_no_longer_than_what_there_is(keyword: str, tmp_path: Path) -> None:
    """Sixteen gigabytes were asked for."""
    mesh = read(tmp_path / "a.inp", DECK + f"*{keyword}=s, GENERATE\n2, 2000000000, 1\n")
    assert [bool(tag) for tag in mesh.region.tolist()] == ([False, True, True] if keyword[0] == "E" else [False] * 3)
    mesh = read(tmp_path / "b.inp", DECK + "*ELSET, ELSET=s, GENERATE\n1, 9, 2\n")
    assert [bool(tag) for tag in mesh.region.tolist()] == [True, False, True]


@pytest.mark.parametrize("row", ["1, 9, 0", "9, 1", "9, 1, -2", "1", "1, 2, 3, 4", "a, b"])
def test_a_range_that_is_none_is_refused(row: str, tmp_path: Path) -> None:
    with pytest.raises(FileError, match=f"GENERATE holds '{row}', expected the first number"):
        read(tmp_path / "a.inp", DECK + f"*ELSET, ELSET=s, GENERATE\n{row}\n")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("*ELEMENT, TYPE=C3D4\n", "*ELEMENT,\n TYPE=C3D4,\n  ELSET=whole\n"),
        ("*ELEMENT, TYPE=C3D4\n", "*ELEMENT, TYPE=C3D4, ELSET=whole,\n"),
        (DECK, DECK + "*ELSET, ELSET=whole,\nGENERATE\n1, 3\n"),
    ],
)
def test_a_keyword_goes_on_behind_a_comma(old: str, new: str, tmp_path: Path) -> None:
    mesh = read(tmp_path / "a.inp", DECK.replace(old, new))
    assert names_of(mesh, mesh.region.tolist()) == ["whole"] * 3


def test_a_set_and_a_surface_of_one_name(tmp_path: Path) -> None:
    mesh = read(tmp_path / "a.inp", DECK + LEFT + "*SURFACE, NAME=a\n1, S1\n*SURFACE, NAME=lv\n2, S1\n")
    assert list(mesh.region_names)[1:] == ["a"]
    assert list(mesh.facet_names) == ["a", "lv"]
    assert not set(mesh.region.tolist()) & set(mesh.facet_tag.tolist())


def test_an_include_without_a_file(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"\*INCLUDE names no file; write it as \*INCLUDE, INPUT=name"):
        read(tmp_path / "a.inp", DECK + "*INCLUDE\n")
