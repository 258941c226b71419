from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from analytic_walls import ellipsoid_wall
from hypothesis import given, settings
from hypothesis import strategies as st
from wall_shapes import Ellipsoid, cap_volume, ellipsoids, plane_z, template_surface, turned

from femprep.errors import InputError, OptionError, StageError
from femprep.mesh.measures.triangles import areas, triangle_quality
from femprep.mesh.search.intersection import self_intersections
from femprep.mesh.topology import is_consistently_wound, is_manifold, pieces, volume
from femprep.model import FACET_TAGS, Plane, Surface, Wall
from femprep.options import WallOptions
from femprep.wall import build_wall
from femprep.wall.joining.checks import check_wall

INNER, OUTER = (25.0, 25.0, 45.0), (33.0, 33.0, 53.0)


def assert_clean(wall: Wall, least: float = 0.3) -> None:
    assert is_manifold(wall.triangles)
    assert is_consistently_wound(wall.triangles)
    assert pieces(wall.triangles).max() == 0
    assert len(self_intersections(wall.points, wall.triangles)) == 0
    assert len(np.unique(wall.triangles)) == len(wall.points)
    assert triangle_quality(wall.points, wall.triangles).min() >= least
    for name, plane in wall.planes.items():
        cap = wall.triangles[wall.facet_tag == FACET_TAGS[name]]
        assert len(cap) > 0
        assert np.abs(plane.signed_distance(wall.points[cap].reshape(-1, 3))).max() < 1e-9


def area_of(wall: Wall, name: str) -> float:
    return float(areas(wall.points, wall.triangles[wall.facet_tag == FACET_TAGS[name]]).sum())


def test_a_thick_ellipsoid_converges_to_its_closed_forms():
    height = 12.0
    exact = cap_volume(OUTER, height) - cap_volume(INNER, height)
    ring = np.pi * (33.0**2 * (1 - (height / 53) ** 2) - 25.0**2 * (1 - (height / 45) ** 2))
    errors = []
    for vertices in (300, 1200):  # halves the edge length
        epi, endo = ellipsoids(vertices=vertices)
        wall = build_wall(epi=epi, endo={"lv": endo}, base=plane_z(height))
        assert_clean(wall)
        errors.append(abs(wall.volume - exact) / exact)
        # Both rims are polygons within their ellipses, so that much of the error of their difference cancels.
        assert area_of(wall, "base") == pytest.approx(ring, rel=0.01)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.4)
    assert errors[1] < 0.01


def test_every_facet_is_tagged_and_faces_out_of_the_wall():
    epi, endo = ellipsoids()
    wall = build_wall(epi=epi, endo={"lv": endo}, base=plane_z(12.0))
    assert set(wall.facet_tag.tolist()) == {FACET_TAGS[name] for name in ("endo", "epi", "base")}
    for name, shape in (("endo", endo.shape), ("epi", epi.shape)):
        on = wall.points[np.unique(wall.triangles[wall.facet_tag == FACET_TAGS[name]])]
        assert np.abs(shape.off(on)).max() < 1e-3
    corner = wall.points[wall.triangles]
    outward = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    radial = np.einsum("ij,ij->i", outward, corner.mean(axis=1))
    assert (radial[wall.facet_tag == FACET_TAGS["epi"]] > 0).all()
    assert (radial[wall.facet_tag == FACET_TAGS["endo"]] < 0).all()
    assert (outward[wall.facet_tag == FACET_TAGS["base"], 2] > 0).all()


def test_template_numbers_are_carried():
    epi, endo = ellipsoids(vertices=1500)
    wall = build_wall(epi=epi, endo={"lv": endo}, base=plane_z(12.0))
    for name, surface in (("epi", epi), ("endo", endo)):
        vertices = np.unique(wall.triangles[wall.facet_tag == FACET_TAGS[name]])
        deep = vertices[wall.points[vertices, 2] < -10.0]
        number = wall.template[deep]
        assert (number >= 0).all()
        assert len(np.unique(number)) == len(number)
        assert np.linalg.norm(wall.points[deep] - surface.points[number], axis=1).max() < 4.0


def test_volumes_and_thickness_are_reported():
    epi, endo = ellipsoids()
    epi = replace(epi, name="lv+myo")  # as the object it was fitted to
    wall = build_wall(epi=epi, endo={"lv": endo}, base=plane_z(12.0))
    volumes = wall.info["volumes_mm3"]
    assert volumes["epi"] - volumes["lv"] == pytest.approx(wall.volume, rel=1e-9)
    assert volumes["wall"] == pytest.approx(volume(wall.points, wall.triangles))
    assert wall.info["thickness"]["minimum_mm"] == pytest.approx(7.6, abs=0.3)
    assert wall.info["repaired"] == []
    assert wall.info["apex"]["extrapolated"] is False
    assert wall.info["quality"]["minimum"] == pytest.approx(triangle_quality(wall.points, wall.triangles).min())
    json.dumps(dict(wall.info))


@pytest.mark.slow
@settings(deadline=None, max_examples=12)
@given(
    height=st.floats(-15.0, 20.0),
    tilt=st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)),
    seed=st.integers(0, 50),
    outer=st.tuples(st.floats(29.0, 36.0), st.floats(29.0, 36.0), st.floats(48.0, 56.0)),
)
def test_any_plane_and_place_gives_a_clean_wall(height, tilt, seed, outer):
    turn, centre = turned(seed), np.array([120.0, -80.0, 33.0])
    epi, endo = ellipsoids(INNER, outer, rotation=turn, centre=centre)
    base = Plane(turn @ [0.0, 0.0, height] + centre, turn @ [*tilt, 1.0])
    assert_clean(build_wall(epi=epi, endo={"lv": endo}, base=base))


def test_the_apex_can_be_clipped_by_a_plane_that_is_not_parallel():
    epi, endo = ellipsoids()
    apex = Plane(np.array([0.0, 0.0, -36.0]), np.array([0.1, -0.05, -1.0]))
    wall = build_wall(epi=epi, endo={"lv": endo}, base=plane_z(12.0), apex=apex)
    assert_clean(wall)
    assert set(wall.planes) == {"base", "apex"}
    assert wall.info["apex"]["mode"] == "clipped"
    exact = np.pi * (33.0**2 * (1 - (36 / 53) ** 2) - 25.0**2 * (1 - (36 / 45) ** 2))
    assert area_of(wall, "apex") == pytest.approx(exact, rel=0.03)


def test_two_cavities_are_tagged_by_their_names():
    epi = template_surface(Ellipsoid((45.0, 33.0, 53.0)), name="epi")
    lv = template_surface(Ellipsoid((14.0, 20.0, 42.0), np.array([20.0, 0.0, 0.0])), name="lv")
    rv = template_surface(Ellipsoid((12.0, 20.0, 40.0), np.array([-22.0, 0.0, 0.0])), name="rv")
    wall = build_wall(epi=epi, endo={"lv": lv, "rv": rv}, base=plane_z(10.0))
    assert_clean(wall, least=0.2)
    assert set(wall.facet_tag.tolist()) == {FACET_TAGS[n] for n in ("endo_lv", "endo_rv", "epi", "base")}
    volumes = wall.info["volumes_mm3"]
    assert wall.volume == pytest.approx(volumes["epi"] - volumes["lv"] - volumes["rv"], rel=1e-9)


def test_cavities_that_overlap_are_refused_with_the_place():
    epi = template_surface(Ellipsoid((45.0, 33.0, 53.0)), name="epi")
    lv = template_surface(Ellipsoid((20.0, 20.0, 42.0), np.array([15.0, 0.0, 0.0])), name="lv")
    rv = template_surface(Ellipsoid((20.0, 20.0, 40.0), np.array([-15.0, 0.0, 0.0])), name="rv")
    with pytest.raises(InputError, match=r"meets .*crossings, the first near \("):
        build_wall(epi=epi, endo={"lv": lv, "rv": rv}, base=plane_z(10.0))


@pytest.mark.slow
def test_a_thin_apex_is_repaired_or_refused_by_policy():
    epi, endo = ellipsoids(INNER, (33.0, 33.0, 45.2), vertices=1500)
    wall = build_wall(epi=epi, endo={"lv": endo}, base=plane_z(12.0), minimum_thickness=1.5)
    assert_clean(wall)
    assert wall.info["thickness"]["minimum_mm"] >= 1.5
    (step,) = wall.info["repaired"]
    assert step["thickness_before_mm"] == pytest.approx(0.2, abs=0.1)
    with pytest.raises(InputError, match=r"0\.\d\d mm thick at \(.*below minimum_thickness = 1.5 mm.*--policy repair"):
        build_wall(epi=epi, endo={"lv": endo}, base=plane_z(12.0), minimum_thickness=1.5, policy="strict")


@pytest.mark.slow
def test_the_same_input_gives_the_same_bytes():
    epi, endo = ellipsoids(INNER, (33.0, 33.0, 45.2))
    walls = [build_wall(epi=epi, endo={"lv": endo}, base=plane_z(11.0)) for _ in range(2)]
    for name in ("points", "triangles", "facet_tag", "template"):
        assert getattr(walls[0], name).tobytes() == getattr(walls[1], name).tobytes()


def test_progress_is_told():
    told: list[tuple[str, float]] = []
    epi, endo = ellipsoids()
    build_wall(epi=epi, endo={"lv": endo}, base=plane_z(12.0), progress=lambda *a: told.append(a))
    assert told[-1] == ("wall", 1.0)
    assert [f for _, f in told] == sorted(f for _, f in told)


def bad(surface: Surface, **changes) -> Surface:
    return replace(surface, shape=None, **changes)


def test_bad_surfaces_are_refused_with_a_reason():
    epi, endo = ellipsoids()
    base = plane_z(12.0)
    turned_one = endo.cells.copy()
    turned_one[5] = turned_one[5, ::-1]
    cases = [
        (bad(endo, cells=endo.cells[1:]), r"'lv' is not closed: 3 edges .* the first at \("),
        (bad(endo, cells=turned_one), r"'lv' is not wound consistently: 3 edges"),
        (bad(endo, cells=endo.cells[:, ::-1]), r"'lv' is wound inward \(volume -"),
    ]
    for surface, message in cases:
        with pytest.raises(InputError, match=message):
            build_wall(epi=epi, endo={"lv": surface}, base=base)


def test_other_wrong_calls_are_refused():
    epi, endo = ellipsoids()
    with pytest.raises(InputError, match="does not lie inside"):
        build_wall(epi=endo, endo={"lv": epi}, base=plane_z(12.0))
    with pytest.raises(InputError, match="base plane misses surface 'epi'"):
        build_wall(epi=epi, endo={"lv": endo}, base=plane_z(70.0))
    with pytest.raises(InputError, match="base plane misses surface 'lv' and cuts nothing away"):
        build_wall(epi=epi, endo={"lv": endo}, base=plane_z(49.0))
    with pytest.raises(OptionError, match="no apex plane"):
        build_wall(epi=epi, endo={"lv": endo}, base=plane_z(12.0), options=WallOptions(apex="clipped"))
    with pytest.raises(InputError, match="no endocardium"):
        build_wall(epi=epi, endo={}, base=plane_z(12.0))
    with pytest.raises(InputError, match=r"no facet tag for an endocardium named 'x'.*known names"):
        build_wall(epi=epi, endo={"lv": endo, "x": endo}, base=plane_z(12.0))


def test_the_final_check_fires():
    epi, endo = ellipsoids()
    wall = build_wall(epi=epi, endo={"lv": endo}, base=plane_z(12.0))
    base = wall.facet_tag == FACET_TAGS["base"]
    moved = wall.points.copy()
    moved[wall.triangles[base][0, 0], 2] += 1e-6
    needle = wall.points.copy()
    one, two = wall.triangles[np.flatnonzero(~base)[100]][:2]
    needle[one] = needle[two] + 0.02 * (needle[one] - needle[two])
    cases = [
        (
            replace(wall, triangles=wall.triangles[1:], facet_tag=wall.facet_tag[1:]),
            r"not closed: 3 edges.*\((epi|endo)\)",
        ),
        (replace(wall, points=moved), r"1.00e-06 mm off its plane at .*\(base\)"),
        (replace(wall, points=needle), r"Q = 0\.0\d\d, below 0.2"),
        (replace(wall, triangles=wall.triangles[:, ::-1]), r"no volume"),
    ]
    for broken, message in cases:
        with pytest.raises(StageError, match=message):
            check_wall(broken)


def test_caps_may_have_poorer_triangles_than_surfaces() -> None:
    """Their rims lie a millimetre apart where a wall is thin; nothing is smooth there that a needle would spoil."""
    wall = ellipsoid_wall()

    def with_needle(tag: str, height: float) -> Wall:
        """A triangle cut in three at a point so far above one of its sides, of the triangle's own height."""
        row = np.flatnonzero(wall.facet_tag == FACET_TAGS[tag])[0]
        a, b, c = wall.triangles[row]
        middle = 0.5 * (1.0 - height) * (wall.points[a] + wall.points[b]) + height * wall.points[c]
        new = len(wall.points)
        triangles = np.concatenate([np.delete(wall.triangles, row, 0), [[a, b, new], [b, c, new], [c, a, new]]])
        tags = np.append(np.delete(wall.facet_tag, row), [FACET_TAGS[tag]] * 3)
        points, template = np.vstack([wall.points, middle]), np.append(wall.template, -1)
        return replace(wall, points=points, triangles=triangles, facet_tag=tags, template=template)

    check_wall(with_needle("base", 0.3))
    with pytest.raises(StageError, match=r"Q = 0\.0\d\d, below 0.2, .*\(epi\)"):
        check_wall(with_needle("epi", 0.04))
    with pytest.raises(StageError, match=r"Q = 0\.00\d, below 0.02, .*\(base\)"):
        check_wall(with_needle("base", 0.04))


@pytest.mark.parametrize(("below", "told"), [(2.0, True), (20.0, False)])
def test_what_crosses_beside_the_base_says_how_to_move_it(below: float, told: bool) -> None:
    """As a phantom of both ventricles on voxels of 0.6 mm does, whose last slice is thin; there 2 mm are enough."""
    wall = ellipsoid_wall()
    points = np.array(wall.points)
    inner = np.unique(wall.triangles[wall.facet_tag == FACET_TAGS["endo"]])
    depth = 10.0 - points[inner, 2]
    moved = inner[np.argmin(np.abs(depth - below))]
    # Through the wall, out of the epicardium.
    points[moved, :2] *= 2.0
    with pytest.raises(StageError) as caught:
        check_wall(replace(wall, points=points))
    assert ("move the base inwards by --base-offset" in str(caught.value)) == told, str(caught.value)
