"""Coordinates: exact on a slab, on a spherical shell as far as the mesh, monotone, 0 and 1 on their surfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from anatomy_meshes import ellipsoid, grown, slab

from femprep.anatomy.axes.find_axes import ventricular_axes
from femprep.anatomy.axes.mirror import flip
from femprep.anatomy.axes.ventricular_axes import VentricularAxes
from femprep.anatomy.coordinates import add_coordinates
from femprep.anatomy.laplace.fields import WallFields
from femprep.errors import InputError
from femprep.model import FACET_TAGS

KINDS = ["tetra", "wedge", "hexahedron", "mixed"]
SPHERE = {"endo": (25.0, 25.0), "epi": (35.0, 35.0), "base": 0.0}
#: Slabs have no cavity for a long axis to run through: it is given, behind the endocardium.
SLAB_AXES = VentricularAxes([-20.0, 10, 0], [-20.0, 10, 30], [0.0, -1, 0])


@pytest.mark.parametrize("kind", KINDS)
def test_slab_is_exact(kind):
    wall = slab(kind)
    mesh = add_coordinates(wall.mesh, axes=SLAB_AXES)
    assert mesh.point_data["transmural"] == pytest.approx(wall.depth, abs=1e-8)
    assert mesh.point_data["apicobasal"] == pytest.approx(wall.polar, abs=1e-8)
    centres = np.concatenate([mesh.points[block].mean(axis=1) for block in mesh.cells.values()])
    assert mesh.cell_data["transmural"] == pytest.approx(centres[:, 0] / 10, abs=1e-8)
    assert mesh.cell_data["apicobasal"] == pytest.approx(centres[:, 2] / 30, abs=1e-8)


@pytest.mark.parametrize("kind", ["tetra", "wedge", "hexahedron"])
def test_quadratic_slab_is_exact_at_mid_side_nodes_too(kind):
    mesh = add_coordinates(grown(slab(kind, cells=(2, 2, 2)).mesh), axes=SLAB_AXES)
    assert mesh.point_data["transmural"] == pytest.approx(mesh.points[:, 0] / 10, abs=1e-8)
    assert mesh.point_data["apicobasal"] == pytest.approx(mesh.points[:, 2] / 30, abs=1e-8)


def test_spherical_shell_is_linear_in_radius_and_polar_angle():
    errors = []
    for size, layers in ((3, 2), (6, 4), (12, 8)):
        wall = ellipsoid("tetra", size=size, layers=layers, **SPHERE)
        mesh = add_coordinates(wall.mesh)
        depth = mesh.point_data["transmural"] - (np.linalg.norm(mesh.points, axis=1) - 25) / 10
        along = mesh.point_data["apicobasal"] - wall.polar / (np.pi / 2)
        errors.append([np.abs(depth).mean(), np.abs(along).mean(), np.abs(depth).max(), np.abs(along).max()])
    errors = np.array(errors)
    assert (np.diff(errors[:, :2], axis=0) < 0).all()
    assert errors[-1, 0] < 5e-6
    assert errors[-1, 2] < 1e-3
    assert errors[-1, 1] < 5e-3
    assert errors[-1, 3] < 0.03  # near the apex, where all gradient lines meet


@pytest.mark.parametrize("kind", KINDS)
def test_values_on_their_surfaces(kind):
    wall = ellipsoid(kind, size=4, layers=3)
    fields = WallFields(wall.mesh)
    mesh = add_coordinates(wall.mesh, fields=fields)
    depth, along = mesh.point_data["transmural"], mesh.point_data["apicobasal"]
    assert depth[fields.lv] == pytest.approx(0.0, abs=0)
    assert depth[np.setdiff1d(fields.epi, fields.lv)] == pytest.approx(1.0, abs=0)
    assert along[fields.base] == pytest.approx(1.0, abs=0)
    assert along[fields.apex_nodes] == pytest.approx(0.0, abs=0)
    for table in (mesh.point_data, mesh.cell_data):
        assert table["transmural"].min() >= 0
        assert table["transmural"].max() <= 1
        assert table["apicobasal"].min() >= 0
        assert table["apicobasal"].max() <= 1
        assert "transventricular" not in table


def test_depth_on_the_ellipsoid_is_the_true_relative_depth():
    means, harmonic = [], []
    for size, layers in ((3, 2), (6, 4), (12, 8)):
        wall = ellipsoid("tetra", size=size, layers=layers)
        fields = WallFields(wall.mesh)
        error = np.abs(add_coordinates(wall.mesh, fields=fields).point_data["transmural"] - wall.depth)
        assert error.max() < 5e-3
        means.append(error.mean())
        harmonic.append(np.abs(1 - fields.across - wall.depth).max())
    # Gradient lines are not quite the lines on which the ellipsoids were blended: that, not the mesh, is what remains.
    assert max(means) < 1e-3
    assert min(harmonic) > 0.1  # what normalising by distance mends


def test_monotone_along_the_gradient_lines():
    wall = ellipsoid("tetra", size=8, layers=5)
    fields = WallFields(wall.mesh)
    gradient = fields.space.gradient
    for field, distance in ((fields.across, fields.across_distance), (fields.upward, fields.upward_distance)):
        assert (np.sum(gradient(field) * gradient(distance), axis=1) > 0).all()


def test_apicobasal_is_the_arc_length_along_the_meridian():
    wall = ellipsoid("tetra", size=8, layers=5)
    mesh = add_coordinates(wall.mesh)
    a, b = 25 + 10 * wall.depth, 55 + 10 * wall.depth
    true = _arc(a, b, wall.polar) / _arc(a, b, np.arccos(-15 / b))
    error = np.abs(mesh.point_data["apicobasal"] - true)
    assert error.mean() < 0.005
    assert error.max() < 0.03


def _arc(a: np.ndarray, b: np.ndarray, polar: np.ndarray) -> np.ndarray:
    u = np.linspace(0, 1, 201)[:, None] * polar
    speed = np.sqrt((a * np.cos(u)) ** 2 + (b * np.sin(u)) ** 2)
    return (speed[1:] + speed[:-1]).sum(axis=0) / 2 * polar / 200


@pytest.mark.parametrize("kind", KINDS)
def test_rotational_of_a_body_of_revolution_is_the_angle(kind):
    wall = ellipsoid(kind, size=6, layers=4)
    axes = ventricular_axes(wall.mesh)
    mesh = add_coordinates(wall.mesh)
    turn = mesh.point_data["rotational"]
    error = (turn - axes.angle(mesh.points) / 360 + 0.5) % 1 - 0.5
    far = axes.radius(mesh.points) > 5
    assert np.abs(error[far]).max() * 360 < 3.0
    assert np.abs(error[far]).mean() * 360 < 0.5
    assert turn.min() >= 0
    assert turn.max() < 1
    assert np.hypot(mesh.point_data["rotational_cos"], mesh.point_data["rotational_sin"]) == pytest.approx(1.0)
    angle = np.arctan2(mesh.point_data["rotational_sin"], mesh.point_data["rotational_cos"]) / (2 * np.pi) % 1
    assert (turn - angle + 0.5) % 1 == pytest.approx(0.5, abs=1e-12)


def test_rotational_of_elements_does_not_average_across_the_jump():
    wall = ellipsoid("hexahedron", size=4, layers=2)
    mesh = add_coordinates(wall.mesh)
    axes = ventricular_axes(wall.mesh)
    centre = mesh.points[mesh.cells["hexahedron"]].mean(axis=1)
    error = (mesh.cell_data["rotational"] - axes.angle(centre) / 360 + 0.5) % 1 - 0.5
    assert np.abs(error[axes.radius(centre) > 5]).max() < 0.02


def test_rotational_is_linear_in_distance_round_an_oval_wall():
    wall = ellipsoid("tetra", size=8, layers=3, base=20.0)
    oval = wall.mesh.points * [1.5, 1.0, 1.0]
    mesh = add_coordinates(replace(wall.mesh, points=oval))
    rim = mesh.facets["triangle"][mesh.facet_tag == FACET_TAGS["base"]]
    at = np.intersect1d(rim, np.flatnonzero(wall.depth == 1))
    order = at[np.argsort(np.arctan2(oval[at, 1], oval[at, 0]))]
    step = np.linalg.norm(np.diff(oval[np.append(order, order[0])], axis=0), axis=1)
    length = np.concatenate([[0], np.cumsum(step)[:-1]]) / step.sum()
    turn = mesh.point_data["rotational"][order]
    sense = np.sign(np.median((np.diff(turn) + 0.5) % 1 - 0.5))
    error = (sense * (turn - turn[0]) - length + 0.5) % 1 - 0.5
    geometric = np.unwrap(np.arctan2(oval[order, 1], oval[order, 0])) / (2 * np.pi)
    off = geometric - geometric[0] - length
    assert np.ptp(error) < 0.35 * np.ptp(off)
    assert np.ptp(error) < 0.025


def test_mirrored_twin_has_the_same_coordinates():
    wall = ellipsoid("tetra", size=4, layers=2)
    axes = VentricularAxes([0.0, 0, -65], [0.0, 0, 15], [-0.6, 0.8, 0], mirrored=False)
    mesh = add_coordinates(wall.mesh, axes=axes)
    twin = flip(mesh)
    again = add_coordinates(twin, axes=VentricularAxes.from_record(twin.info["axes"]))
    for name in ("transmural", "apicobasal", "rotational_cos", "rotational_sin"):
        assert again.point_data[name] == pytest.approx(mesh.point_data[name], abs=1e-6)


def test_input_is_unchanged_and_repeats_are_equal():
    wall = ellipsoid("tetra", size=3, layers=2)
    before = wall.mesh.points.copy()
    one, two = add_coordinates(wall.mesh), add_coordinates(wall.mesh)
    assert np.array_equal(wall.mesh.points, before)
    assert not wall.mesh.point_data
    for name in one.point_data:
        assert np.array_equal(one.point_data[name], two.point_data[name])
    assert one.info["coordinates"]["rotational_zero"] == "mid-septum (assumed)"


def test_missing_surface_is_named():
    mesh = ellipsoid("tetra", size=3, layers=2).mesh
    tag = np.where(mesh.facet_tag == FACET_TAGS["epi"], FACET_TAGS["apex"], mesh.facet_tag)
    with pytest.raises(InputError, match=r"no facets tagged 'epi'.*; its facets: endo, base, apex"):
        add_coordinates(replace(mesh, facet_tag=tag))
