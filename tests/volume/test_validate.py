import re
from dataclasses import replace

import numpy as np
import pytest
from analytic_walls import ellipsoid_wall
from hypothesis import given
from hypothesis import strategies as st

from femprep.errors import InputError, OptionError, ResourceError
from femprep.model import FACET_TAGS, Plane, Wall
from femprep.options import VolumeOptions
from femprep.volume import tetrahedralize
from femprep.volume.validate import (
    TETS_PER_CUBE,
    check_amount,
    check_edge_length,
    check_fillable,
    check_roughly,
    check_thickness,
    mean_thickness,
)


@pytest.fixture(scope="module")
def wall() -> Wall:
    return ellipsoid_wall(rings=6, layers=2)


def sphere(radius: float, tag: str, inward: bool, count: int = 6) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A closed sphere: two bowls joined at the equator."""
    from analytic_walls import bowl, disc_rings

    low = bowl((radius,) * 3, 0.0, count)
    cells = disc_rings(count)
    inner = len(low) - 6 * count
    points = np.concatenate([low, low[:inner] * [1, 1, -1]])
    upper = np.where(cells < inner, cells + len(low), cells)[:, ::-1]
    triangles = np.concatenate([cells, upper])
    # disc_rings winds the lower bowl towards the inside.
    triangles = triangles if inward else triangles[:, ::-1]
    return points, triangles, np.full(len(triangles), FACET_TAGS[tag])


def shells(inner_inward: bool = True, outer_inward: bool = False) -> Wall:
    """A hollow sphere as two shells."""
    a, b = sphere(20.0, "epi", outer_inward), sphere(12.0, "endo", inner_inward)
    points = np.concatenate([a[0], b[0]])
    triangles = np.concatenate([a[1], b[1] + len(a[0])])
    return Wall(points, triangles, np.concatenate([a[2], b[2]]), np.full(len(points), -1))


def test_sound_walls_pass(wall):
    check_fillable(wall)
    check_fillable(shells())
    assert shells().volume > 0


def refusal(wall: Wall) -> str:
    """The one line a wall is refused with."""
    with pytest.raises(InputError) as error:
        tetrahedralize(wall)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_empty_wall():
    assert "no triangles" in refusal(Wall(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0)))


def test_point_that_is_not_finite(wall):
    points = wall.points.copy()
    points[7, 1] = np.nan
    assert re.search(
        r"point 7 of the wall is \[.*nan.*\]; every coordinate must be finite", refusal(replace(wall, points=points))
    )


def test_open_wall(wall):
    assert re.search(
        r"is open at 3 edges, .* close it",
        refusal(replace(wall, triangles=wall.triangles[1:], facet_tag=wall.facet_tag[1:])),
    )


def test_flipped_triangle(wall):
    triangles = wall.triangles.copy()
    triangles[30] = triangles[30, ::-1]
    assert "not consistently wound at 3 edges" in refusal(replace(wall, triangles=triangles))


def test_doubled_triangle_branches(wall):
    triangles = np.concatenate([wall.triangles, wall.triangles[:1]])
    assert "branches at 3 edges" in refusal(
        replace(wall, triangles=triangles, facet_tag=np.append(wall.facet_tag, 101))
    )


def test_triangle_without_area(wall):
    points = wall.points.copy()
    points[wall.triangles[40, 0]] = points[wall.triangles[40, 1]]
    assert re.search(
        r"2 triangles of the wall without area, the first is \d+ \(near x y z", refusal(replace(wall, points=points))
    )


def test_whole_wall_inside_out(wall):
    assert "is wound inside out: its volume is -" in refusal(replace(wall, triangles=wall.triangles[:, ::-1]))


def test_inverted_inner_shell_would_fill_the_cavity():
    line = refusal(shells(inner_inward=False))
    assert re.search(r"lies inside another one and bounds a cavity, but its volume is \d.*would be filled", line)


def test_inverted_outer_shell():
    assert "wound inside out" in refusal(shells(inner_inward=True, outer_inward=True))


def test_wall_that_crosses_itself(wall):
    points = wall.points.copy()
    points[0, 2] -= 20.0  # the endocardial apex through the epicardium
    assert re.search(
        r"crosses itself at \d+ pairs of triangles, the first \d+ and \d+", refusal(replace(wall, points=points))
    )


def test_sheets_that_touch_in_a_point():
    a = ellipsoid_wall(rings=4, layers=2)
    highest = int(np.argmax(a.points[:, 0]))
    shift = np.array([2 * a.points[highest, 0], 0, 0])
    mirrored = a.points * [-1, 1, 1] + shift
    twin = np.argmin(np.linalg.norm(mirrored - a.points[highest], axis=1))
    other = a.triangles[:, ::-1] + len(a.points)
    other[other == twin + len(a.points)] = highest
    both = Wall(
        np.concatenate([a.points, mirrored]),
        np.concatenate([a.triangles, other]),
        np.tile(a.facet_tag, 2),
        np.tile(a.template, 2),
    )
    assert "touches itself at 1 point" in refusal(both)


def test_wall_without_tags(wall):
    tags = wall.facet_tag.copy()
    tags[3] = 0
    assert "1 triangle of the wall without a tag, the first is 3" in refusal(replace(wall, facet_tag=tags))


def test_facets_off_their_plane(wall):
    plane = Plane(np.array([0, 0, 10.5]), np.array([0, 0, 1.0]))
    assert "tagged 'base' lies 0.5 mm off their plane" in refusal(replace(wall, planes={"base": plane}))


def test_plane_without_facets(wall):
    plane = Plane(np.array([0, 0, -30.0]), np.array([0, 0, -1.0]))
    line = refusal(replace(wall, planes={**wall.planes, "apex": plane}))
    assert "plane 'apex' but no facets tagged 'apex'" in line


def test_mean_thickness_of_a_thin_shell_is_its_thickness():
    wall = ellipsoid_wall((30.0,) * 3, (33.0,) * 3, height=0.0, rings=16, layers=2)
    assert mean_thickness(wall) == pytest.approx(3.0, rel=0.01)


def test_edge_length_larger_than_the_wall(wall):
    with pytest.raises(OptionError, match=r"'edge_length' is 25 mm, but the wall is only [89]\.\d+ mm thick"):
        tetrahedralize(wall, edge_length=25.0)


@given(st.floats(0.05, 34.0))
def test_edge_length_that_is_advised_is_accepted(thickness):
    options = VolumeOptions(edge_length=41.0)
    with pytest.raises(OptionError) as error:
        check_thickness(thickness, options)
    advised = float(str(error.value).split("at most ")[1].split(",")[0])
    assert 0.9 * 1.2 * thickness <= advised <= 1.2 * thickness * (1.0 + 1e-9)
    check_thickness(thickness, VolumeOptions(edge_length=advised))


def test_before_there_is_a_wall_edges_are_held_to_its_tissue():
    """A tissue .6 mm thick surely bears no edges of twice that, and is no heart's that is to be 1 mm thick."""
    assert check_roughly(600.0, 2000.0, 0.2, VolumeOptions(edge_length=0.85)) == pytest.approx(0.6)
    with pytest.raises(OptionError, match=r"choose at most 0\.6,"):
        check_roughly(600.0, 2000.0, 0.2, VolumeOptions(edge_length=1.2))
    for mesher in ("tetwild", "sweep"):
        with pytest.raises(OptionError, match=r"--minimum-thickness 0\.2"):
            check_roughly(600.0, 2000.0, 1.0, VolumeOptions(edge_length=0.9, mesher=mesher))


@pytest.mark.parametrize("value", [-1.0, 0.0, float("nan")])
def test_edge_length_that_is_none(wall, value):
    with pytest.raises(OptionError, match="'edge_length'"):
        tetrahedralize(wall, edge_length=value)


def test_absurdly_small_edge_length_names_one_that_fits(wall):
    message = r"makes about .* elements .* GB, more than the 8 GB .* at least 0\.\d+ mm"
    with pytest.raises(ResourceError, match=message) as error:
        tetrahedralize(wall, edge_length=0.01)
    named = float(str(error.value).split("at least ")[1].split(" mm")[0])
    check_edge_length(wall, VolumeOptions(edge_length=named))
    with pytest.raises(ResourceError):
        check_edge_length(wall, VolumeOptions(edge_length=0.97 * named))


@pytest.mark.slow
def test_estimate_is_near_what_the_mesher_makes(coarse_wall, fresh_mesh):
    need = check_amount(coarse_wall.volume, VolumeOptions(edge_length=6.0))
    assert need.elements == int(TETS_PER_CUBE * coarse_wall.volume / 216.0)
    assert 0.4 * need.elements < fresh_mesh.n_cells < 2.0 * need.elements
    assert fresh_mesh.info["attempts"][0]["peak_bytes"] < 2.0 * need.gigabytes * 1e9
