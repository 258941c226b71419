"""Rims that come near each other are refined, so that the cap between them has no slivers; others stay as they are."""

from __future__ import annotations

import numpy as np
import pytest
from wall_shapes import Ellipsoid, plane_z, template_surface

from femprep.mesh.measures.triangles import triangle_quality
from femprep.model import FACET_TAGS
from femprep.wall import build_wall
from femprep.wall.clipping.clip import clip, rim_loops
from femprep.wall.clipping.rim import refine_rims


def surface(radius: float, x: float, name: str, vertices: int = 400):
    return template_surface(Ellipsoid((radius, radius, 40.0), np.array([x, 0.0, 0.0])), vertices, name)


@pytest.fixture
def heart():
    """Two cavities in one epicardium; its wall is 1.5 mm thin beside the second one."""
    epi = template_surface(Ellipsoid((45.0, 45.0, 60.0), np.array([10.0, 0.0, 0.0])), 400, "epi")
    return epi, {"lv": surface(17.0, -14.0, "lv"), "rv": surface(17.0, 36.0, "rv")}


def test_caps_of_thin_walls_have_no_slivers(heart):
    epi, endo = heart
    wall = build_wall(epi=epi, endo=endo, base=plane_z(5.0))
    base = wall.triangles[wall.facet_tag == FACET_TAGS["base"]]
    assert triangle_quality(wall.points, base).min() >= 0.2
    assert np.abs(wall.planes["base"].signed_distance(wall.points[base].reshape(-1, 3))).max() <= 1e-9


def test_new_vertices_lie_in_the_plane_beside_the_near_rim_alone(heart):
    epi, endo = heart
    planes = {"base": plane_z(5.0)}
    clipped_surfaces = [clip(epi, planes), clip(endo["rv"], planes)]
    before = [len(clipped.points) for clipped in clipped_surfaces]
    refine_rims(clipped_surfaces)
    epicardium, count = clipped_surfaces[0], before[0]
    added = epicardium.points[count:]
    assert len(added)
    np.testing.assert_allclose(added[:, 2], 5.0, atol=1e-12)
    assert added[:, 0].min() > 25.0
    assert (epicardium.template[count:] == -1).all()
    (loop,) = rim_loops(epicardium, 0)
    assert np.isin(np.arange(count, len(epicardium.points)), loop).all()
    # The other rim's edges are short enough beside the gap of 2 mm.
    assert len(clipped_surfaces[1].points) == before[1]
