"""Walls with a ledge, as a shifted slice leaves one: filled as they are, else softened there alone, which is told."""

from __future__ import annotations

import numpy as np
import pytest

from femprep.mesh.measures.volume_elements import element_measures
from femprep.mesh.patches import PatchSurface
from femprep.model import Plane, Surface
from femprep.report.notices import lines
from femprep.sweeping import sweep
from femprep.sweeping.matching import match
from femprep.sweeping.matching.match import match_surfaces
from femprep.sweeping.matching.soften import soften
from femprep.template import charge_template

BASE = Plane(np.array([0.0, 0.0, 12.0]), np.array([0.0, 0.0, 1.0]))
#: Where a slice lies that is shifted sideways, and how far, mm.
LEDGE, SHIFT = -12.0, 12.0


def ellipsoid(axes: tuple[float, float, float], name: str, shift: float = 0.0) -> Surface:
    template = charge_template(2000)
    points = template.directions * axes
    points[:, 0] += shift * np.clip(5.0 - np.abs(points[:, 2] - LEDGE), 0.0, 1.0)
    return Surface(points, template.cells, name=name)


@pytest.fixture(scope="module")
def endo() -> Surface:
    return ellipsoid((22.0, 22.0, 42.0), "lv")


@pytest.mark.slow
def test_smooth_walls_are_left_alone(endo) -> None:
    matched = match_surfaces(endo=endo, epi=ellipsoid((32.0, 32.0, 52.0), "epi"), base=BASE, edge_length=4.0)
    assert matched.info["softened_mm"] == 0.0
    assert lines(matched.info) == []


def least_scaled_jacobian(matched) -> float:
    mesh = sweep(matched, element="wedge")
    ((kind, cells),) = mesh.cells.items()
    return float(element_measures(mesh.points, cells, kind)["scaled_jacobian"].min())


@pytest.mark.slow
def test_a_ledge_that_mended_layers_can_fill_is_kept(endo) -> None:
    epi = ellipsoid((34.0, 34.0, 52.0), "epi", SHIFT)
    matched = match_surfaces(endo=endo, epi=epi, base=BASE, edge_length=2.5, element="wedge")
    assert matched.info["softened_mm"] == 0.0
    assert least_scaled_jacobian(matched) > 0.15
    # Its edge, the part of the shifted slice farthest out, is the one that was given.
    assert matched.outer[:, 0].max() > epi.points[:, 0].max() - 1.0


@pytest.mark.slow
def test_a_ledge_is_softened_until_layers_are_as_good_as_asked_for(endo, monkeypatch) -> None:
    monkeypatch.setattr(match, "_BENT", 2.0)
    epi = ellipsoid((34.0, 34.0, 52.0), "epi", SHIFT)
    matched = match_surfaces(endo=endo, epi=epi, base=BASE, edge_length=2.5, element="wedge")
    assert 0.0 < matched.info["softened_mm"] < 0.5 * SHIFT
    (notice,) = (line for line in lines(matched.info) if "softened" in line)
    assert f"{matched.info['softened_mm']:.1f} mm" in notice
    assert least_scaled_jacobian(matched) > 0.15
    # Far from the ledge the epicardium is the one that was given.
    outer = matched.outer_surface.points
    far = outer[(outer[:, 2] < LEDGE - 25.0) | (outer[:, 2] > LEDGE + 20.0)]
    assert len(far) > 100
    assert np.abs(np.linalg.norm(far / [34.0, 34.0, 52.0], axis=1) - 1.0).max() < 0.01


def test_softening_ends_with_its_reach() -> None:
    template = charge_template(800)
    rng = np.random.default_rng(1)
    rough = template.directions * (30.0 + 0.5 * rng.standard_normal((800, 1)))
    place = np.array([[30.0, 0.0, 0.0]])
    soft = soften(PatchSurface(rough, template.cells), place, 10.0, ())
    away = np.linalg.norm(rough - place, axis=1)
    moved = np.linalg.norm(soft.points - rough, axis=1)
    assert np.all(moved[away > 20.0] == 0.0)
    near = away < 10.0
    radius, before = (np.linalg.norm(points[near], axis=1) for points in (soft.points, rough))
    assert radius.std() < 0.6 * before.std()


def test_the_cap_beyond_a_plane_stays() -> None:
    template = charge_template(800)
    surface = PatchSurface(template.directions * 30.0, template.cells)
    plane = Plane(np.array([0.0, 0.0, 10.0]), np.array([0.0, 0.0, 1.0]))
    soft = soften(surface, surface.points, 5.0, [plane])
    moved = np.linalg.norm(soft.points - surface.points, axis=1)
    height = plane.signed_distance(surface.points)
    assert np.all(moved[height >= 5.0] == 0.0)
    assert moved[height < 0.0].min() > 0.0
