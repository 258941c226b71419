from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from surface_shapes import ball_object, box, moved, rotation, sphere

from femprep.image import Grid, make_object
from femprep.mesh.plane_sections import chains, plane_sections
from femprep.model import Plane
from femprep.surface.measure.sections import end_planes, grid_planes, label_contours, slice_planes


def length(contour):
    return float(np.linalg.norm(np.diff(contour, axis=0), axis=1).sum())


def area(contour, normal):
    return float(0.5 * np.cross(contour[:-1], contour[1:]).sum(axis=0) @ normal)


@pytest.mark.parametrize("height", [0.0, 3.7, 12.0, -19.0])
def test_section_of_a_sphere_is_one_closed_circle(height):
    plane = Plane([0, 0, height], [0, 0, 1])
    (contours,) = plane_sections(sphere(20.0, subdivisions=5).points, sphere(20.0, subdivisions=5).cells, [plane])
    assert len(contours) == 1
    circle = contours[0]
    np.testing.assert_array_equal(circle[0], circle[-1])
    np.testing.assert_allclose(circle[:, 2], height, atol=1e-12)
    radius = np.sqrt(400.0 - height**2)
    np.testing.assert_allclose(np.linalg.norm(circle[:, :2], axis=1), radius, rtol=6e-3)
    assert length(circle) == pytest.approx(2 * np.pi * radius, rel=5e-3)
    assert abs(area(circle, [0, 0, 1])) == pytest.approx(np.pi * radius**2, rel=1e-2)


def test_section_through_vertices_and_edges_is_closed_too():
    # The plane z = 0 holds whole rings of the sphere's vertices; z = 1 is the top of the box.
    shape = box()
    for plane in (Plane([0, 0, 1.0], [0, 0, 1]), Plane([0, 0, -1.0], [0, 0, -1]), Plane([0, 0, 0], [1, 1, 0])):
        (contours,) = plane_sections(shape.points, shape.cells, [plane])
        assert all(np.array_equal(c[0], c[-1]) for c in contours)
    (contours,) = plane_sections(shape.points, shape.cells, [Plane([0, 0, 0], [1, 1, 0])])
    assert sum(length(c) for c in contours) == pytest.approx(4.0 + 4.0 * np.sqrt(2.0))


def test_section_of_two_pieces_and_of_none():
    one, two = sphere(5.0), sphere(5.0, (20, 0, 0))
    points = np.r_[one.points, two.points]
    cells = np.r_[one.cells, two.cells + len(one.points)]
    both, none = plane_sections(points, cells, [Plane([0, 0, 0.1], [0, 0, 1]), Plane([0, 0, 9], [0, 0, 1])])
    assert len(both) == 2
    assert none == []


def test_section_of_an_open_surface_is_open():
    shape = sphere(20.0)
    cells = shape.cells[shape.points[shape.cells][:, :, 0].mean(axis=1) < 10.0]
    (contours,) = plane_sections(shape.points, cells, [Plane([0, 0, 0.3], [0, 0, 1])])
    assert len(contours) == 1
    assert not np.array_equal(contours[0][0], contours[0][-1])


def test_section_moves_with_the_surface():
    shape = sphere(20.0, subdivisions=3)
    plane = Plane([1, 2, 3], [1, -2, 0.5])
    there = moved(shape, 7)
    turn = rotation(7)
    shift = there.points[0] - turn @ shape.points[0]
    (here,) = plane_sections(shape.points, shape.cells, [plane])
    (after,) = plane_sections(there.points, there.cells, [Plane(turn @ plane.point + shift, turn @ plane.normal)])
    np.testing.assert_allclose(here[0] @ turn.T + shift, after[0], atol=1e-9)


def test_chains_cover_every_segment_once():
    # A loop, an open chain, and a figure of eight through node 7.
    segments = np.array([[0, 1], [1, 2], [2, 0], [4, 5], [3, 4], [6, 7], [7, 8], [8, 6], [9, 7], [7, 9]])
    found = chains(segments, 10)
    covered = sorted((int(a), int(b)) for c in found for a, b in pairwise(c))
    assert covered == sorted(map(tuple, segments.tolist()))
    assert [3, 4, 5] in [c.tolist() for c in found]


def test_label_contours_of_one_pixel_and_of_a_block():
    mask = np.zeros((9, 9, 6), dtype=bool)
    mask[3, 4, 2] = True
    mask[2:6, 3:5, 3] = True
    grid = Grid(mask.shape, (2.0, 1.0, 8.0), np.array([5.0, 6.0, 7.0]), np.eye(3))
    planes, contours = label_contours(make_object(mask, grid, "block", minimum_voxels=1))
    assert [p.point[2] for p in planes] == [23.0, 31.0]
    assert [len(c) for c in contours] == [1, 1]
    diamond, block = contours[0][0], contours[1][0]
    # Around one pixel: a diamond with half a pixel to each side, counter-clockwise about growing slice numbers.
    assert sorted(map(tuple, diamond[:-1].tolist())) == [
        (10.0, 10.0, 23.0),
        (11.0, 9.5, 23.0),
        (11.0, 10.5, 23.0),
        (12.0, 10.0, 23.0),
    ]
    assert area(diamond, [0, 0, 1]) == pytest.approx(1.0)
    # 4 x 2 pixels of 2 mm2, without the four corners of an eighth of a pixel each.
    assert area(block, [0, 0, 1]) == pytest.approx(16.0 - 4 * 2.0 / 8)


def test_pixels_that_touch_at_a_corner_are_kept_apart_and_a_hole_has_its_own_contour():
    mask = np.zeros((12, 12, 5), dtype=bool)
    mask[2:9, 2:9, 2:4] = True
    mask[4, 4, 2] = mask[5, 5, 2] = False
    grid = Grid(mask.shape, (1.0, 1.0, 8.0), np.zeros(3), np.eye(3))
    _, contours = label_contours(make_object(mask, grid, "holes", policy="repair"))
    signed = sorted(round(area(c, [0, 0, 1]), 6) for c in contours[0])
    # Inside pixels are kept apart, so that the two diamonds of a half are joined by another half between them.
    assert signed == [-1.5, 48.5]


def test_planes_of_an_oblique_stack():
    obj, centre = ball_object(seed=3, mirrored=True)
    planes = slice_planes(obj)
    first, last = end_planes(obj)
    distances = [p.signed_distance(centre[None])[0] for p in planes]
    np.testing.assert_allclose(np.diff(distances), -8.0)
    assert first.signed_distance(centre[None])[0] < 0
    assert last.signed_distance(centre[None])[0] < 0
    np.testing.assert_allclose(last.normal, obj.grid.direction[:, 2], atol=1e-12)
    assert len(grid_planes(obj.grid)) == obj.grid.shape[2]
    # The contours lie in these planes and are circles about the stack's axis.
    for plane, contours in zip(*label_contours(obj)):
        for contour in contours:
            np.testing.assert_allclose(plane.signed_distance(contour), 0.0, atol=1e-9)
            inside = np.linalg.norm(contour - centre, axis=1)
            assert np.all(np.abs(inside - 20.0) < 1.4)
