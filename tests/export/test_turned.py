"""Tetrahedra of files that have no order of nodes: turned where that is all, left where one is folded."""

from __future__ import annotations

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


def test_a_folded_element_stays() -> None:
    """A vertex pushed through the face opposite to it: turned, its element would hide that two overlap."""
    mesh = truncated_ellipsoid("tetra")
    points = mesh.points.copy()
    corner = mesh.cells["tetra"][0]
    points[corner[3]] = 2.0 * points[corner[:3]].mean(axis=0) - points[corner[3]]
    folded = fp.VolumeMesh(points=points, cells=dict(mesh.cells), region=mesh.region)
    assert (all_volumes(points, folded.cells) < 0).any()
    assert turned_tetrahedra(folded) is folded
