"""fit_surface on exact bodies: a ball exactly, ellipsoids to a fraction of a voxel; turned images, bounds, bytes."""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from femprep.errors import InputError, OptionError, ResourceError
from femprep.image import LabelObject, boundary_points, read_segmentation
from femprep.image.grid import Grid
from femprep.image.object import make_object
from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.search.intersection import self_intersections
from femprep.mesh.topology import is_closed, is_consistently_wound
from femprep.surface import label_distance
from femprep.surface.fit import TABLE_1, fit_surface, required_memory
from femprep.surface.harmonic.field import Field, fit_strength
from femprep.surface.harmonic.leastsquares import fit_spline
from femprep.surface.harmonic.shape import HarmonicShape
from femprep.surface.harmonic.spline import Basis
from femprep.template import sphere_points

#: The paper's method on a small template, and the default one.
SMALL = {"method": "paper", "vertices": 400, "singularities": 100, "control_points": 90}
SMOOTH = {"method": "smooth", "vertices": 400}
BOTH = pytest.mark.parametrize("options", [SMALL, SMOOTH], ids=["paper", "smooth"])


def ellipsoid(axes: tuple[float, float, float], spacing: tuple[float, float, float], **grid: np.ndarray) -> LabelObject:
    """Voxels whose centres lie in an ellipsoid about the origin of its own axes."""
    half = [int(np.ceil(a / s)) + 3 for a, s in zip(axes, spacing)]
    index = [np.arange(-h, h + 1) * s for h, s in zip(half, spacing)]
    x, y, z = np.meshgrid(*index, indexing="ij")
    direction = grid.get("direction", np.eye(3))
    corner = direction @ np.array([a[0] for a in index])
    body = (x / axes[0]) ** 2 + (y / axes[1]) ** 2 + (z / axes[2]) ** 2 <= 1.0
    return make_object(body, Grid(body.shape, np.array(spacing), corner + grid.get("shift", np.zeros(3)), direction))


def sound(surface: object) -> None:
    points, cells = surface.points, surface.cells  # type: ignore[attr-defined]
    assert np.all(np.isfinite(points))
    assert is_closed(cells)
    assert is_consistently_wound(cells)
    assert len(self_intersections(points, cells)) == 0


@pytest.mark.slow
def test_central_charge_and_a_sphere_s_points_give_the_exact_sphere() -> None:
    # The paper's steps with one charge at the centre: every stage has a closed form.
    centre, radius = np.array([3.0, -5.0, 8.0]), 21.0
    on_surface = centre + radius * sphere_points(500)
    field = fit_strength(Field(centre, 50.0, centre[None, :], np.ones(1)), on_surface)
    level = field.potential(on_surface)
    np.testing.assert_allclose(level, 1.0, atol=1e-12)
    feet = field.directions(field.flow(on_surface, level, 0.0, 40))
    np.testing.assert_allclose(feet, sphere_points(500), atol=1e-10)
    stopping, _ = fit_spline(Basis(sphere_points(60)), feet, level)
    shape = HarmonicShape(field, stopping, 0.5, 1.5, 40)
    np.testing.assert_allclose(shape(sphere_points(300)), centre + radius * sphere_points(300), atol=1e-9)


@pytest.mark.parametrize("method", [pytest.param("paper", marks=pytest.mark.slow), "smooth"])
@pytest.mark.parametrize("spacing", [pytest.param((1.0, 1.0, 1.0), marks=pytest.mark.slow), (1.44, 1.44, 8.0)])
def test_ellipsoid(spacing: tuple[float, float, float], method: str) -> None:
    axes = (24.0, 20.0, 40.0)
    obj = ellipsoid(axes, spacing)
    surface = fit_surface(obj, method=method, **TABLE_1["lv"])
    sound(surface)
    assert len(surface.points) == 1180
    quality = triangle_quality(surface.points, surface.cells)
    assert quality.mean() > 0.95
    # A template that is only stretched is as poor as where its worst triangle comes to lie: over templates of 1,140 to
    # 1,240 vertices the least was found at .57 to .69, one in a hundred below .81 to .86.
    assert np.quantile(quality, 0.01) > 0.7
    assert quality.min() > (0.4 if method == "paper" else 0.6)
    assert surface.volume == pytest.approx(obj.volume, rel=0.01)
    exact = np.sqrt(((surface.points / axes) ** 2).sum(axis=1)) - 1.0
    off = np.abs(exact) * np.linalg.norm(surface.points, axis=1)
    between = np.abs(surface.points[:, 2]) < axes[2] - spacing[2]
    assert off[between].mean() < 0.15 * spacing[0]


@pytest.mark.slow
def test_finer_voxels_come_closer() -> None:
    axes = (24.0, 20.0, 30.0)
    errors = []
    for size in (4.0, 2.0, 1.0):
        obj = ellipsoid(axes, (size, size, size))
        surface = fit_surface(obj, method="paper", vertices=600, singularities=150, control_points=120)
        off = (np.sqrt(((surface.points / axes) ** 2).sum(axis=1)) - 1.0) * np.linalg.norm(surface.points, axis=1)
        errors.append(np.sqrt(np.mean(off**2)))
    assert errors[1] < 0.7 * errors[0]
    assert errors[2] < 0.7 * errors[1]
    assert errors[2] < 0.15


def test_vertices_are_samples_of_the_shape_and_the_map_goes_both_ways() -> None:
    surface = fit_surface(ellipsoid((24.0, 20.0, 40.0), (1.5, 1.5, 6.0)), **SMALL)
    shape = surface.shape
    assert isinstance(shape, HarmonicShape)
    np.testing.assert_array_equal(shape(surface.directions), surface.points)
    between = sphere_points(333)
    points = shape(between)
    np.testing.assert_allclose(shape.field.potential(points), shape.levels(between), atol=1e-8)
    assert np.abs(shape.directions_of(points) - between).max() < 1e-4
    assert np.abs(shape.height(points)).max() < 1e-3
    inward = shape.field.gradient(points)
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    assert np.median(shape.height(points + 0.2 * inward)) == pytest.approx(0.2, abs=0.02)
    assert np.median(shape.height(points - 0.2 * inward)) == pytest.approx(-0.2, abs=0.02)
    again = pickle.loads(pickle.dumps(shape))
    np.testing.assert_array_equal(again(between), points)


@BOTH
def test_a_turned_image_gives_the_same_surface_turned(options: dict) -> None:
    axes, spacing = (24.0, 20.0, 40.0), (1.5, 1.5, 6.0)
    turn = Rotation.from_euler("xyz", [0.4, -1.0, 2.2]).as_matrix()
    shift = np.array([30.0, -80.0, 12.0])
    straight = fit_surface(ellipsoid(axes, spacing), **options)
    turned = fit_surface(ellipsoid(axes, spacing, direction=turn, shift=shift), **options)
    np.testing.assert_allclose(turned.points, straight.points @ turn.T + shift, atol=1e-6)
    np.testing.assert_allclose(turned.directions, straight.directions @ turn.T, atol=1e-12)
    np.testing.assert_array_equal(turned.cells, straight.cells)


@BOTH
def test_a_left_handed_image_gives_an_outward_surface(options: dict) -> None:
    obj = ellipsoid((24.0, 20.0, 40.0), (1.5, 1.5, 6.0), direction=np.diag([-1.0, 1.0, 1.0]))
    surface = fit_surface(obj, **options)
    sound(surface)
    assert surface.volume == pytest.approx(obj.volume, rel=0.03)
    assert not surface.info["notices"]


def test_info_says_what_was_done() -> None:
    obj = ellipsoid((24.0, 20.0, 40.0), (1.5, 1.5, 6.0))
    seen: list[tuple[str, float]] = []
    surface = fit_surface(obj, progress=lambda stage, fraction: seen.append((stage, fraction)), **SMALL)
    info = json.loads(json.dumps(dict(surface.info)))
    assert info["method"] == "paper"
    assert (info["singularities"], info["control_points"], info["vertices"]) == (100, 90, 400)
    assert info["boundary_points"] == len(boundary_points(obj))
    assert 0.9 < info["level_mean"] <= 1.0
    assert 0.0 < info["residual_rms"] < 1.5
    assert info["stopping_held"] == 0
    assert [f for _, f in seen] == sorted(f for _, f in seen)
    assert seen[-1] == ("surface", 1.0)


def test_smooth_is_the_default_and_says_what_was_done() -> None:
    obj = ellipsoid((24.0, 20.0, 40.0), (1.5, 1.5, 6.0))
    seen: list[tuple[str, float]] = []
    surface = fit_surface(obj, vertices=400, progress=lambda stage, fraction: seen.append((stage, fraction)))
    info = json.loads(json.dumps(dict(surface.info)))
    assert info["method"] == "smooth"
    assert info["vertices"] == 400
    assert info["boundary_points"] == len(boundary_points(obj))
    assert 0.0 < info["residual_rms"] < 1.5
    assert [f for _, f in seen] == sorted(f for _, f in seen)
    assert seen[-1] == ("surface", 1.0)


def test_defaults_grow_with_the_object() -> None:
    small = fit_surface(ellipsoid((12.0, 12.0, 20.0), (1.5, 1.5, 8.0)), method="paper", vertices=100)
    large = fit_surface(ellipsoid((30.0, 30.0, 50.0), (1.5, 1.5, 8.0)), method="paper", vertices=100)
    assert 50 <= small.info["singularities"] < large.info["singularities"] <= 450
    assert small.info["control_points"] == small.info["singularities"]


@pytest.mark.parametrize("options", [SMALL, pytest.param(SMOOTH, marks=pytest.mark.slow)], ids=["paper", "smooth"])
def test_given_boundary_points_are_used(options: dict) -> None:
    obj = ellipsoid((24.0, 20.0, 40.0), (1.5, 1.5, 6.0))
    points = boundary_points(obj)
    grown = replace(points, points=points.points * 1.1)
    assert fit_surface(obj, boundary=grown, **options).volume == pytest.approx(1.1**3 * obj.volume, rel=0.03)


@settings(deadline=None, max_examples=8)
@given(
    st.tuples(*[st.floats(14.0, 35.0)] * 3),
    st.tuples(st.floats(1.0, 2.5), st.floats(1.0, 2.5), st.floats(1.0, 8.0)),
)
def test_any_ellipsoid_is_sound(axes: tuple[float, float, float], spacing: tuple[float, float, float]) -> None:
    obj = ellipsoid(axes, spacing)
    surface = fit_surface(obj, **SMALL)
    sound(surface)
    assert surface.volume == pytest.approx(obj.volume, rel=0.05)


@pytest.mark.parametrize("method", ["paper", "smooth"])
def test_a_few_voxels(method: str) -> None:
    mask = np.zeros((2, 2, 2), dtype=bool)
    mask[:] = True
    obj = make_object(mask, Grid(mask.shape, np.array([1.5, 1.5, 8.0]), np.zeros(3), np.eye(3)))
    surface = fit_surface(obj, method=method, vertices=60)
    sound(surface)
    assert method == "smooth" or surface.info["underdetermined"]


def test_stopping_values_are_kept_within_bounds() -> None:
    centre = np.zeros(3)
    field = Field(centre, 50.0, 15.0 * sphere_points(60), np.full(60, 0.4))
    # A spline that falls below zero and rises far above what lies between sphere and charges.
    wild, _ = fit_spline(Basis(sphere_points(40)), sphere_points(200), 1.0 + 20.0 * sphere_points(200)[:, 2])
    shape = HarmonicShape(field, wild, 0.3, 1.4, 40)
    levels = shape.levels(sphere_points(300))
    assert levels.min() == 0.3
    assert levels.max() == 1.4
    points = shape(sphere_points(300))
    assert np.all(np.isfinite(points))
    assert np.linalg.norm(points, axis=1).max() < 50.0


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"vertices": 5}, OptionError, "vertices"),
        ({"singularity": 5}, OptionError, "unknown option 'singularity'"),
        ({"control_points": 30_000}, ResourceError, r"needs about .* GB, the limit is 4 GB; lower control_points"),
        ({"memory_limit": 0.001}, ResourceError, "raise memory_limit"),
    ],
)
def test_bad_options_are_refused_before_any_work(changes: dict, error: type, message: str) -> None:
    with pytest.raises(error, match=message):
        fit_surface(ellipsoid((24.0, 20.0, 40.0), (1.5, 1.5, 6.0)), **{"method": "paper"} | changes)


def test_memory_grows_with_control_points_squared_and_not_with_their_product() -> None:
    base = required_memory(10_000, 200, 8000, 1500, 40.0)
    assert required_memory(10_000, 200, 16_000, 1500, 40.0) == pytest.approx(4 * base, rel=0.1)
    # 10 times the boundary points would add 6 GB if G were held.
    assert required_memory(100_000, 200, 8000, 1500, 40.0) - base < 0.1


def test_too_few_boundary_points_are_refused() -> None:
    obj = ellipsoid((24.0, 20.0, 40.0), (1.5, 1.5, 6.0))
    points = boundary_points(obj)
    few = replace(
        points,
        **{name: getattr(points, name)[:5] for name in ("points", "normal", "axis", "spacing", "voxel")},
    )
    with pytest.raises(InputError, match="5 boundary points, too few"):
        fit_surface(obj, boundary=few)


_CHILD = """
import hashlib, sys
sys.path.insert(0, sys.argv[1])
from test_fit import THREADED, ellipsoid
from femprep.surface import label_distance
from femprep.surface.fit import fit_surface
for options in THREADED:
    surface = fit_surface(ellipsoid((24.0, 20.0, 40.0), (1.5, 1.5, 6.0)), **options)
    print(hashlib.sha256(surface.points.tobytes() + surface.cells.tobytes()).hexdigest())
"""
#: As many vertices as usual where sparse systems are solved.
THREADED = [SMALL, SMALL | {"method": "even"}, {"method": "smooth", "vertices": 1500}]


@pytest.mark.slow
def test_same_bytes_with_one_thread_and_two() -> None:
    digests = set()
    for threads in ("1", "2"):
        child = subprocess.run(
            [sys.executable, "-c", _CHILD, str(Path(__file__).parent)],
            env={
                **os.environ,
                **dict.fromkeys(("NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), threads),
            },
            capture_output=True,
            text=True,
            check=True,
        )
        digests.add(tuple(child.stdout.split()))
    assert len(digests) == 1
    assert len(set(*digests)) == len(THREADED)


@pytest.mark.slow
@pytest.mark.data
@pytest.mark.parametrize("method", ["paper", "smooth"])
@pytest.mark.parametrize(
    ("case", "structures", "table", "mean", "least"),
    [
        ("patient007/patient007_frame01", ("lv",), "lv", 0.94, 0.45),
        ("patient007/patient007_frame01", ("lv", "myo"), "epi", 0.95, 0.5),
        ("patient021/patient021_frame13", ("lv", "myo"), "epi", 0.94, 0.5),
        ("patient041/patient041_frame01", ("lv",), "lv", 0.85, 0.2),
    ],
)
def test_real_hearts_at_the_settings_of_table_1(
    data: Path, case: str, structures: tuple[str, ...], table: str, mean: float, least: float, method: str
) -> None:
    obj = read_segmentation(data / "acdc" / "training" / f"{case}_gt.nii.gz", preset="acdc").object(*structures)
    surface = fit_surface(obj, method=method, **TABLE_1[table])
    sound(surface)
    assert len(surface.points) == TABLE_1[table]["vertices"]
    assert surface.volume == pytest.approx(obj.volume, rel=0.03)
    assert label_distance(surface, obj).nearest < 0.5
    quality = triangle_quality(surface.points, surface.cells)
    assert quality.mean() > mean
    assert quality.min() > least
