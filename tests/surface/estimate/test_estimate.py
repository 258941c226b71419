"""The estimated surface: closer to the truth than slice-wise interpolation, sound, the same again, turned with its
image."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import trimesh
from slow_params import slow_but

from femprep.image import Grid, LabelObject, PlaneView, Segmentation, make_object
from femprep.mesh.curvature import Curvature
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import volume
from femprep.model import Surface
from femprep.phantoms import Phantom, atrium, lv_ellipsoid, rv_bent
from femprep.surface import end_planes, fit_surface, surface_distance, surface_quality
from femprep.surface.estimate import estimate
from femprep.surface.estimate.observations import Observations
from femprep.surface.reference import METHODS

BODIES = {"lv": (lv_ellipsoid(), "lv"), "rv": (rv_bent(), "rv"), "la": (atrium(), "la")}


def truth(phantom: Phantom, region: str) -> Surface:
    """The exact surface as fine triangles."""
    ball = trimesh.creation.icosphere(subdivisions=5)
    points, cells = phantom.exact_surface(region, np.asarray(ball.vertices)), np.asarray(ball.faces)
    return Surface(points, cells if volume(points, cells) > 0 else cells[:, ::-1], name="truth")


def stack(phantom: Phantom, region: str, seed: int) -> LabelObject:
    """Labels at 1.4 x 1.4 x 8 mm on a grid moved and tilted at random."""
    rng = np.random.default_rng(seed)
    direction = trimesh.transformations.euler_matrix(*rng.normal(scale=np.radians(8.0), size=3))[:3, :3]
    offset = rng.uniform(0.0, 1.0, size=3) * [1.4, 1.4, 8.0]
    return phantom.segmentation((1.4, 1.4, 8.0), direction=direction, offset=offset).object(region)


@pytest.mark.parametrize("body", slow_but(["lv"], BODIES))
def test_closer_than_slice_interpolation(body: str) -> None:
    phantom, region = BODIES[body]
    obj, true = stack(phantom, region, 7), truth(phantom, region)
    ours = fit_surface(obj, method="smooth", vertices=1250)
    other = METHODS["slice-wise distance, Akima, Taubin"](obj)
    found = [surface_distance(s, true, between=end_planes(obj), samples=10_000) for s in (ours, other)]
    assert found[0].both.mean < 0.7 * found[1].both.mean
    assert found[0].normals.mean < 0.7 * found[1].normals.mean
    quality = surface_quality(ours)
    assert quality.sound
    assert quality.q.mean > 0.95
    assert quality.q.min > 0.5
    assert len(ours.cells) <= 2500


@pytest.mark.slow
def test_shape_gives_the_points_and_more_of_the_surface() -> None:
    phantom, region = BODIES["lv"]
    surface = fit_surface(stack(phantom, region, 1), method="smooth", vertices=1250)
    assert surface.shape is not None
    assert surface.directions is not None
    again = pickle.loads(pickle.dumps(surface.shape))
    np.testing.assert_allclose(again(surface.directions), surface.points, atol=1e-12)
    middle = surface.directions[surface.cells].sum(axis=1)
    distance = ClosestFinder(surface.points, surface.cells)(again(middle)).distance
    assert distance.max() < 1.0


@pytest.mark.slow
def test_same_bytes_again() -> None:
    phantom, region = BODIES["rv"]
    obj = stack(phantom, region, 2)
    one, two = (fit_surface(obj, method="smooth", vertices=600) for _ in range(2))
    assert one.points.tobytes() == two.points.tobytes()


@pytest.mark.slow
def test_turns_with_its_image() -> None:
    phantom, region = BODIES["la"]
    obj = stack(phantom, region, 3)
    turn = trimesh.transformations.euler_matrix(0.5, -1.1, 2.0)[:3, :3]
    grid = Grid(
        obj.grid.shape, obj.grid.spacing, turn @ obj.grid.origin + [10.0, -20.0, 5.0], turn @ obj.grid.direction
    )
    here = fit_surface(obj, method="smooth", vertices=600)
    there = fit_surface(make_object(np.array(obj.mask), grid), method="smooth", vertices=600)
    np.testing.assert_allclose(here.points @ turn.T + [10.0, -20.0, 5.0], there.points, atol=1e-10)


def test_stiffness_follows_the_body() -> None:
    """A body with sharp rims asks for less stiffness than one bent evenly, of the same size."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=25.0)
    points, cells = np.asarray(ball.vertices), np.asarray(ball.faces, dtype=np.int64)
    x = (np.indices((50, 50, 12)).reshape(3, -1).T + 0.31) * [1.4, 1.4, 8.0] - [35.0, 35.0, 48.0]
    bodies = {"ball": np.linalg.norm(x, axis=1) < 25.0, "cube": np.abs(x).max(axis=1) < 20.0}
    chosen = {}
    for name, inside in bodies.items():
        obj = make_object(inside.reshape(50, 50, 12), Grid((50, 50, 12), (1.4, 1.4, 8.0), np.zeros(3), np.eye(3)))
        observations, bent, stiffness = Observations.of(obj), points, 1000.0
        for _ in range(6):
            move, stiffness = estimate._bend(bent, cells, observations, stiffness, True)
            bent = bent + move
        chosen[name] = stiffness
    assert chosen["ball"] > 4.0 * chosen["cube"]


def test_parameters_determined_by_the_labels() -> None:
    from scipy.sparse import diags
    from scipy.sparse.linalg import splu

    rng = np.random.default_rng(5)
    labels, stiff = diags(rng.uniform(0.0, 2.0, 400)), diags(rng.uniform(0.0, 2.0, 400))
    whole = (labels + stiff).tocsc()
    # Signs give the trace of a diagonal matrix exactly.
    assert estimate._determined(splu(whole), labels) == pytest.approx((labels / whole.diagonal()).diagonal().sum())


def test_curvature_of_a_sphere_and_its_change() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=20.0)
    points, cells = np.asarray(ball.vertices), np.asarray(ball.faces, dtype=np.int64)
    shape = Curvature.of(points, cells, 1.0)
    # The twelve vertices with five neighbours are off.
    assert np.count_nonzero(np.abs(shape.mean - 0.1) > 0.002) <= 12
    np.testing.assert_allclose(shape.area.sum(), 4.0 * np.pi * 400.0, rtol=0.01)
    # A sphere of radius 21 has the curvature 2 / 21.
    np.testing.assert_allclose(np.median(shape.change @ np.ones(len(points))), -2.0 / 400.0, rtol=0.05)


def thick_view(degrees, radius=20.0, thickness=12.0):
    """A view through the middle of a ball whose pixels show what most of the slice's thickness shows."""
    angle = np.radians(degrees)
    axes = np.column_stack([[np.cos(angle), np.sin(angle), 0.0], [0.0, 0.0, 1.0]])
    start, across = axes @ np.array([-30.0, -30.0]), np.cross(*axes.T)
    index = np.stack(np.meshgrid(np.arange(60), np.arange(60), indexing="ij"), axis=-1).reshape(-1, 2)
    layers = (np.arange(12) - 5.5) * thickness / 12
    votes = sum((np.linalg.norm(start + index @ axes.T + t * across, axis=1) < radius).astype(int) for t in layers)
    return PlaneView(
        str(degrees), (votes > 6).astype(int).reshape(60, 60), {"lv": (1,)}, start, axes, [1, 1], thickness
    )


def test_a_thick_view_shows_a_ball_smaller_than_it_is():
    centres = np.stack(np.meshgrid(np.arange(36), np.arange(36), np.arange(9), indexing="ij"), axis=-1)
    labels = (np.linalg.norm((centres - [17.5, 17.5, 4.0]) * [1.5, 1.5, 8.0], axis=-1) < 20.0).astype(int)
    grid = Grid(labels.shape, [1.5, 1.5, 8.0], [-26.25, -26.25, -32.0], np.eye(3))
    views = [thick_view(degrees) for degrees in (0, 60, 120)]
    seg = Segmentation(labels, grid, {"lv": (1,)}).with_views(*views)
    made = fit_surface(seg.object("lv"), vertices=800)
    # By its square over 32 times the radius: .23 mm in the views.
    assert abs(np.linalg.norm(made.points, axis=1).mean() - 20.0) < 0.08
