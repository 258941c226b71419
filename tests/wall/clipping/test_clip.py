from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from wall_shapes import Ellipsoid, cap_volume, plane_z, template_surface, turned

from femprep.errors import InputError
from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.topology import border_edges, enclosed_volume, is_consistently_wound, pieces
from femprep.model import Plane, Surface
from femprep.wall.clipping.clip import clip, rim_loops
from femprep.wall.clipping.improve import improve

AXES = (25.0, 25.0, 45.0)
SHAPE = Ellipsoid(AXES)


def test_what_lies_beyond_the_plane_is_gone():
    clipped = clip(template_surface(SHAPE), {"base": plane_z(12.0)})
    assert clipped.points[:, 2].max() == 12.0
    assert (clipped.points[clipped.on_plane == 0, 2] == 12.0).all()
    assert (clipped.points[clipped.on_plane < 0, 2] < 12.0).all()


@pytest.mark.slow
@settings(deadline=None, max_examples=25)
@given(st.floats(-25.0, 25.0), st.floats(-0.4, 0.4), st.floats(-0.4, 0.4))
def test_the_rim_is_one_loop_on_plane_and_surface_without_slivers(height, tilt_x, tilt_y):
    plane = Plane(np.array([0.0, 0.0, height]), np.array([tilt_x, tilt_y, 1.0]))
    clipped = clip(template_surface(SHAPE), {"base": plane})
    before = triangle_quality(clipped.points, clipped.triangles).min()
    improve(clipped)
    after = triangle_quality(clipped.points, clipped.triangles).min()
    assert before > 0.15
    assert after >= min(before, 0.4)
    assert after > 0.35
    (loop,) = rim_loops(clipped, 0)
    rim = clipped.points[loop]
    assert len(border_edges(clipped.triangles)) == len(loop)
    assert np.abs(plane.signed_distance(rim)).max() < 1e-12
    assert np.abs(SHAPE.off(clipped.points)).max() < 2e-4
    assert is_consistently_wound(clipped.triangles)
    assert pieces(clipped.triangles).max() == 0


def test_vertices_away_from_the_rim_stay_as_they_were():
    # Nearly a sphere: no triangle is so poor that it would be improved wherever it lies.
    surface = template_surface(Ellipsoid((30.0, 30.0, 38.0)), 1500)
    clipped = clip(surface, {"base": plane_z(12.0)})
    improve(clipped)
    far = clipped.points[:, 2] < -15.0
    assert far.sum() > 300
    assert (clipped.template[far] >= 0).all()
    assert (clipped.points[far] == surface.points[clipped.template[far]]).all()


def test_template_numbers_name_vertices_once():
    clipped = clip(template_surface(SHAPE), {"base": plane_z(7.3)})
    kept = clipped.template[clipped.template >= 0]
    assert len(np.unique(kept)) == len(kept)
    assert (clipped.on_plane[clipped.template < 0] == 0).all()


def test_the_clipped_volume_converges_to_the_closed_form():
    exact = cap_volume(AXES, 12.0)
    errors = []
    for vertices in (200, 800, 3200):
        clipped = clip(template_surface(SHAPE, vertices), {"base": plane_z(12.0)})
        improve(clipped)
        errors.append(exact - enclosed_volume(clipped.points, clipped.triangles))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert rates == pytest.approx(2.0, abs=0.3)
    assert abs(errors[1]) < 0.01 * exact


def test_two_planes_leave_a_tube():
    planes = {"base": plane_z(12.0), "apex": plane_z(-30.0, up=False)}
    clipped = clip(template_surface(SHAPE), planes)
    improve(clipped)
    assert [len(rim_loops(clipped, k)) for k in (0, 1)] == [1, 1]
    assert clipped.points[:, 2].min() == -30.0
    assert clipped.points[:, 2].max() == 12.0


def test_a_turned_surface_is_clipped_alike():
    turn, centre = turned(3), np.array([100.0, -40.0, 7.0])
    plane = Plane(turn @ [0.0, 0.0, 12.0] + centre, turn @ [0.0, 0.0, 1.0])
    straight = clip(template_surface(SHAPE), {"base": plane_z(12.0)})
    there = clip(template_surface(Ellipsoid(AXES, centre, turn)), {"base": plane})
    assert (there.template == straight.template).all()
    assert np.abs((there.points - centre) @ turn - straight.points).max() < 1e-6


def test_a_plane_through_vertices_is_no_trouble():
    surface = template_surface(SHAPE)
    height = float(np.sort(surface.points[:, 2])[400])
    clipped = clip(surface, {"base": plane_z(height)})
    improve(clipped)
    assert triangle_quality(clipped.points, clipped.triangles).min() > 0.35


@pytest.mark.parametrize(("height", "message"), [(60.0, "cuts nothing away"), (-60.0, "cuts all of it away")])
def test_a_plane_that_misses_is_refused(height, message):
    with pytest.raises(InputError, match=f"base plane misses surface 'lv' and {message}"):
        clip(template_surface(SHAPE), {"base": plane_z(height)})


def test_a_plane_that_cuts_in_two_loops_is_refused():
    def dumbbell(d):
        d = np.asarray(d)
        return d * (20.0 + 25.0 * d[:, :1] ** 2)

    surface = template_surface(dumbbell, 1500)
    with pytest.raises(InputError, match="in 2 loops, centred at"):
        clip(surface, {"base": plane_z(20.6)})


def test_a_surface_without_template_is_refused():
    surface = template_surface(SHAPE)
    with pytest.raises(InputError, match="no template directions"):
        clip(Surface(surface.points, surface.cells), {"base": plane_z(0.0)})
