"""Placing a template on any smooth surface: even, unfolded, exactly on it, turned with it, the same every time."""

from __future__ import annotations

import numpy as np
import pytest

from femprep.errors import StageError
from femprep.mesh.measures.triangles import areas, scaled_jacobian, triangle_quality
from femprep.mesh.patches import PatchSurface
from femprep.mesh.search.intersection import self_intersections
from femprep.mesh.topology import volume
from femprep.model import FloatArray
from femprep.surface.fitting.chart import Chart
from femprep.surface.fitting.place import place_evenly
from femprep.surface.fitting.slide import Goal
from femprep.template import charge_template
from femprep.template.cubed import cubed_sphere


def ellipsoid(*axes: float) -> PatchSurface:
    ball = charge_template(2500)
    return PatchSurface(ball.directions * axes, ball.cells)


def bean(bend: float) -> PatchSurface:
    """A long ellipsoid whose axis is bent to a part of a circle."""
    ball = charge_template(2500)
    x, y, z = (ball.directions * [14.0, 18.0, 40.0]).T
    angle = bend * z / 40.0
    radius = 40.0 / bend
    return PatchSurface(
        np.column_stack([radius - (radius - x) * np.cos(angle), y, (radius - x) * np.sin(angle)]), ball.cells
    )


def rotation() -> FloatArray:
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    return np.asarray(turn * np.sign(np.linalg.det(turn)))


@pytest.mark.parametrize(
    ("surface", "mean"),
    [(ellipsoid(20, 20, 20), 0.98), (ellipsoid(15, 20, 45), 0.96), (bean(1.2), 0.96)],
    ids=["ball", "ellipsoid", "bean"],
)
def test_triangles_are_even_and_every_vertex_lies_on_the_surface(surface: PatchSurface, mean: float) -> None:
    ball = charge_template(500)
    placed = place_evenly(ball.directions, ball.cells, surface)
    quality = triangle_quality(placed.points, placed.cells)
    assert quality.mean() > mean
    assert quality.min() > 0.6
    assert placed.folded == 0
    assert len(self_intersections(placed.points, placed.cells)) == 0
    np.testing.assert_allclose(surface.project(placed.points)[0], placed.points, atol=1e-3)
    assert volume(placed.points, placed.cells) == pytest.approx(volume(surface.points, surface.triangles), rel=0.03)


def test_quadrilaterals_are_placed_by_the_same_call() -> None:
    surface, cube = bean(1.0), cubed_sphere(12)
    placed = place_evenly(cube.directions, cube.cells, surface)
    assert scaled_jacobian(placed.points, placed.cells).min() > 0.5
    assert placed.folded == 0


def test_a_vertex_keeps_its_side_and_is_turned_with_the_surface() -> None:
    ball, surface, turn = charge_template(300), ellipsoid(18, 22, 35), rotation()
    placed = place_evenly(ball.directions, ball.cells, surface)
    along = placed.points / np.linalg.norm(placed.points, axis=1, keepdims=True)
    assert np.einsum("ij,ij->i", along, ball.directions).min() > 0.8
    turned = PatchSurface(surface.points @ turn.T, surface.triangles)
    again = place_evenly(ball.directions @ turn.T, ball.cells, turned)
    np.testing.assert_allclose(again.points, placed.points @ turn.T, atol=0.05)


def test_the_ends_of_field_lines_tell_how_the_template_is_turned() -> None:
    ball, surface = charge_template(300), ellipsoid(20, 21, 30)
    half = ball.directions * [-20.0, -21.0, 30.0]
    chart = Chart.of(Goal(surface, len(ball.cells)), ball.directions, half)
    # Vertices near the ends of a long body lie a little differently; turned otherwise they would be 40 mm off.
    assert np.linalg.norm(chart.points_at(ball.directions) - half, axis=1).max() < 8.0


def test_the_same_input_gives_the_same_bytes() -> None:
    ball, surface = charge_template(300), bean(1.0)
    first = place_evenly(ball.directions, ball.cells, surface)
    assert place_evenly(ball.directions, ball.cells, surface).points.tobytes() == first.points.tobytes()


@pytest.mark.slow
def test_edges_are_flipped_only_where_the_template_s_order_leaves_no_even_triangles() -> None:
    ball, long = charge_template(400), ellipsoid(8, 9, 60)
    kept, mended = (place_evenly(ball.directions, ball.cells, long, connectivity=c) for c in ("template", "auto"))
    np.testing.assert_array_equal(kept.cells, ball.cells)
    assert kept.flips == 0 < mended.flips
    before, after = (triangle_quality(placed.points, placed.cells) for placed in (kept, mended))
    assert after.min() > max(0.5, before.min())
    assert after.mean() > 0.95
    whole = volume(long.points, long.triangles)
    assert volume(kept.points, kept.cells) < volume(mended.points, mended.cells) < whole
    a, b, c = (mended.directions[mended.cells[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).min() > 0.0
    short = place_evenly(ball.directions, ball.cells, ellipsoid(20, 22, 30), connectivity="auto")
    assert short.flips == 0
    np.testing.assert_array_equal(short.directions, ball.directions)


def test_triangles_are_finer_where_the_surface_is_curved_if_asked() -> None:
    ball, surface = charge_template(400), ellipsoid(15, 15, 40)
    ratio = []
    for power in (0.0, 1.0):
        placed = place_evenly(ball.directions, ball.cells, surface, connectivity="free", curvature=power)
        middle, area = placed.points[placed.cells].mean(axis=1), areas(placed.points, placed.cells)
        ratio.append(area[np.abs(middle[:, 2]) > 36.0].mean() / area[np.abs(middle[:, 2]) < 15.0].mean())
        assert triangle_quality(placed.points, placed.cells).mean() > 0.94
    assert ratio[1] < 0.7 * ratio[0]


def test_a_surface_that_is_no_ball_s_is_refused() -> None:
    ball = charge_template(300)
    surface = PatchSurface(ball.directions, ball.cells[1:])
    with pytest.raises(StageError, match="not a ball's"):
        place_evenly(ball.directions, ball.cells, surface)
