"""Elements that hang on a mesh by an edge are left out, the fewest that do; what touches otherwise stays."""

from __future__ import annotations

import numpy as np
import pytest
from meshes import truncated_ellipsoid

from femprep.mesh.elements import boundary_faces
from femprep.mesh.measures.volume_elements import element_volumes
from femprep.mesh.topology import edge_table, is_manifold
from femprep.model import FACET_TAGS, FloatArray, IntArray, Wall
from femprep.volume import check, runs, tetrahedralize
from femprep.volume.pinches import without_pinches
from femprep.volume.tetwild.guard import TetwildRun


@pytest.fixture(scope="module")
def body():
    """A wall, and what it fills."""
    mesh = truncated_ellipsoid("tetra", heights=6, around=24, layers=1, lean=0.0)
    nodes = mesh.facets["triangle"]
    return mesh, Wall(mesh.points, nodes, mesh.facet_tag, np.full(len(mesh.points), -1), mesh.planes)


def facets_of(cells: IntArray) -> IntArray:
    return boundary_faces({"tetra": cells})["triangle"].nodes


def hung(body, count: int, elements: int = 1) -> tuple[FloatArray, IntArray]:
    """Its points and elements with chains of so many more on edges of the epicardium, outside of it."""
    mesh, wall = body
    points, cells = [mesh.points], [mesh.cells["tetra"]]
    own = wall.triangles[wall.facet_tag == FACET_TAGS["epi"]]
    table = edge_table(own)
    inner = table.nodes[table.count == 2]
    centre = mesh.points.mean(axis=0)
    n = len(mesh.points)
    for edge in inner[:: len(inner) // count][:count]:
        ends = mesh.points[edge]
        middle = ends.mean(axis=0)
        out = (middle - centre) / np.linalg.norm(middle - centre)
        along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        side = np.cross(out, along)
        # The second element shares a face with the first, and the first end of the edge with the body.
        extra = [middle + out + 0.3 * side, middle + out - 0.3 * side, middle + 1.5 * out - along]
        chain = np.array([[*edge, n, n + 1], [edge[0], n, n + 1, n + 2]][:elements])
        points.append(np.array(extra[: elements + 1]))
        n += elements + 1
        cells.append(chain)
    every, all_cells = np.concatenate(points), np.concatenate(cells)
    turned = element_volumes(every, all_cells, "tetra") < 0.0
    all_cells[turned] = all_cells[turned][:, [1, 0, 2, 3]]
    return every, all_cells


@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("elements", [1, 2])
def test_what_hangs_on_an_edge_is_left_out(body, count, elements):
    mesh, _ = body
    points, cells = hung(body, count, elements)
    assert not is_manifold(facets_of(cells))
    found, places = without_pinches(points, cells)
    assert len(places) == count
    assert is_manifold(facets_of(found))
    assert {tuple(sorted(row)) for row in found.tolist()} == {
        tuple(sorted(row)) for row in mesh.cells["tetra"].tolist()
    }


def test_a_mesh_that_touches_itself_in_many_edges_stays(body):
    points, cells = hung(body, 8)
    found, places = without_pinches(points, cells)
    assert found is cells
    assert len(places) == 0


def test_a_sound_mesh_stays(body):
    cells = body[0].cells["tetra"]
    found, places = without_pinches(body[0].points, cells)
    assert found is cells
    assert len(places) == 0


def test_a_run_that_gives_such_a_mesh_is_a_mesh(body, monkeypatch):
    """Before, such a run came to nothing: three of them left both ventricles of a dilated heart without a mesh."""
    _, wall = body
    points, cells = hung(body, 1)
    monkeypatch.setattr(runs, "run_tetwild", lambda *_, **__: TetwildRun(points.copy(), cells.copy(), 1.0, None, 1.0))
    options = {"edge_length": 5.0, "retries": 0, "minimum_dihedral": 0.0, "mean_ratio": 0.0}
    mesh = tetrahedralize(wall, refinement="none", **options)
    assert mesh.info["pinched_edges"] == 1
    assert any("touched itself in an edge" in note["what"] for note in mesh.info["notices"])
    assert check(mesh).validity.non_manifold_boundary_points == 0
