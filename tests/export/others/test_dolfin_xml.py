"""DOLFIN XML: each vertex and cell once, or the file is refused."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.errors import FileError


@pytest.fixture
def path(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    mesh = truncated_ellipsoid(heights=2, around=6, layers=1)
    made = tmp_path / "mesh.xml"
    meshio.write(made, meshio.Mesh(mesh.points, list(mesh.cells.items())), "dolfin-xml")
    assert fp.read_mesh(made).n_cells == mesh.n_cells
    return made


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ('<vertex index="5"', '<vertex index="4"', "vertices"),
        ('<tetrahedron index="5"', '<tetrahedron index="4"', "cells"),
        ('<vertices size="', '<vertices size="9', "vertices"),
    ],
)
def test_what_is_not_there_once_is_refused(path: Path, old: str, new: str, what: str) -> None:
    """It was what was in the memory."""
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(FileError, match=f"{what}, and does not list each of them once"):
        fp.read_mesh(path)


def test_values_of_cells(path: Path) -> None:
    count = fp.read_mesh(path).n_cells
    rows = "".join(f'<entity index="{i}" value="{i + 1}"/>' for i in range(count))
    beside = path.with_name("mesh_load.xml")
    whole = f'<dolfin><mesh_function type="uint" dim="3" size="{count}">{rows}</mesh_function></dolfin>'
    beside.write_text(whole)
    assert fp.read_mesh(path).cell_data["load"].tolist() == list(range(1, count + 1))
    beside.write_text(whole.replace('index="3"', 'index="2"'))
    with pytest.raises(FileError, match="mesh_load"):
        fp.read_mesh(path)


def test_collections_of_values_as_dolfin_writes_them(tmp_path: Path) -> None:
    """Of cells they are regions, of facets (cell, and the node by its rank that the facet lies opposite to) tags."""
    path = tmp_path / "a.xml"
    points = np.array([(0, 0, 0), (9, 0, 0), (0, 9, 0), (0, 0, 9), (9, 9, 9)], dtype=float)
    meshio.write(path, meshio.Mesh(points, [("tetra", np.array([[0, 1, 2, 3], [1, 2, 3, 4]]))]), "dolfin-xml")

    def collection(dimension: int, *values: tuple[int, int, int]) -> str:
        rows = "".join(f'<value cell_index="{c}" local_entity="{e}" value="{v}"/>' for c, e, v in values)
        head = f'<mesh_value_collection name="f" type="uint" dim="{dimension}" size="{len(values)}">'
        return f"<dolfin><mesh_function>{head}{rows}</mesh_value_collection></mesh_function></dolfin>"

    path.with_name("a_physical_region.xml").write_text(collection(3, (1, 0, 9), (0, 0, 4)))
    path.with_name("a_facet_region.xml").write_text(collection(2, (0, 3, 60), (0, 0, 0), (1, 0, 61), (1, 0, 61)))
    path.with_name("a_edges.xml").write_text(collection(1, (0, 3, 60)))
    mesh = fp.read_mesh(path)
    assert mesh.region.tolist() == [4, 9]
    assert mesh.facets["triangle"].tolist() == [[0, 1, 2], [2, 3, 4]]
    assert mesh.facet_tag.tolist() == [60, 61]
    assert mesh.info["notices"][0]["what"] == "mesh functions edges are left out"
    for name, dimension, values, words in (
        ("physical_region", 3, [(2, 0, 9)], "a value of a cell that is not there"),
        ("physical_region", 3, [(1, 0, 9), (1, 0, 4)], "several values of a cell"),
        ("facet_region", 2, [(0, -1, 60)], "a value of a facet that no cell has"),
    ):
        beside = path.with_name(f"a_{name}.xml")
        whole = beside.read_text()
        beside.write_text(collection(dimension, *values))
        with pytest.raises(FileError, match=words):
            fp.read_mesh(path)
        beside.write_text(whole)
