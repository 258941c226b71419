"""Cutting wedges and hexahedra into tetrahedra: conforming, positive, volume and tags kept."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import mixed, truncated_ellipsoid, with_fibres

from femprep.export.deck.split import to_tetrahedra
from femprep.mesh.elements import boundary_faces, match_facets
from femprep.mesh.operations.element_tets import element_tets

CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1.0]])
PRISM = CUBE[[0, 1, 3, 4, 5, 7]]


def volumes(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    p = points[tets]
    return np.linalg.det(p[:, 1:] - p[:, :1]) / 6


@settings(deadline=None, max_examples=60)
@given(st.permutations(range(8)))
def test_cube_of_any_numbering_gives_positive_tets_of_its_volume(order: list[int]) -> None:
    points = np.empty((8, 3))
    points[order] = CUBE
    tets, row = element_tets("hexahedron", np.array([order]))
    assert volumes(points, tets).min() > 0
    assert volumes(points, tets).sum() == pytest.approx(1.0, abs=1e-14)
    assert row.tolist() == [0] * 6


@settings(deadline=None, max_examples=60)
@given(st.permutations(range(6)))
def test_wedge_of_any_numbering(order: list[int]) -> None:
    points = np.empty((6, 3))
    points[order] = PRISM
    tets, _ = element_tets("wedge", np.array([order]))
    assert len(tets) == 3
    assert volumes(points, tets).min() > 0
    assert volumes(points, tets).sum() == pytest.approx(0.5, abs=1e-14)


@pytest.mark.parametrize("kind", ["wedge", "hexahedron", "wedge15", "hexahedron20", "mixed"])
def test_neighbours_agree_and_facets_are_faces(kind: str) -> None:
    mesh = with_fibres(mixed() if kind == "mixed" else truncated_ellipsoid(kind))
    cut = to_tetrahedra(mesh)
    assert volumes(cut.points, cut.cells["tetra"]).min() > 0
    # Every face that belongs to one tetrahedron alone is a tagged facet, and the other way round.
    assert len(boundary_faces(cut.cells)["triangle"].nodes) == cut.n_facets
    element, _ = match_facets(cut.cells, cut.facets)
    assert element.min() >= 0
    assert cut.facet_names == mesh.facet_names
    for tag in mesh.region_names.values():
        assert np.sum(cut.region == tag) % 3 == 0
    assert len(cut.cell_data["fiber"]) == cut.n_cells


def test_tetrahedra_stay_as_they_are() -> None:
    mesh = truncated_ellipsoid("tetra")
    cut = to_tetrahedra(mesh)
    assert np.array_equal(cut.cells["tetra"], mesh.cells["tetra"])
    assert np.array_equal(cut.facets["triangle"], mesh.facets["triangle"])
