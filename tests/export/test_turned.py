"""Tetrahedra of files that have no order of nodes: turned where that is all, left where one is folded."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.export.turned import turned_tetrahedra
from femprep.mesh.measures.volume_elements import all_volumes


@pytest.mark.parametrize("kind", ["tetra", "tetra10"])
def test_nodes_in_the_order_of_their_numbers(kind: str) -> None:
    mesh = truncated_ellipsoid(kind)
    order = [1, 0, 2, 3] if kind == "tetra" else [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]
    rows = mesh.cells[kind].copy()
    some = np.arange(len(rows)) % 3 == 0
    rows[some] = rows[some][:, order]
    spoiled = fp.VolumeMesh(points=mesh.points, cells={kind: rows}, region=mesh.region)
    assert fp.check(spoiled).validity.inverted_elements == some.sum()
    found = turned_tetrahedra(spoiled)
    np.testing.assert_array_equal(found.cells[kind], mesh.cells[kind])
    (notice,) = found.info["notices"]
    assert (notice["amount"], notice["kind"]) == (some.sum(), "assumed")
    assert turned_tetrahedra(found) is found
    assert turned_tetrahedra(spoiled, 0.4) is spoiled


def test_a_folded_element_stays() -> None:
    """A vertex pushed through the face opposite to it: turned, its element would hide that two overlap."""
    mesh = truncated_ellipsoid("tetra")
    points = mesh.points.copy()
    corner = mesh.cells["tetra"][0]
    points[corner[3]] = 2.0 * points[corner[:3]].mean(axis=0) - points[corner[3]]
    folded = fp.VolumeMesh(points=points, cells=dict(mesh.cells), region=mesh.region)
    assert (all_volumes(points, folded.cells) < 0).any()
    assert turned_tetrahedra(folded) is folded


def test_vtk_files_of_fenics_and_ones_with_a_fault(tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra")
    rows = mesh.cells["tetra"].copy()
    rows[::2] = rows[::2][:, [1, 0, 2, 3]]
    meshio.Mesh(mesh.points, [("tetra", rows)]).write(tmp_path / "a.vtu")
    assert fp.check(fp.read_mesh(tmp_path / "a.vtu")).validity.inverted_elements == 0
    rows = mesh.cells["tetra"].copy()
    rows[0] = rows[0][[1, 0, 2, 3]]
    meshio.Mesh(mesh.points, [("tetra", rows)]).write(tmp_path / "b.vtu")
    assert fp.check(fp.read_mesh(tmp_path / "b.vtu")).validity.inverted_elements == 1
