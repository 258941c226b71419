"""Numerical Laplace against concentric spheres; singularities inside what they are placed in, at the stated depth."""

from __future__ import annotations

import numpy as np
import pytest

from femprep.errors import InputError
from femprep.surface.harmonic import laplace
from femprep.surface.harmonic.laplace import solve_laplace
from femprep.surface.harmonic.sources import erode, place_sources
from femprep.template import sphere_points


def distances(size: int, voxel: float) -> np.ndarray:
    axis = (np.arange(size) - size // 2) * voxel
    return np.sqrt(axis[:, None, None] ** 2 + axis[None, :, None] ** 2 + axis[None, None, :] ** 2)


@pytest.mark.parametrize("size", [21, 49, 98])
def test_concentric_spheres(size: int) -> None:
    voxel = 100.0 / size
    r = distances(size, voxel)
    inner, outer = 18.0, 45.0
    value = solve_laplace(r <= inner, r >= outer)
    between = (r > inner) & (r < outer)
    exact = (1.0 / r[between] - 1.0 / outer) / (1.0 / inner - 1.0 / outer)
    # Surfaces are known to half a voxel, where u falls by 1 / inner and more per mm.
    assert np.abs(value[between] - exact).max() < 1.2 * voxel / inner
    assert value.min() == 0.0
    assert value.max() == 1.0


@pytest.mark.parametrize("size", [61, 98])
def test_relaxation_has_settled(size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    # Placement needs directions of the gradient: 1 % of the whole rise is far below what its voxels cost.
    r = distances(size, 100.0 / size)
    z = np.abs((np.arange(size) - size // 2) * 100.0 / size)[:, None, None]
    inner, outer = (r <= 18.0) & (z < 9.0), r >= 45.0
    value = solve_laplace(inner, outer)
    monkeypatch.setattr(laplace, "_SWEEPS", 600)
    assert np.abs(value - solve_laplace(inner, outer)).max() < 0.01


def test_two_erosions_of_a_ball() -> None:
    r = distances(61, 1.0)
    eroded, thin = erode(r <= 20.0)
    assert thin == 0.0
    # Depth is counted to the centre of the first voxel outside, half a voxel beyond the surface.
    assert r[eroded].max() <= 18.75
    assert r[~eroded].min() >= 17.75


def test_a_sheet_that_two_erosions_would_delete_keeps_its_middle() -> None:
    solid = np.zeros((40, 40, 40), dtype=bool)
    solid[5:35, 5:35, 18:21] = True
    eroded, thin = erode(solid)
    assert thin == 1.0
    assert eroded.any()
    inside = np.argwhere(eroded)
    assert np.all(inside[:, 2] == 19)
    assert inside[:, :2].min() >= 6
    assert len(inside) > 20 * 20


def test_depth_is_reduced_in_the_thin_part_only() -> None:
    x, y, z = np.indices((60, 60, 60)) - 30
    ball = (x + 12) ** 2 + y**2 + z**2 <= 12**2
    tail = (np.abs(y) <= 1) & (np.abs(z) <= 1) & (x >= -12) & (x < 22)
    eroded, thin = erode(ball | tail)
    assert 0.0 < thin < 0.2
    depth_in_ball = np.sqrt((x + 12.0) ** 2 + y**2 + z**2)
    assert depth_in_ball[eroded & (x < -2)].max() <= 10.75
    assert eroded[50, 30, 30]
    assert not eroded[50, 31, 30]


def test_an_empty_object_is_refused() -> None:
    with pytest.raises(InputError, match="no voxel"):
        erode(np.zeros((10, 10, 10), dtype=bool))


def test_sources_of_a_ball_lie_evenly_on_the_eroded_ball() -> None:
    voxel, radius = 1.0, 26.0
    solid = distances(45, voxel) <= 20.0
    directions = sphere_points(100)
    sources, info = place_sources(directions, solid, np.array([22.0, 22.0, 22.0]), voxel, radius)
    length = np.linalg.norm(sources, axis=1)
    assert info["stray"] == 0
    assert info["thin_share"] == 0.0
    assert length.max() < 19.25
    assert length.min() > 17.0
    # Field lines of concentric spheres are rays.
    assert np.einsum("ij,ij->i", sources / length[:, None], directions).min() > np.cos(np.radians(6.0))


def test_sources_of_a_bent_sheet_lie_inside_it() -> None:
    # A crescent, three voxels thick: its barycentre lies outside it.
    r = distances(81, 1.0)
    x = (np.arange(81) - 40)[:, None, None] * np.ones((1, 81, 81))
    solid = (r > 17.0) & (r < 20.5) & (x > 3.0)
    middle = np.argwhere(solid).mean(axis=0)
    assert not solid[tuple(np.rint(middle).astype(int))]
    sources, info = place_sources(sphere_points(150), solid, middle, 1.0, 28.0)
    index = np.rint(sources + middle).astype(int)
    assert solid[tuple(index.T)].all()
    assert info["thin_share"] == 1.0


def test_grid_reaches_beyond_the_mask() -> None:
    solid = distances(25, 1.0) <= 10.0
    sources, _ = place_sources(sphere_points(30), solid, np.array([12.3, 12.0, 11.6]), 1.0, 40.0)
    assert np.linalg.norm(sources - [-0.3, 0.0, 0.4], axis=1).max() < 9.5
