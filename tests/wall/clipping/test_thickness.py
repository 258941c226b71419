from __future__ import annotations

import numpy as np
import pytest
from wall_shapes import Ellipsoid, ellipsoids, plane_z, template_surface

from femprep.errors import InputError
from femprep.mesh.measures.triangles import triangle_quality
from femprep.wall.clipping.clip import clip
from femprep.wall.clipping.improve import improve
from femprep.wall.clipping.thickness import measure, push_apart, require_nested, summary


def clipped_surfaces(inner, outer, vertices=600, height=10.0):
    epi, endo = ellipsoids(inner, outer, vertices)
    return clip(epi, {"base": plane_z(height)}), clip(endo, {"base": plane_z(height)})


def test_the_shell_of_a_sphere_is_as_thick_as_its_radii_differ():
    epi, endo = clipped_surfaces((20.0,) * 3, (29.0,) * 3, vertices=1200)
    # Above the equator the base cuts the way between a point and its foot.
    low = endo.points[:, 2] < 0
    thickness = measure(epi, endo)
    assert thickness.endo[low] == pytest.approx(9.0, abs=0.05)
    assert thickness.epi[epi.points[:, 2] < 0] == pytest.approx(9.0, abs=0.05)


def test_thickness_is_negative_where_the_surfaces_changed_sides():
    epi, endo = clipped_surfaces((25.0, 25.0, 45.0), (33.0, 33.0, 43.0))
    thickness = measure(epi, endo)
    apex = int(endo.points[:, 2].argmin())
    assert thickness.endo[apex] == pytest.approx(-2.0, abs=0.2)
    assert thickness.least == pytest.approx(-2.0, abs=0.3)


def test_the_summary_says_where_the_wall_is_thinnest():
    epi, endo = clipped_surfaces((25.0, 25.0, 45.0), (33.0, 33.0, 47.0))
    found = summary(epi, [endo])
    assert found["minimum_mm"] == pytest.approx(2.0, abs=0.1)
    assert found["minimum_at_mm"][2] < -43.0
    assert found["minimum_beside"] == "lv"


@pytest.mark.parametrize("depth", [45.2, 43.0, 41.0])
def test_a_thin_wall_is_pushed_to_the_limit_and_no_further_than_needed(depth):
    epi, endo = clipped_surfaces((25.0, 25.0, 45.0), (33.0, 33.0, depth), vertices=1500)
    start = epi.points.copy()
    info = push_apart(epi, endo, limit=2.0, most=10.0)
    assert measure(epi, endo).least >= 2.0
    moved = np.linalg.norm(epi.points - start, axis=1)
    assert info["farthest_push_mm"] == pytest.approx(moved.max())
    assert moved.max() < 1.3 * (47.0 - depth)
    # Only near where the wall was thin: nothing moves in the upper half.
    assert start[moved > 0.01, 2].max() < -20.0
    assert info["thickness_before_mm"] == pytest.approx(depth - 45.0, abs=0.2)
    improve(epi)
    assert triangle_quality(epi.points, epi.triangles).min() > 0.3


def test_a_thick_wall_is_left_alone():
    epi, endo = clipped_surfaces((25.0, 25.0, 45.0), (33.0, 33.0, 53.0))
    before = epi.points.copy()
    assert push_apart(epi, endo, limit=2.0, most=5.0) is None
    assert (epi.points == before).all()


def test_rim_vertices_are_pushed_within_their_plane():
    epi = clip(template_surface(Ellipsoid((25.5, 33.0, 53.0)), 600, "epi"), {"base": plane_z(0.0)})
    endo = clip(template_surface(Ellipsoid((25.0, 25.0, 45.0)), 600, "lv"), {"base": plane_z(0.0)})
    assert push_apart(epi, endo, limit=2.0, most=5.0)["vertices_pushed"] > 0
    rim = epi.on_plane == 0
    assert np.abs(epi.points[rim, 2]).max() < 1e-12
    assert np.hypot(*epi.points[rim, :2].T).min() > 26.9


def test_what_would_need_too_long_a_push_is_refused_with_the_place():
    epi, endo = clipped_surfaces((25.0, 25.0, 45.0), (33.0, 33.0, 41.0))
    with pytest.raises(
        InputError, match=r"is -[34]\.\d\d mm thick near \(.*-4\d\.\d\), beside 'lv'.*maximum_push = 2 mm"
    ):
        push_apart(epi, endo, limit=1.0, most=2.0)


def test_swapped_surfaces_are_refused():
    epi, endo = clipped_surfaces((33.0, 33.0, 53.0), (25.0, 25.0, 45.0))
    with pytest.raises(InputError, match=r"'lv' does not lie inside surface 'epi': 100 % of its vertices are outside"):
        require_nested(epi, endo)
