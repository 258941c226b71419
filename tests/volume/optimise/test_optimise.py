import numpy as np
import pytest
from analytic_walls import ellipsoid_wall

from femprep.mesh.measures.volume_elements import element_measures, element_volumes
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import enclosed_volume
from femprep.model import FACET_TAGS, Plane, Wall
from femprep.volume.optimise import POOR, REGULAR_SINE, optimise, tet_quality
from femprep.volume.optimise.constraints import constrain

BASE = FACET_TAGS["base"]


@pytest.fixture(scope="module")
def held(coarse_wall, coarse_mesh):
    return constrain(len(coarse_mesh.points), coarse_mesh.facets["triangle"], coarse_mesh.facet_tag, coarse_wall)


def members(mesh) -> np.ndarray:
    """Number of different tags at each point."""
    facets, tag = mesh.facets["triangle"], mesh.facet_tag
    return sum(np.isin(np.arange(len(mesh.points)), facets[tag == t]).astype(int) for t in np.unique(tag))


def spoiled(mesh, size: float, seed: int = 0) -> np.ndarray:
    """The mesh with its inner points thrown about."""
    rng = np.random.default_rng(seed)
    inner = members(mesh) == 0
    return mesh.points + np.where(inner[:, None], rng.uniform(-size, size, mesh.points.shape), 0.0)


def test_quality_is_that_of_the_measures():
    rng = np.random.default_rng(1)
    points = rng.normal(size=(4000, 3))
    cells = np.arange(4000).reshape(-1, 4)
    found = element_measures(points, cells, "tetra")
    angle = np.radians(np.stack([found["minimum_dihedral"], found["maximum_dihedral"]]))
    sine = np.sin(np.abs(angle)).min(axis=0) * np.sign(found["volume"]) / REGULAR_SINE
    quality = tet_quality(points, cells)
    right = found["volume"] > 0
    np.testing.assert_allclose(quality[right], np.minimum(sine, found["mean_ratio"])[right], rtol=1e-9)
    assert (quality[~right] < 0).all()
    assert tet_quality(np.zeros((4, 3)), cells[:1]) == -1.0


def test_freedom_of_each_point(coarse_mesh, held):
    number = members(coarse_mesh)
    np.testing.assert_array_equal(held.freedom, np.array([3, 2, 1, 0])[number])
    assert (number == 2).sum() > 20
    # Directions of points of the base stay in the plane, those of the rim run along it.
    basis = held.targets(coarse_mesh.points)[2]
    base = held.plane_points["base"]
    for k in range(2):
        rows = base[held.freedom[base] > k]
        assert np.abs(basis[rows, k, 2]).max() < 1e-15
    rim = np.flatnonzero(number == 2)
    radial = coarse_mesh.points[rim, :2] / np.linalg.norm(coarse_mesh.points[rim, :2], axis=1, keepdims=True)
    assert np.abs((basis[rim, 0, :2] * radial).sum(axis=1)).max() < 0.2
    lengths = np.linalg.norm(basis, axis=2)
    np.testing.assert_allclose(lengths, 1.0, atol=1e-12)


def test_targets_are_the_closest_points_of_the_own_surface(coarse_wall, coarse_mesh, held):
    rng = np.random.default_rng(2)
    shaken = coarse_mesh.points + rng.uniform(-0.1, 0.1, coarse_mesh.points.shape)
    nodes, places, _ = held.targets(shaken)
    places = places[nodes]
    np.testing.assert_array_equal(nodes, np.flatnonzero(members(coarse_mesh) > 0))
    number = members(coarse_mesh)[nodes]
    facets, tag = coarse_mesh.facets["triangle"], coarse_mesh.facet_tag
    for name in np.unique(tag):
        own = np.isin(nodes, facets[tag == name]) & (number == 1)
        triangles = coarse_wall.triangles[coarse_wall.facet_tag == name]
        expected = ClosestFinder(coarse_wall.points, triangles)(shaken[nodes[own]]).points
        np.testing.assert_allclose(places[own], expected, atol=1e-12)
    rim = places[number == 2]
    assert (rim[:, 2] == 10.0).all()
    radius = np.linalg.norm(rim[:, :2], axis=1)
    rings = np.array([a * np.sqrt(1 - (10.0 / c) ** 2) for a, c in ((22.0, 42.0), (31.0, 51.0))])
    assert np.abs(radius[:, None] - rings).min(axis=1).max() < 0.15


@pytest.mark.parametrize("size", [1.2, 1.8, 2.4])
def test_spoiled_mesh_is_mended(coarse_wall, coarse_mesh, held, size):
    """Of 800 meshes thrown about by .4 of their edges 25 kept an inverted element, which no single point mends."""
    cells = coarse_mesh.cells["tetra"]
    points = spoiled(coarse_mesh, size)
    before = tet_quality(points, cells)
    assert before.min() < POOR
    outcome = optimise(points, cells, held)
    after = tet_quality(outcome.points, cells)
    assert outcome.poor_before == (before < POOR).sum() > 0
    assert outcome.poor_after == (after < POOR).sum()
    assert after.min() > np.sin(np.radians(15.0)) / REGULAR_SINE
    found = element_measures(outcome.points, cells, "tetra")
    assert found["mean_ratio"].mean() > 0.8
    # Facets of 6 mm are chords of the wall: points that slide along it change the volume by less than chords cost.
    whole = float(enclosed_volume(coarse_wall.points, coarse_wall.triangles))
    volume = float(element_volumes(coarse_mesh.points, cells, "tetra").sum())
    assert 0.0 < whole - volume < 0.005 * whole
    assert found["volume"].sum() == pytest.approx(volume, abs=whole - volume)
    assert (outcome.points[held.plane_points["base"], 2] == 10.0).all()
    number = members(coarse_mesh)
    distance = ClosestFinder(coarse_wall.points, coarse_wall.triangles)(outcome.points[number > 0]).distance
    assert distance.max() <= outcome.off_wall + 1e-12
    assert outcome.off_wall < 0.05


def test_sound_mesh_gets_no_worse(coarse_mesh, held):
    cells = coarse_mesh.cells["tetra"]
    outcome = optimise(coarse_mesh.points, cells, held)
    before, after = (element_measures(p, cells, "tetra") for p in (coarse_mesh.points, outcome.points))
    assert after["mean_ratio"].mean() >= before["mean_ratio"].mean()
    assert tet_quality(outcome.points, cells).min() >= min(POOR, tet_quality(coarse_mesh.points, cells).min())


def test_same_bytes_on_repeat(coarse_mesh, held):
    points = spoiled(coarse_mesh, 1.5)
    original = points.copy()
    first = optimise(points, coarse_mesh.cells["tetra"], held).points
    np.testing.assert_array_equal(points, original)
    assert first.tobytes() == optimise(points, coarse_mesh.cells["tetra"], held).points.tobytes()


@pytest.mark.parametrize("seed", range(3))
def test_planes_of_any_direction_are_exact(seed):
    """Points end within 1e-12 mm of an oblique plane far from the origin."""
    rng = np.random.default_rng(seed)
    wall = ellipsoid_wall(rings=6, layers=2)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    shift = rng.uniform(-300, 300, 3)
    old = wall.planes["base"]
    plane = Plane(old.point @ turn.T + shift, old.normal @ turn.T)
    turned = Wall(wall.points @ turn.T + shift, wall.triangles, wall.facet_tag, wall.template, {"base": plane})
    held = constrain(len(turned.points), turned.triangles, turned.facet_tag, turned)
    shaken = turned.points + rng.uniform(-0.1, 0.1, turned.points.shape)
    held.flatten(shaken)
    base = np.unique(turned.triangles[turned.facet_tag == BASE])
    np.testing.assert_array_equal(held.plane_points["base"], base)
    assert np.abs(plane.signed_distance(shaken[base])).max() < 1e-12
