"""The quality below which elements are improved: none above it misses a limit on its shape."""

from __future__ import annotations

import numpy as np
import pytest

from femprep.mesh.measures.volume_elements import element_measures
from femprep.options import CheckOptions
from femprep.volume.optimise import POOR, tet_quality
from femprep.volume.optimise.poor import poor_quality, spire_mean_ratio


def drawn(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Positive tetrahedra between points drawn at random, each with points of its own."""
    points = np.random.default_rng(5).normal(size=(4 * count, 3))
    tets = np.arange(4 * count).reshape(-1, 4)
    a, b, c, d = (points[tets[:, k]] for k in range(4))
    swapped = np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)) < 0.0
    tets[swapped] = tets[swapped][:, [1, 0, 2, 3]]
    return points, tets


@pytest.mark.parametrize("purpose", ["general", "implicit", "explicit", "electrophysiology"])
def test_no_element_above_it_misses_a_limit(purpose: str) -> None:
    points, tets = drawn(100_000)
    limits = CheckOptions(purpose=purpose).resolved()
    measures = element_measures(points, tets, "tetra")
    above = tet_quality(points, tets) >= poor_quality(25.0, limits)
    assert above.sum() > 10_000
    assert measures["scaled_jacobian"][above].min() >= limits.minimum_scaled_jacobian
    assert measures["minimum_dihedral"][above].min() >= 25.0
    assert measures["maximum_dihedral"][above].max() <= limits.maximum_dihedral
    assert measures["mean_ratio"][above].min() >= (limits.minimum_mean_ratio or 0.0)


def test_the_defaults_ask_for_no_more_than_the_angle() -> None:
    assert poor_quality(25.0, CheckOptions().resolved()) == pytest.approx(POOR)


@pytest.mark.parametrize("radius", [0.1, 0.3, 0.5, 0.57])
def test_the_mean_ratio_of_a_spire(radius: float) -> None:
    """A regular triangle of some radius below a top: three edges of length 1, the others no longer."""
    turn = np.radians([90.0, 210.0, 330.0])
    base = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.zeros(3)])
    points = np.vstack([base, [0.0, 0.0, np.sqrt(1.0 - radius**2)]])
    measures = element_measures(points, np.array([[0, 1, 2, 3]]), "tetra")
    assert spire_mean_ratio(float(measures["scaled_jacobian"][0])) == pytest.approx(measures["mean_ratio"][0])


def test_a_regular_tetrahedron_is_the_roundest_spire() -> None:
    assert spire_mean_ratio(1.0) == pytest.approx(1.0)
