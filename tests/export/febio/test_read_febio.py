"""What an FEBio model of others may say twice, in another order, or of some elements alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from meshes import truncated_ellipsoid, with_fibres

import femprep as fp
from femprep.errors import FileError

MESH = with_fibres(truncated_ellipsoid("hexahedron"))


def written(folder: Path, *changes: tuple[str, str]) -> Path:
    path = fp.write_mesh(MESH, folder / "mesh.feb")[0]
    text = path.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text)
    return path


def test_directions_are_those_of_their_elements(tmp_path: Path) -> None:
    """``lid`` is the place of an element in its set; rows stand in any order."""
    whole = fp.read_mesh(written(tmp_path))
    text = (tmp_path / "mesh.feb").read_text()
    first, second = text[text.index('<elem lid="1">') :].splitlines()[:2]
    turned = fp.read_mesh(written(tmp_path, (f"{first}\n{second}\n", f"{second}\n{first}\n")))
    for name in ("fiber", "sheet"):
        np.testing.assert_array_equal(turned.cell_data[name], whole.cell_data[name])
    assert "notices" not in whole.info


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('<node id="5">', '<node id="4">', "node 4 is defined 2 times; keep one"),
        ('<elem id="5">', '<elem id="4">', "element 4 is defined 2 times; keep one"),
        ('<elem lid="5">', '<elem lid="4">', "mat_axis of .* has other elements than 1 to"),
    ],
)
def test_what_is_said_twice_is_refused(old: str, new: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(FileError, match=words):
        fp.read_mesh(written(tmp_path, (old, new)))


def test_a_facet_that_is_listed_again_is_taken_once(tmp_path: Path) -> None:
    whole = fp.read_mesh(written(tmp_path))
    text = (tmp_path / "mesh.feb").read_text()
    facet = text[text.index('<quad4 id="3"') :].splitlines()[0]
    mesh = fp.read_mesh(written(tmp_path, (facet, f"{facet}\n{facet}")))
    assert mesh.n_facets == whole.n_facets
    assert [one["what"] for one in mesh.info["notices"]] == [
        "1 facets are listed again under the same name, and taken once"
    ]


def test_directions_of_another_set_are_told(tmp_path: Path) -> None:
    name = next(iter(MESH.region_names))
    found = fp.read_mesh(written(tmp_path, (f'elem_set="{name}"', 'elem_set="some"')))
    assert "fiber" not in found.cell_data
    own, total = int(np.sum(MESH.region == MESH.region_names[name])), MESH.n_cells
    assert {one["what"] for one in found.info["notices"]} == {
        "directions of 'some' are left out: there are no Elements of that name",
        *(f"{array} is left out: {own} elements of {total} have none" for array in ("fiber", "sheet")),
    }
