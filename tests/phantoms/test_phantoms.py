"""Phantoms: exact surfaces, closed-form volumes, distances, label maps on any grid."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from femprep.errors import InputError, OptionError
from femprep.image import Grid
from femprep.phantoms import (
    Bend,
    EllipsoidBody,
    LobedBody,
    Phantom,
    Region,
    atrium,
    biventricular,
    lv_ellipsoid,
    rv_bent,
    rv_crescent,
    sphere_shell,
    whole_heart,
)
from femprep.phantoms.closest import fibonacci_sphere

PHANTOMS = {
    "lv": lv_ellipsoid(),
    "sphere": sphere_shell(),
    "bent": rv_bent(),
    "bent and cut": rv_bent(base=20.0),
    "crescent": rv_crescent(),
    "biventricular": biventricular(),
    "atrium": atrium(),
    "whole heart": whole_heart(),
    "flat": lv_ellipsoid((20.0, 26.0, 55.0), (29.0, 36.0, 66.0), -5.0),
}
ALL = [pytest.param(phantom, name, id=f"{key}-{name}") for key, phantom in PHANTOMS.items() for name in phantom.regions]


def sphere(subdivisions: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors and the triangles between them; a subdivision halves all edges."""
    mesh = trimesh.creation.icosphere(subdivisions)
    directions = np.asarray(mesh.vertices)
    return directions / np.linalg.norm(directions, axis=1, keepdims=True), np.asarray(mesh.faces)


def enclosed(points: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


@pytest.mark.parametrize(("phantom", "name"), ALL)
def test_volume_is_the_limit_of_the_surfaces_volume(phantom, name):
    """The volume of the triangulated exact surface approaches the closed form at second order."""
    exact = phantom.volume(name)
    errors = []
    for subdivisions in (4, 6):
        directions, triangles = sphere(subdivisions)
        errors.append(1.0 - enclosed(phantom.exact_surface(name, directions), triangles) / exact)
    assert 0.0 < errors[1] < 4e-4
    # Flat caps included: triangles cut their rims off, which is of second order too.
    assert 1.85 < np.log2(errors[0] / errors[1]) / 2.0 < 2.15


@pytest.mark.parametrize(("phantom", "name"), ALL)
def test_voxel_counts_approach_the_volume(phantom, name):
    seg = phantom.segmentation((1.0, 1.0, 1.0))
    region = phantom.regions[name]
    mask = seg.labels >= 2 if name == "epi" else seg.labels == region.label
    assert np.count_nonzero(mask) * seg.grid.voxel_volume == pytest.approx(phantom.volume(name), rel=2e-3)


@pytest.mark.parametrize(("phantom", "name"), ALL)
def test_surface_separates_inside_from_outside(phantom, name):
    """Moved along the outward normal of the triangles, surface points lie outside; against it, inside."""
    directions, triangles = sphere(4)
    points = phantom.exact_surface(name, directions)
    # Triangles across the rim of a cap cut it off and are left out.
    cap = np.abs(phantom.distance(name, points)) > 1e-8
    corner = points[triangles[cap[triangles].all(axis=1) | ~cap[triangles].any(axis=1)]]
    assert len(corner) > 0.8 * len(triangles)
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    centre = corner.mean(axis=1)
    assert not phantom.inside(name, centre + 0.5 * normal).any()
    assert phantom.inside(name, centre - 0.5 * normal).all()


@pytest.mark.parametrize(("phantom", "name"), ALL)
def test_distance_is_zero_on_the_surface_and_grows_along_its_normal(phantom, name):
    directions, triangles = sphere(3)
    points = phantom.exact_surface(name, directions, truncated=False)
    assert np.abs(phantom.distance(name, points)).max() < 1e-10
    # Triangle normals are the surface's to first order, so that the distance differs from the step to second order.
    normal = np.zeros_like(points)
    corner = points[triangles]
    face = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    for i in range(3):
        np.add.at(normal, triangles[:, i], face)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    for step in (-1.0, 0.5):
        distance = phantom.distance(name, points + step * normal)
        assert np.all(np.sign(distance) == np.sign(step))
        assert np.abs(distance).max() <= abs(step) + 1e-9
        assert np.median(np.abs(distance - step)) < 1e-2


def test_distance_of_a_sphere_is_exact():
    points = np.random.default_rng(0).normal(size=(500, 3)) * 20.0
    np.testing.assert_allclose(
        sphere_shell(20.0, 30.0).distance("epi", points), np.linalg.norm(points, axis=1) - 30.0, atol=1e-12
    )


@settings(deadline=None, max_examples=8)
@given(seed=st.integers(0, 10**6))
def test_distance_is_no_larger_than_to_any_sample(seed):
    rng = np.random.default_rng(seed)
    phantom = [PHANTOMS["bent"], PHANTOMS["crescent"]][seed % 2]
    points = phantom.exact_surface("rv", fibonacci_sphere(100)) + rng.normal(size=(100, 3)) * 4.0
    samples = phantom.exact_surface("rv", fibonacci_sphere(4000), truncated=False)
    to_samples = np.linalg.norm(points[:, None] - samples[None], axis=2).min(axis=1)
    distance = np.abs(phantom.distance("rv", points))
    assert np.all(distance <= to_samples + 1e-12)
    # No surface point is farther from a sample than samples are from their fourth neighbour.
    gap = cKDTree(samples).query(samples, k=5)[0].max()
    assert np.all(distance >= to_samples - gap)


@settings(deadline=None, max_examples=30)
@given(
    along=st.sampled_from([1, 2]),
    radius=st.floats(20.0, 1e7),
    seed=st.integers(0, 10**6),
    shear=st.lists(st.floats(-1e-3, 1e-3), max_size=2),
)
def test_bends_are_inverted_and_their_jacobian_is_the_derivative(along, radius, seed, shear):
    bend = Bend(along, radius, tuple(shear) if along == 1 else ())
    q = np.random.default_rng(seed).uniform(-15.0, 15.0, (20, 3))
    points = bend.forward(q)
    np.testing.assert_allclose(bend.backward(points), q, atol=1e-8)
    h = 1e-5
    for axis in range(3):
        step = h * np.eye(3)[axis]
        slope = (bend.forward(q + step) - bend.forward(q - step)) / (2 * h)
        np.testing.assert_allclose(bend.jacobian(q)[:, :, axis], slope, atol=1e-6)


def test_volume_between_planes_adds_up_and_matches_the_sphere_cap():
    phantom = sphere_shell(20.0, 30.0)
    assert phantom.volume("lv") == pytest.approx(4 / 3 * np.pi * 20.0**3, rel=1e-14)
    # Cap of height h: pi h^2 (3 R - h) / 3.
    assert phantom.volume("lv", 12.0) == pytest.approx(np.pi * 64.0 * (60.0 - 8.0) / 3.0, rel=1e-13)
    lv = lv_ellipsoid()
    parts = [lv.volume("epi", low, low + 10.0) for low in range(-70, 20, 10)]
    assert sum(parts) == pytest.approx(lv.volume("epi"), rel=1e-13)
    assert lv.volume("lv", 25.0) == 0.0
    assert lv.cavity_volume + lv.wall_volume == pytest.approx(lv.volume("epi"))


def test_crescent_touches_the_epicardium_and_does_not_cross_it():
    phantom = biventricular()
    points = phantom.exact_surface("rv", fibonacci_sphere(20000))
    assert not phantom.inside("epi", points).any()
    near = points[np.hypot(points[:, 0], points[:, 1]) < 34.5]
    assert phantom.distance("epi", near).min() < 0.1


def test_lobe_of_no_height_is_a_sphere():
    body = LobedBody(10.0, 0.0, 5.0)
    assert body.volume() == pytest.approx(4 / 3 * np.pi * 1000.0)


# --- label maps ----------------------------------------------------------------------------------------------------


def test_labels_are_those_of_acdc_and_the_base_lies_between_slices():
    seg = biventricular().segmentation((1.44, 1.44, 8.0))
    assert dict(seg.structures) == {"rv": (1,), "myo": (2,), "lv": (3,)}
    assert seg.present == (1, 2, 3)
    assert seg.stack_axis == 2
    heights = biventricular().height(seg.slices("lv").centroid)
    np.testing.assert_allclose(heights.max(), 20.0 - 4.0)
    np.testing.assert_allclose(biventricular().base.point, [0, 0, 20.0])


def test_moved_phantom_has_the_same_labels_at_another_place():
    rotation = Rotation.from_euler("xyz", [20, -30, 50], degrees=True).as_matrix()
    here, there = lv_ellipsoid(), lv_ellipsoid().moved(rotation, (100.0, -50.0, 30.0))
    a, b = here.segmentation((2.0, 2.0, 8.0)), there.segmentation((2.0, 2.0, 8.0))
    np.testing.assert_array_equal(a.labels, b.labels)
    index = np.argwhere(a.labels == 3)
    world = b.grid.to_world(index)
    np.testing.assert_allclose(world, a.grid.to_world(index) @ rotation.T + [100.0, -50.0, 30.0], atol=1e-9)
    assert there.inside("lv", world).all()
    np.testing.assert_allclose(there.base.normal, rotation[:, 2])
    np.testing.assert_allclose(there.distance("lv", world), here.distance("lv", a.grid.to_world(index)), atol=1e-9)


def test_base_first_turns_the_stack():
    up, down = (lv_ellipsoid().segmentation((2.0, 2.0, 8.0), base_first=first) for first in (False, True))
    assert down.grid.right_handed
    np.testing.assert_array_equal(up.labels, down.labels[:, ::-1, ::-1])
    assert lv_ellipsoid().height(down.slices("lv").centroid[:1])[0] == pytest.approx(16.0)


def test_any_grid_and_any_direction():
    direction = Rotation.random(random_state=2).as_matrix()
    phantom = lv_ellipsoid()
    seg = phantom.segmentation((1.5, 1.5, 5.0), direction=direction)
    np.testing.assert_array_equal(seg.grid.direction, direction)
    assert seg.object("lv").volume == pytest.approx(phantom.cavity_volume, rel=0.01)
    assert not seg.object("lv").report["touches_border"]
    grid = Grid((40, 30, 20), (3.0, 3.0, 8.0), (-60.0, -45.0, -70.0), np.eye(3))
    points = grid.to_world(np.argwhere(np.ones(grid.shape, dtype=bool)))
    on_grid = phantom.segmentation(grid=grid)
    np.testing.assert_array_equal(on_grid.mask("lv").ravel(), phantom.inside("lv", points))


def test_partial_volume_is_more_even_than_voxel_centres():
    """Over many placements, the volume of partial-volume labels spreads less."""
    phantom = sphere_shell(12.0, 16.0)
    spread = {}
    for supersample in (1, 4):
        volumes = [
            np.count_nonzero(phantom.segmentation((3.0, 3.0, 8.0), supersample=supersample, offset=o).labels == 3)
            for o in np.random.default_rng(0).uniform(0, 3, (12, 3))
        ]
        spread[supersample] = np.std(volumes)
    assert spread[4] < spread[1]


def test_partial_volume_needs_more_than_half():
    """A slab that fills 0.4 or 0.6 of a slice."""
    for share, taken in ((0.4, False), (0.6, True)):
        top = 10.0 * share
        phantom = Phantom({"lv": Region(EllipsoidBody((50.0, 50.0, 50.0), high=top), 3, "lv")})
        grid = Grid((5, 5, 3), (1.0, 1.0, 10.0), (-2.0, -2.0, -5.0), np.eye(3))
        assert phantom.segmentation(grid=grid, supersample=10).labels[2, 2].tolist() == [3, 3 * taken, 0]


def test_thin_slices_with_gaps_see_their_own_thickness_only():
    phantom = Phantom({"lv": Region(EllipsoidBody((50.0, 50.0, 50.0), high=0.4 * 10.0), 3, "lv")})
    grid = Grid((5, 5, 3), (1.0, 1.0, 10.0), (-2.0, -2.0, -5.0), np.eye(3))
    # The slice from 0 to 10 mm has its centre at 5: with 1 mm it sees 4.5 to 5.5 only, beyond the cut at 4.
    assert phantom.segmentation(grid=grid, supersample=4, slice_thickness=1.0).labels[2, 2].tolist() == [3, 0, 0]


def test_shifts_move_slices_by_as_much():
    phantom, spacing = lv_ellipsoid(), (1.0, 1.0, 8.0)
    plain = phantom.segmentation(spacing, margin=(8, 8, 1))
    shifts = np.random.default_rng(1).integers(-4, 5, (plain.grid.shape[2], 2)).astype(float)
    moved = phantom.segmentation(spacing, margin=(8, 8, 1), shifts=shifts)
    a, b = plain.slices("lv"), moved.slices("lv")
    np.testing.assert_allclose((b.centroid - a.centroid)[:, :2], shifts[a.index], atol=1e-9)
    assert b.zigzag.max() > a.zigzag.max()
    with pytest.raises(InputError, match="shifts have shape"):
        phantom.segmentation(spacing, shifts=np.zeros((3, 2)))


def test_apex_capped_and_uncapped():
    capped, open_ = (lv_ellipsoid().segmentation((1.4, 1.4, 8.0), apex=a) for a in ("capped", "uncapped"))
    assert len(capped.slices("myo")) > len(capped.slices("lv"))
    assert open_.slices("myo").index.tolist() == open_.slices("lv").index.tolist()
    assert open_.object("myo").report["tunnels"] == 1
    assert capped.object("myo").report["tunnels"] == 0


def test_phantoms_are_balls():
    for key, phantom in PHANTOMS.items():
        seg = phantom.segmentation((1.44, 1.44, 8.0))
        for structure in seg.structures:
            if structure == "myo":
                continue
            report = seg.object(structure, policy="strict").report
            assert (report["pieces"], report["voids"], report["tunnels"]) == (1, 0, 0), key


def test_labels_are_the_same_every_time():
    first, second = (rv_bent().segmentation((1.4, 1.4, 8.0), supersample=3).labels.tobytes() for _ in range(2))
    assert first == second


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: lv_ellipsoid((30.0, 30.0, 70.0)), "not all smaller"),
        (lambda: lv_ellipsoid(base=-80.0), "nothing is left"),
        (lambda: rv_bent(bend_radius=10.0), "not larger than the semi-axis"),
        (lambda: rv_bent(bend_radius=15.0), "too long for a bend radius"),
        (lambda: rv_bent(bend_radius=-5.0), "expected a positive number"),
        (lambda: EllipsoidBody((1.0, 0.0, 1.0)), "three positive numbers"),
        (lambda: Bend(2, 50.0, (1e-3,)), "needs along=1"),
        (lambda: Bend(0, 50.0), "expected 1 or 2"),
        (lambda: LobedBody(-1.0, 0.5, 3.0), "expected radius"),
        (lambda: atrium().volume("la", 0.0), "no closed form"),
        (lambda: lv_ellipsoid().segmentation((1, 1, -8)), "three positive numbers"),
        (lambda: lv_ellipsoid().segmentation(supersample=0), "at least 1"),
        (lambda: lv_ellipsoid().segmentation(apex="open"), "'capped' or 'uncapped'"),
        (lambda: lv_ellipsoid().segmentation(slice_thickness=0.0), "expected a positive number"),
        (lambda: lv_ellipsoid().segmentation(base_first=True, direction=np.eye(3)), "does not go with"),
    ],
)
def test_impossible_phantoms_are_refused(make, message):
    with pytest.raises(OptionError, match=message):
        make()


def test_what_a_phantom_does_not_have():
    with pytest.raises(InputError, match="has no surface 'rv'; it has epi, lv"):
        lv_ellipsoid().volume("rv")
    with pytest.raises(InputError, match="not cut by a base plane"):
        _ = sphere_shell().base
    with pytest.raises(InputError, match="not orthonormal"):
        lv_ellipsoid().moved(2.0 * np.eye(3))
