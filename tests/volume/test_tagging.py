import numpy as np
import pytest
from analytic_walls import ellipsoid_wall

from femprep.errors import StageError
from femprep.mesh.measures.triangles import areas, normals
from femprep.mesh.topology import border_edges, pieces
from femprep.model import FACET_TAGS, Wall
from femprep.volume.tagging import tag_facets

ENDO, EPI, BASE = (FACET_TAGS[name] for name in ("endo", "epi", "base"))


def test_wall_tags_itself():
    wall = ellipsoid_wall(rings=8, layers=3)
    np.testing.assert_array_equal(tag_facets(wall.points, wall.triangles, wall, 0.1), wall.facet_tag)


def test_facets_moved_within_the_envelope_keep_their_tags():
    wall = ellipsoid_wall(rings=8, layers=3)
    moved = wall.points + np.random.default_rng(0).uniform(-0.08, 0.08, wall.points.shape)
    np.testing.assert_array_equal(tag_facets(moved, wall.triangles, wall, 0.15), wall.facet_tag)


def test_steep_rims_are_told_apart_by_normals():
    """Where endocardium and base meet at a blunt angle both are near; a thin wall has both sides near."""
    wall = ellipsoid_wall((20.0, 20.0, 30.0), (21.0, 21.0, 31.0), height=18.0, rings=20, layers=2)
    tags = tag_facets(wall.points, wall.triangles, wall, 0.3)
    np.testing.assert_array_equal(tags, wall.facet_tag)


def test_tags_of_a_mesh_lie_where_the_surfaces_are(coarse_wall, coarse_mesh):
    facets, tag, points = coarse_mesh.facets["triangle"], coarse_mesh.facet_tag, coarse_mesh.points
    assert set(np.unique(tag)) == {ENDO, EPI, BASE}
    middle = points[facets].mean(axis=1)
    inner = np.linalg.norm(middle / np.array([22.0, 22.0, 42.0]), axis=1)
    outer = np.linalg.norm(middle / np.array([31.0, 31.0, 51.0]), axis=1)
    assert np.all(np.abs(inner[tag == ENDO] - 1) < 0.06)
    assert np.all(np.abs(outer[tag == EPI] - 1) < 0.06)
    flat = (points[facets][:, :, 2] == 10.0).all(axis=1)
    np.testing.assert_array_equal(flat, tag == BASE)
    assert np.all(normals(points, facets)[flat] @ [0, 0, 1] > 1 - 1e-12)
    for name in (ENDO, EPI, BASE):
        area, expected = (
            areas(points, facets[tag == name]).sum(),
            areas(coarse_wall.points, coarse_wall.triangles[coarse_wall.facet_tag == name]).sum(),
        )
        assert area == pytest.approx(expected, rel=0.02)


def test_rims_are_single_closed_rings(coarse_mesh):
    facets, tag = coarse_mesh.facets["triangle"], coarse_mesh.facet_tag
    for name, rings in ((ENDO, 1), (EPI, 1), (BASE, 2)):
        own = facets[tag == name]
        assert pieces(own).max() == 0
        border = border_edges(own)
        # Each rim point starts one edge and ends one, and the edges form the expected number of loops.
        assert len(np.unique(border[:, 0])) == len(border) == len(np.unique(border[:, 1]))
        follow = dict(border.tolist())
        loops, left = 0, set(follow)
        while left:
            loops += 1
            start = node = left.pop()
            while follow[node] != start:
                node = follow[node]
                left.discard(node)
        assert loops == rings


def test_stray_facets_join_their_neighbours():
    """A dent in the epicardium deep enough to be nearest to the endocardium does not become endocardium."""
    wall = ellipsoid_wall((28.0, 28.0, 48.0), (31.0, 31.0, 51.0), rings=14, layers=2)
    points = wall.points.copy()
    outer = np.unique(wall.triangles[wall.facet_tag == EPI])
    dent = outer[np.argmin(np.linalg.norm(points[outer] - [31.0, 0.0, -5.0], axis=1))]
    points[dent, 0] -= 2.5
    np.testing.assert_array_equal(tag_facets(points, wall.triangles, wall, 0.5), wall.facet_tag)


def test_tag_that_is_missing_on_the_mesh_is_an_error():
    wall = ellipsoid_wall(rings=8, layers=3)
    closed = Wall(wall.points, wall.triangles, wall.facet_tag, wall.template, wall.planes)
    shifted = wall.points - np.array([0.0, 0.0, 5.0])
    with pytest.raises(StageError, match="'base' are in 0 pieces on the mesh but in 1 on the wall"):
        tag_facets(shifted, wall.triangles, closed, 0.1)
