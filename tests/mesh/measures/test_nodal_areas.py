"""Nodal areas: they add up to the facets' area, and are positive; normals are those of the surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from meshes import truncated_ellipsoid

from femprep.mesh.elements import ELEMENTS
from femprep.mesh.measures.nodal_areas import nodal_areas
from femprep.mesh.measures.triangles import areas
from femprep.model import VolumeMesh
from femprep.model.blocks import chosen_rows, nodes_of
from femprep.model.facets import split_facets


@pytest.mark.parametrize("kind", list(ELEMENTS))
@pytest.mark.parametrize("tag", ["epi", "endo", "base"])
def test_they_add_up_to_the_area(kind: str, tag: str) -> None:
    mesh = truncated_ellipsoid(kind)
    facets = chosen_rows(mesh.facets, mesh.facet_tag == mesh.facet_names[tag])
    area, _ = nodal_areas(mesh.points, facets)
    nodes = nodes_of(facets)
    assert np.all(area[nodes] > 0)
    assert np.all(np.delete(area, nodes) == 0)
    wanted = areas(mesh.points, split_facets(facets)).sum()
    # Straight triangles and plane quadrilaterals are as large as their triangles; others are a little bent.
    plane = ELEMENTS[kind].corners != 8 or tag == "base"
    assert area.sum() == pytest.approx(wanted, rel=1e-12 if plane else 2e-3)


def test_a_bent_quadrilateral_has_the_area_of_its_own_quadrature() -> None:
    """z = x y over the unit square: the integral of sqrt(1 + x^2 + y^2), by ten Gauss points each way."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 1], [0, 1, 0]], dtype=float)
    nodes, weights = np.polynomial.legendre.leggauss(10)
    x = (nodes + 1) / 2
    wanted = np.einsum("i,j,ij->", weights / 2, weights / 2, np.sqrt(1 + x[:, None] ** 2 + x[None] ** 2))
    area, normal = nodal_areas(points, {"quad": np.array([[0, 1, 2, 3]])})
    assert area.sum() == pytest.approx(wanted, rel=1e-5)
    # At (x, y) the normal is (-y, -x, 1).
    for point, own in zip(points, normal):
        straight = np.array([-point[1], -point[0], 1.0])
        np.testing.assert_allclose(own, straight / np.linalg.norm(straight), atol=1e-14)


def test_thirds_of_a_triangle() -> None:
    points = np.array([[0, 0, 0], [3, 0, 0], [0, 4, 0], [3, 4, 0]], dtype=float)
    area, normal = nodal_areas(points, {"triangle": np.array([[0, 1, 2], [1, 3, 2]])})
    np.testing.assert_allclose(area, [2, 4, 4, 2], rtol=1e-14)
    np.testing.assert_allclose(normal, np.tile([0, 0, 1.0], (4, 1)), atol=1e-15)


@pytest.mark.parametrize("kind", ["hexahedron", "tetra"])
def test_normals_tend_to_those_of_the_ellipsoid(kind: str) -> None:
    """In proportion to the edges, as the mesh is uneven; the ellipsoid's are its gradient."""
    errors = []
    for around in (16, 32):
        wall = _even(truncated_ellipsoid(kind, heights=around // 2, around=around, lean=0.0))
        facets = chosen_rows(wall.facets, wall.facet_tag == wall.facet_names["epi"])
        _, normal = nodal_areas(wall.points, facets)
        nodes = nodes_of(facets)
        inner = nodes[np.abs(wall.points[nodes, 2]) < 20]
        exact = wall.points[inner] / np.square([32.0, 32.0, 65.0])
        exact /= np.linalg.norm(exact, axis=1, keepdims=True)
        errors.append(np.abs(normal[inner] - exact).max())
    assert errors[0] < 0.1
    assert errors[0] / errors[1] > 1.9


def _even(mesh: VolumeMesh) -> VolumeMesh:
    """The wall without the bulge that keeps it from being an ellipsoid."""
    turn = np.arctan2(mesh.points[:, 1], mesh.points[:, 0])
    points = np.array(mesh.points)
    points[:, :2] /= (1 + 0.1 * np.cos(turn))[:, None]
    return replace(mesh, points=points)
