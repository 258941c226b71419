from __future__ import annotations

import numpy as np
import pytest
import trimesh

from femprep.errors import InputError
from femprep.mesh.topology import (
    adjacency,
    border_edges,
    edge_table,
    euler_characteristic,
    fold_angles,
    is_closed,
    is_consistently_wound,
    is_manifold,
    loops_of,
    pieces,
    pinched_vertices,
    volume,
)


def arrays(mesh):
    return np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64)


BALL = arrays(trimesh.creation.icosphere(subdivisions=2))
TORUS = arrays(trimesh.creation.torus(2.0, 0.5))


def test_sphere_and_torus():
    for (points, cells), euler in ((BALL, 2), (TORUS, 0)):
        assert is_closed(cells)
        assert is_manifold(cells)
        assert is_consistently_wound(cells)
        assert euler_characteristic(cells) == euler
        assert pieces(cells).max() == 0
        assert volume(points, cells) > 0
        assert volume(points, cells[:, ::-1]) == pytest.approx(-volume(points, cells))
    assert euler_characteristic(np.r_[BALL[1], TORUS[1] + len(BALL[0])]) == 2


def test_edge_table_of_a_tetrahedron():
    cells = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    table = edge_table(cells)
    assert table.nodes.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]
    assert table.count.tolist() == [2] * 6
    assert table.forward.tolist() == [1] * 6
    assert table.cells.tolist() == [[0, 1], [0, 3], [1, 3], [0, 2], [1, 2], [2, 3]]
    for number, cell in enumerate(cells):
        for side in range(3):
            nodes = {int(cell[side]), int(cell[(side + 1) % 3])}
            assert set(table.nodes[table.of_cell[number, side]].tolist()) == nodes


def test_quadrilaterals_of_a_cube():
    quads = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
    assert is_manifold(quads)
    assert is_consistently_wound(quads)
    assert euler_characteristic(quads) == 2
    assert len(border_edges(quads[1:])) == 4


def test_a_hole_a_flip_and_a_branch_are_seen():
    _, cells = BALL
    assert not is_closed(cells[1:])
    border = border_edges(cells[1:])
    assert {tuple(e) for e in border.tolist()} == {
        tuple(e[::-1]) for e in np.c_[cells[0], np.roll(cells[0], -1)].tolist()
    }
    flipped = cells.copy()
    flipped[7] = flipped[7, ::-1]
    assert is_closed(flipped)
    assert not is_consistently_wound(flipped)
    branch = np.vstack([cells, [cells[0, 0], cells[0, 1], len(BALL[0])]])
    assert not is_closed(branch)
    assert not is_consistently_wound(branch)
    assert not is_closed(np.empty((0, 3), dtype=int))


def test_two_balls_joined_at_a_point_are_closed_and_no_manifold():
    points, cells = BALL
    other = cells + len(points)
    both = np.r_[cells, np.where(other == len(points), 0, other)]
    assert is_closed(both)
    assert pinched_vertices(both).tolist() == [0]
    assert not is_manifold(both)
    assert np.bincount(pieces(both)).tolist() == [len(cells), len(cells)]


@pytest.mark.parametrize("cells", [TORUS[1], TORUS[1][:100]], ids=["closed", "open"])
def test_the_ends_of_every_side_are_adjacent_once(cells):
    matrix = adjacency(cells, len(TORUS[0]))
    found = np.stack(matrix.nonzero(), axis=1)
    ends = edge_table(cells).nodes
    np.testing.assert_array_equal(found[found[:, 0] < found[:, 1]], ends)
    assert (matrix != matrix.T).nnz == 0
    assert set(matrix.data) == {1.0}


def test_volumes():
    box = arrays(trimesh.creation.box(extents=(2, 3, 4)))
    assert volume(box[0] + 1e4, box[1]) == pytest.approx(24.0, rel=1e-12)


def test_fold_angles():
    points, cells = arrays(trimesh.creation.box())
    pairs, angle = fold_angles(points, cells)
    assert len(pairs) == 18
    assert np.round(np.sort(angle), 9).tolist() == [0.0] * 6 + [90.0] * 12
    hinge = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 1e-9]])
    assert fold_angles(hinge, np.array([[0, 1, 2], [1, 0, 3]]))[1][0] == pytest.approx(180.0, abs=1e-6)
    with pytest.raises(InputError, match="not consistently wound"):
        fold_angles(hinge, np.array([[0, 1, 2], [0, 1, 3]]))


@pytest.mark.parametrize(
    "edges",
    [
        [[0, 1], [1, 2], [2, 0], [0, 3], [3, 4], [4, 0]],  # two rims through a node
        [[0, 1], [2, 1], [2, 0]],  # cells that are not wound alike
        [[0, 1], [1, 2]],
    ],
)
def test_rims_that_are_no_rings_are_refused(edges: list[list[int]]) -> None:
    with pytest.raises(InputError, match="touches itself at a node, or the cells along it are not wound alike"):
        loops_of(np.array(edges))
