"""XDMF of a mesh and its tags as dolfinx writes it: several grids, tags of some elements, in any order."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
from notices import reported

import femprep as fp
from femprep.errors import FileError

POINTS = np.array([(0, 0, 0), (9, 0, 0), (0, 9, 0), (0, 0, 9), (9, 9, 9)], dtype=float)
CELLS = np.array([[0, 1, 2, 3], [1, 3, 2, 4]])
ITEM = '<DataItem Dimensions="{}" Format="HDF">a.h5:/{}</DataItem>'
INCLUDE = '<xi:include xpointer="xpointer(/Xdmf/Domain/Grid/Geometry)" />'


def written(folder: Path, *tags: tuple[str, str, np.ndarray, np.ndarray]) -> Path:
    """A mesh of two tetrahedra, the second of which is negative, and tags: name, topology, nodes, values."""
    with h5py.File(folder / "a.h5", "w") as store:
        store["geometry"], store["topology"] = POINTS, CELLS
        for name, _, rows, values in tags:
            store[f"{name}/topology"], store[f"{name}/values"] = rows, values[:, None]
    grids = [
        '<Grid Name="mesh" GridType="Uniform"><Topology TopologyType="Tetrahedron" NumberOfElements="2">'
        f'{ITEM.format("2 4", "topology")}</Topology><Geometry GeometryType="XYZ">{ITEM.format("5 3", "geometry")}'
        "</Geometry></Grid>"
    ]
    for name, kind, rows, values in tags:
        size = f"{rows.shape[0]} {rows.shape[1]}"
        grids.append(
            f'<Grid Name="{name}" GridType="Uniform">{INCLUDE}<Topology TopologyType="{kind}">'
            f'{ITEM.format(size, f"{name}/topology")}</Topology><Attribute Name="{name}" Center="Cell">'
            f"{ITEM.format(f'{len(values)} 1', f'{name}/values')}</Attribute></Grid>"
        )
    path = folder / "a.xdmf"
    head = '<Xdmf Version="3.0" xmlns:xi="http://www.w3.org/2001/XInclude"><Domain>'
    path.write_text(f"{head}{''.join(grids)}</Domain></Xdmf>")
    return path


def test_tags_are_found_by_their_nodes(tmp_path: Path) -> None:
    tags = (
        ("cells", "Tetrahedron", CELLS[::-1, ::-1], np.array([7, 9])),
        ("scar", "Tetrahedron", CELLS[1:], np.array([3])),
        ("facets", "Triangle", np.array([[0, 1, 2]]), np.array([60])),
        ("edges", "PolyLine", np.array([[0, 1]]), np.array([1])),
    )
    mesh = fp.read_mesh(written(tmp_path, *tags))
    assert mesh.region.tolist() == [9, 7]
    assert mesh.cell_data["scar"].tolist() == [0, 3]
    assert np.sort(mesh.facets["triangle"]).tolist() == [[0, 1, 2]]
    assert mesh.facet_tag.tolist() == [60]
    assert reported(mesh) == [
        "grids edges of the file are left out",
        "1 of 2 tetrahedra, whose nodes the file lists the other way round, are turned",
    ]


def test_tags_of_what_is_not_there_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path, ("cells", "Tetrahedron", np.array([[0, 1, 2, 4]]), np.array([7])))
    with pytest.raises(FileError, match="'cells' tags an element that the mesh does not have"):
        fp.read_mesh(path)


def test_the_first_of_several_steps(tmp_path: Path) -> None:
    path = written(tmp_path)
    text = path.read_text()
    grid = text[text.index("<Grid") : text.index("</Domain>")]
    values = ITEM.format("5", "values")
    first = grid.replace("</Grid>", f'<Time Value="0"/><Attribute Name="p" Center="Node">{values}</Attribute></Grid>')
    both = f'<Grid Name="steps" GridType="Collection" CollectionType="Temporal">{first}{grid}</Grid>'
    path.write_text(text.replace(grid, both))
    with h5py.File(tmp_path / "a.h5", "a") as store:
        store["values"] = np.arange(5.0)
    mesh = fp.read_mesh(path)
    assert mesh.point_data["p"].tolist() == [0, 1, 2, 3, 4]
    assert mesh.info["notices"][0]["what"] == "of 2 steps in time the first is read"
