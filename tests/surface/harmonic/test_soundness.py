"""find_faults and sound_map: what is wrong with a mapped surface is found, placed, mended or refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femprep.errors import StageError
from femprep.image import read_segmentation
from femprep.mesh.search.intersection import self_intersections
from femprep.report.notices import lines
from femprep.surface.fit import fit_surface
from femprep.surface.harmonic.field import Field
from femprep.surface.harmonic.mend import HarmonicFit, sound_map
from femprep.surface.harmonic.soundness import find_faults
from femprep.surface.harmonic.spline import Basis
from femprep.template import charge_template, sphere_points

CENTRE = np.array([5.0, -3.0, 40.0])


def central_field() -> Field:
    """One charge at the centre of a ball of 20 mm: u is about 1 on it, and flow lines are radii."""
    return Field(CENTRE, 50.0, CENTRE[None, :], np.full(1, 100.0 / 3.0))


def test_a_ball_has_no_faults() -> None:
    ball = charge_template(200)
    faults = find_faults(CENTRE + 20.0 * ball.directions, ball.cells, central_field())
    assert not faults
    assert (faults.lost, faults.crossing, faults.turned, faults.inward) == (0, 0, 0, False)


def test_a_vertex_pulled_through_its_surface_is_found_where_it_is() -> None:
    ball = charge_template(200)
    points = CENTRE + 20.0 * ball.directions
    # Beyond the opposite side: its triangles pass through others.
    points[0] = CENTRE - 26.0 * ball.directions[0]
    faults = find_faults(points, ball.cells, central_field())
    assert faults.crossing >= 6
    assert np.isin(0, ball.cells[np.unique(self_intersections(points, ball.cells))])
    assert np.linalg.norm(faults.place - CENTRE) < 26.0
    assert str(faults).startswith(f"{faults.crossing} crossing triangles and {faults.turned} folded triangles near [")


def test_a_fold_without_a_crossing_is_found() -> None:
    ball = charge_template(200)
    points = CENTRE + 20.0 * ball.directions
    # One vertex dragged over its neighbour's far side and lifted off: folded, yet nothing is pierced.
    ring = np.unique(ball.cells[(ball.cells == 100).any(axis=1)])
    other = ring[ring != 100][0]
    dragged = CENTRE + 21.5 * (ball.directions[100] + 1.25 * (ball.directions[other] - ball.directions[100]))
    points[100] = dragged
    faults = find_faults(points, ball.cells, central_field())
    assert faults.turned > 0
    assert np.linalg.norm(faults.place - points[100]) < 10.0


def test_lost_vertices_and_an_inside_out_surface_are_faults() -> None:
    ball = charge_template(200)
    points = CENTRE + 20.0 * ball.directions
    inside_out = find_faults(points, ball.cells[:, ::-1], central_field())
    assert inside_out.inward
    assert inside_out.turned == len(ball.cells)
    points[7, 1] = np.nan
    assert str(find_faults(points, ball.cells, central_field())) == "1 lost vertex"


@pytest.mark.slow
def test_what_cannot_be_mended_is_refused_with_place_and_remedy() -> None:
    # A hoop a quarter of a millimetre thick and 60 mm long: 300 triangles' corners cannot be its surface.
    angle = np.linspace(-1.9, 1.9, 25)
    charges = np.column_stack([18.0 * np.cos(angle) - 4.0, 18.0 * np.sin(angle), np.zeros(25)])
    field = Field(np.zeros(3), 50.0, charges, np.full(25, 0.22))
    ball = charge_template(300)
    feet, level, basis = sphere_points(400), np.full(400, 1.2), Basis(sphere_points(60))
    fit = HarmonicFit(field, basis, feet, level, ball.directions, ball.cells, np.eye(3), 40, "hoop")
    message = r"'hoop' has \d+ crossing triangles.* near \[.*mm LPS.*raise .* vertices \(300"
    with pytest.raises(StageError, match=message):
        sound_map(fit, even=False)


@pytest.mark.slow
@pytest.mark.data
def test_a_real_heart_whose_triangles_crossed_is_mended(data: Path) -> None:
    case = data / "acdc" / "training" / "patient014" / "patient014_frame13_gt.nii.gz"
    obj = read_segmentation(case, preset="acdc").object("lv", "myo")
    surface = fit_surface(obj, method="paper")
    assert len(self_intersections(surface.points, surface.cells)) == 0
    assert not find_faults(surface.points, surface.cells, surface.shape.field)  # type: ignore[union-attr]
    np.testing.assert_array_equal(surface.shape(surface.directions), surface.points)  # type: ignore[misc]
    assert surface.volume == pytest.approx(obj.volume, rel=0.03)
    told = lines(surface.info)
    assert sum("crossing triangles" in line for line in told) == 1
    assert any("was held within it" in line for line in told) is (surface.info["stopping_held"] > 0)
    assert surface.info["smoothing"] <= 1e-4
