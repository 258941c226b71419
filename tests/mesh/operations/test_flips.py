"""What lies around the inner edges of triangles, on which flips rest."""

from __future__ import annotations

import numpy as np

from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.operations.flips import around_edges, flip_edges
from femprep.mesh.topology import edge_table
from femprep.template import charge_template


def test_a_square_of_two_triangles_has_one_inner_edge() -> None:
    cells = np.array([[0, 1, 2], [0, 2, 3]])
    pairs, corners = around_edges(cells, edge_table(cells))
    assert pairs.tolist() == [[0, 1]]
    assert corners.tolist() == [[2, 0, 1, 3]]  # from 2 to 0 in the first triangle, which 1 faces, and 3


def test_each_edge_of_a_closed_surface_is_faced_from_both_sides() -> None:
    cells = charge_template(100).cells
    pairs, corners = around_edges(cells, edge_table(cells))
    assert len(pairs) == 3 * len(cells) // 2
    for own, facing in zip(pairs.T, corners.T[2:]):
        assert (np.sort(np.column_stack([corners[:, :2], facing])) == np.sort(cells[own])).all()


def test_an_open_triangle_has_no_inner_edge() -> None:
    cells = np.array([[0, 1, 2]])
    pairs, corners = around_edges(cells, edge_table(cells))
    assert pairs.shape == (0, 2)
    assert corners.shape == (0, 4)


def test_flips_go_on_until_none_helps() -> None:
    """Only edges near the last flips are looked at again: none that is left out would have been flipped."""
    template = charge_template(300)
    rng = np.random.default_rng(7)
    points = template.directions + rng.normal(0.0, 0.06, template.directions.shape)
    points /= np.linalg.norm(points, axis=1)[:, None]
    area = np.full(len(points), 4.0 * np.pi / len(template.cells))
    cells, flips = flip_edges(points, points, template.cells, area, 0.1)
    assert flips > 20
    assert triangle_quality(points, cells).mean() > triangle_quality(points, template.cells).mean()
    again, more = flip_edges(points, points, cells, area, 0.1)
    assert more == 0
    assert (again == cells).all()
