"""Openings between chambers and to the outside: found in labels of known shape, cut through closed walls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from wall_shapes import Ellipsoid, template_surface

import femprep as fp
from femprep.errors import InputError
from femprep.mesh.topology import euler_characteristic, is_closed, pieces
from femprep.model import FACET_TAGS, Plane, Wall
from femprep.wall import build_wall
from femprep.wall.chambers.holes import open_wall
from femprep.wall.chambers.openings import Opening, find_openings, given_openings

LV, LA = np.array([0.0, 0.0, 0.0]), np.array([0.0, 0.0, 42.0])


@pytest.fixture(scope="module")
def heart() -> Wall:
    """Four round cavities with 2 mm between ventricle and atrium, in a round body."""
    at = {"lv": LV, "rv": np.array([45.0, 0.0, 0.0]), "la": LA, "ra": np.array([45.0, 0.0, 42.0])}
    endo = {name: template_surface(Ellipsoid((20.0,) * 3, centre), 500, name) for name, centre in at.items()}
    epi = template_surface(Ellipsoid((62.0, 36.0, 62.0), np.array([22.5, 0.0, 21.0])), 1500, "epi")
    return build_wall(epi=epi, endo=endo, base=None)


def up(name: str, cavity: str, beyond: str | None, centre, normal, radius: float) -> Opening:
    return Opening(name, cavity, beyond, Plane(np.asarray(centre), np.asarray(normal), "labels"), radius)


def euler(wall: Wall) -> int:
    assert is_closed(wall.triangles)
    return euler_characteristic(wall.triangles)


def test_a_valve_joins_two_cavities(heart):
    opening = up("mitral", "lv", "la", (0.0, 0.0, 21.0), (0.0, 0.0, 1.0), 8.0)
    opened = open_wall(heart, [opening])
    assert (pieces(heart.triangles).max() + 1, euler(heart)) == (5, 10)
    assert (pieces(opened.triangles).max() + 1, euler(opened)) == (4, 8)
    (record,) = opened.info["openings"]
    assert record["radius_mm"] == pytest.approx(0.85 * 8.0)
    radius = record["radius_mm"]
    # Between two spheres whose poles are 2 mm apart: the gap grows by rho^2 / R with the distance from the axis.
    exact = np.pi * radius**2 * 2.0 + 2.0 * np.pi * radius**4 / (4.0 * 20.0) * 2.0 / 2.0
    assert heart.volume - opened.volume == pytest.approx(exact, rel=0.12)
    ring = opened.points[opened.triangles[opened.facet_tag == FACET_TAGS["mitral"]]].reshape(-1, 3)
    assert np.linalg.norm(ring[:, :2], axis=1).max() <= radius + 1e-9
    assert np.linalg.norm(ring[:, :2], axis=1).min() >= radius * np.cos(np.pi / 12) - 1e-9
    kept = opened.template >= 0
    assert kept.sum() > 0.95 * (heart.template >= 0).sum()


def test_an_artery_opens_a_cavity_to_the_outside(heart):
    opened = open_wall(heart, [up("aortic", "lv", None, (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 6.0)])
    assert "left_closed" in opened.info["openings"][0]  # the wall there is more than 15 mm from the plane
    opened = open_wall(heart, [up("aortic", "lv", None, (0.0, 22.0, 0.0), (0.0, 1.0, 0.0), 6.0)])
    assert (pieces(opened.triangles).max() + 1, euler(opened)) == (4, 8)
    assert (opened.facet_tag == FACET_TAGS["aortic"]).any()


def test_a_hole_that_would_meet_another_cavity_is_made_smaller_or_left_out(heart):
    between = up("mitral", "lv", "la", (0.0, 0.0, 21.0), (0.0, 0.0, 1.0), 60.0)
    assert "left_closed" in open_wall(heart, [between]).info["openings"][0]
    given = replace(between, plane=replace(between.plane, source="given"))
    with pytest.raises(InputError, match=r"the mitral opening near \(0.0, 0.0, 21.0\) is not cut"):
        open_wall(heart, [given])


@pytest.mark.slow
def test_an_opened_wall_is_meshed_with_its_tags(heart):
    openings = [
        up("mitral", "lv", "la", (0.0, 0.0, 21.0), (0.0, 0.0, 1.0), 10.0),
        up("tricuspid", "rv", "ra", (45.0, 0.0, 21.0), (0.0, 0.0, 1.0), 10.0),
        up("pulmonary", "rv", None, (45.0, 22.0, 0.0), (0.0, 1.0, 0.0), 7.0),
    ]
    mesh = fp.tetrahedralize(open_wall(heart, openings), edge_length=5.0, quality="fast", mean_ratio=0.75)
    endo = {"endo_lv", "endo_rv", "endo_la", "endo_ra"}
    assert set(mesh.facet_names) == endo | {"epi", "mitral", "tricuspid", "pulmonary"}
    validity = fp.check(mesh).validity
    assert validity.inverted_elements == validity.untagged_boundary_facets == 0
    assert validity.boundary_shells == 2  # the right heart is open to the outside, the left one within
    assert fp.cavity_surface(mesh, "lv").volume == pytest.approx(4 / 3 * np.pi * 20.0**3, rel=0.05)


def voxels(spacing: tuple[float, float, float]) -> fp.Segmentation:
    """A ventricle and an atrium, balls of 20 mm, that meet in a disc of 12 mm radius at z = 0, in a shell of tissue."""
    x = [np.arange(-45.0, 45.0, s) for s in (spacing[0], spacing[1])]
    z = spacing[2] * (np.arange(-int(45.0 / spacing[2]), int(45.0 / spacing[2])) + 0.5)
    at = np.stack(np.meshgrid(*x, z, indexing="ij"), axis=-1)
    labels = np.zeros(at.shape[:3], dtype=np.uint8)
    away = np.linalg.norm(at - [0.0, 0.0, -16.0], axis=-1), np.linalg.norm(at - [0.0, 0.0, 16.0], axis=-1)
    labels[away[1] < 24.0] = 6
    labels[away[0] < 24.0] = 2
    labels[(away[1] < 20.0) & (at[..., 2] > 0)] = 5
    labels[(away[0] < 20.0) & (at[..., 2] < 0)] = 1
    grid = fp.image.Grid(labels.shape, np.array(spacing), np.array([-45.0, -45.0, z[0]]), np.eye(3))
    structures = {"lv": (1,), "myo": (2,), "rv": (3,), "la": (5,), "la_wall": (6,), "ra": (7,)}
    return fp.Segmentation(labels, grid, structures)


@pytest.mark.parametrize("spacing", [(1.0, 1.0, 1.0), (1.4, 1.4, 8.0)], ids=["1 mm", "stack"])
def test_labels_that_touch_show_a_valve(spacing):
    (found,) = find_openings(voxels(spacing))
    assert (found.name, found.cavity, found.beyond) == ("mitral", "lv", "la")
    # The voxels next to the plane lie half a slice from it, where the balls are wider.
    assert found.radius == pytest.approx(np.sqrt(20.0**2 - (16.0 - 0.5 * spacing[2]) ** 2), rel=0.03)
    np.testing.assert_allclose(found.plane.normal, [0.0, 0.0, 1.0], atol=0.05)
    np.testing.assert_allclose(found.plane.point, [0.0, 0.0, 0.0], atol=0.7)


def test_labels_that_touch_the_background_show_an_artery():
    seg = voxels((1.0, 1.0, 1.0))
    labels = np.array(seg.labels)
    labels[labels == 5] = 0  # no atrium: the ventricle ends at the background
    (found,) = find_openings(fp.Segmentation(labels, seg.grid, seg.structures))
    assert (found.name, found.cavity, found.beyond) == ("aortic", "lv", None)


def test_a_labelled_vessel_is_the_outside_of_its_ventricle():
    seg = voxels((1.0, 1.0, 1.0))
    structures = {"lv": (1,), "myo": (2, 6), "aorta": (5,)}
    (found,) = find_openings(fp.Segmentation(seg.labels, seg.grid, structures))
    assert (found.name, found.cavity, found.beyond) == ("aortic", "lv", None)
    assert find_openings(fp.Segmentation(seg.labels, seg.grid, {"lv": (1,), "myo": (2, 6)})) == []


def test_a_valve_without_leaflets_joins_the_chambers_it_parts():
    seg = voxels((1.0, 1.0, 1.0))
    labels = np.array(seg.labels)
    labels[:, :, 44:47] = 0  # what lies between ventricle and atrium is background
    (found,) = find_openings(fp.Segmentation(labels, seg.grid, seg.structures))
    assert (found.name, found.cavity, found.beyond) == ("mitral", "lv", "la")
    # The opening is as wide as the narrower of the two.
    assert 12.0 <= found.radius < 14.5
    np.testing.assert_allclose(found.plane.normal, [0.0, 0.0, 1.0], atol=0.05)
    np.testing.assert_allclose(found.plane.point, [0.0, 0.0, 0.5], atol=0.8)


def test_given_openings_are_checked():
    (found,) = given_openings({"veins_la": (1.0, 2.0, 3.0, 0.0, 0.0, 2.0, 8.5)})
    assert (found.name, found.cavity, found.beyond) == ("veins", "la", None)
    assert 0.85 * found.radius == pytest.approx(8.5)
    with pytest.raises(InputError, match="opening 'veins' is not known; known are mitral"):
        given_openings({"veins": (1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 8.0)})
    with pytest.raises(InputError, match="expected centre x, y, z, normal x, y, z, and radius"):
        given_openings({"mitral": (1.0, 2.0, 3.0)})


def test_openings_are_those_of_a_whole_heart(heart):
    tags = np.where(heart.facet_tag == FACET_TAGS["endo_ra"], FACET_TAGS["epi"], heart.facet_tag)
    with pytest.raises(InputError, match="whole heart; this wall has no endo_ra, but epi, endo_lv, endo_rv, endo_la"):
        open_wall(replace(heart, facet_tag=tags), [])
