"""A narrow end of a cavity and the cup on it: cells follow it where what they cut off pulls them, and else do not."""

from __future__ import annotations

import numpy as np
import pytest

import femprep as fp
from femprep.mesh.energies.pull import add_pulls, pulled
from femprep.mesh.patches import PatchSurface
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import Plane, Surface
from femprep.sweeping.cup import followed_points
from femprep.sweeping.matching.match import match_surfaces
from femprep.template import charge_template

BASE = Plane(np.array([0.0, 0.0, 12.0]), np.array([0.0, 0.0, 1.0]))
EDGE = 5.0


def ellipsoid(axes: tuple[float, float, float], name: str, stub: float = 0.0) -> Surface:
    """An ellipsoid with a stub on its side, as high as this, 5 mm wide half-way up."""
    template = charge_template(2000)
    away = np.linalg.norm(template.directions - [1.0, 0.0, 0.0], axis=1)
    points = template.directions * (np.asarray(axes) + stub * np.exp(-((away / 0.16) ** 2))[:, None])
    return Surface(points, template.cells, name=name)


def passed_by(matched, endo: Surface) -> float:
    """How far the cup on the endocardium passes its vertices below the base at most, mm."""
    inside = endo.points[BASE.signed_distance(endo.points) < 0.0]
    return float(ClosestFinder(matched.inner, matched.cup.cells)(inside).distance.max())


@pytest.mark.slow
def test_cells_follow_a_stub_as_wide_as_one_of_them(monkeypatch) -> None:
    endo, epi = ellipsoid((16.0, 16.0, 34.0), "lv", 12.0), ellipsoid((36.0, 36.0, 60.0), "epi")

    def passes() -> float:
        return passed_by(match_surfaces(endo=endo, epi=epi, base=BASE, edge_length=EDGE, element="wedge"), endo)

    assert passes() < 0.45 * EDGE
    monkeypatch.setattr(followed_points, "STRENGTH", (0.0, 0.0))
    assert passes() > 1.5 * EDGE


def test_nothing_is_missed_by_cells_that_follow() -> None:
    template = charge_template(600)
    points = template.directions * 30.0
    own = followed_points.FollowedPoints(PatchSurface(points, template.cells), np.array([[*BASE.normal, BASE.offset]]))
    # Every vertex below the plane, and where edges cross it.
    assert len(own.points) > np.count_nonzero(points[:, 2] < 12.0)
    assert own.points[:, 2].max() == pytest.approx(12.0, abs=1e-9)
    corners, shares, missed = own.missed(points, template.cells, 5.0)
    assert len(corners) == len(shares) == len(missed) == 0
    # One vertex drawn in by 4 mm: it alone is passed by, by triangles that hold it.
    low = int(np.argmin(points[:, 2]))
    dented = points.copy()
    dented[low] *= 26.0 / 30.0
    corners, shares, missed = own.missed(dented, template.cells, 5.0)
    assert np.array_equal(np.unique(missed, axis=0), points[[low]])
    assert np.all((corners == low).any(axis=1))
    assert shares.sum(axis=1) == pytest.approx(1.0)


def test_slopes_of_a_pull_are_those_of_its_sum() -> None:
    rng = np.random.default_rng(2)
    x = rng.normal(0.0, 3.0, (5, 3))
    corners = np.array([[0, 1, 2], [2, 3, 0], [1, 4, 3]])
    shares = rng.dirichlet(np.ones(3), 3)
    targets = x[corners].mean(axis=1) + rng.normal(0.0, 4.0, (3, 3))
    pulls = followed_points.pulls((corners, shares, targets), 5, 2.0, False)
    assert pulled(x, 0, pulls) > 0.0
    for vertex in range(5):
        gradient, hessian = np.zeros(3), np.zeros((3, 3))
        total = add_pulls(x, vertex, pulls, gradient, hessian)
        assert total == pytest.approx(pulled(x, vertex, pulls))
        found, bend = np.zeros(3), np.zeros((3, 3))
        for k in range(3):
            slopes = []
            for step in (1e-5, -1e-5):
                moved = x.copy()
                moved[vertex, k] += step
                slope = np.zeros(3)
                found[k] += add_pulls(moved, vertex, pulls, slope, np.zeros((3, 3))) * np.sign(step) / 2e-5
                slopes.append(slope)
            bend[k] = (slopes[0] - slopes[1]) / 2e-5
        assert gradient == pytest.approx(found, rel=1e-5, abs=1e-4)
        assert hessian == pytest.approx(bend, rel=1e-4, abs=1e-3)


@pytest.mark.data
@pytest.mark.slow
def test_a_real_stub_in_the_last_slice_is_followed(data) -> None:
    path = data / "acdc" / "training" / "patient083" / "patient083_frame08_gt.nii.gz"
    seg = fp.read_segmentation(path, preset="acdc")
    run = fp.mesh_segmentation(seg, volume={"mesher": "sweep"})
    assert run.quality.passed, run.quality.failures
    assert max(record.greatest_pixels for record in run.fidelity.records) < 1.5
