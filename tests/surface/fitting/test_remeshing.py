"""Even triangles drawn on a surface anew: as many vertices as asked, on it, and numbered as the template's."""

from __future__ import annotations

import numpy as np
import pytest

from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.operations.collapse import collapsed
from femprep.mesh.operations.midpoint_subdivision import midpoint_subdivision
from femprep.mesh.patches import PatchSurface
from femprep.mesh.polygons import isosurface
from femprep.mesh.search.intersection import self_intersections
from femprep.mesh.topology import is_manifold, volume
from femprep.surface.fitting.place import place_evenly
from femprep.surface.fitting.remeshing import even_mesh, remesh
from femprep.template import charge_template


def dumbbell(stem: float) -> PatchSurface:
    """A ball and a small one on a stem, mm: no map from the sphere covers the small one evenly."""
    axes = np.arange(-26.0, 26.1, 1.5), np.arange(-26.0, 26.1, 1.5), np.arange(-26.0, 70.1, 1.5)
    x, y, z = np.meshgrid(*axes, indexing="ij")
    large, small = 20.0 - np.sqrt(x * x + y * y + z * z), 8.0 - np.sqrt(x * x + y * y + (z - 55.0) ** 2)
    tube = np.minimum(stem - np.hypot(x, y), np.minimum(z, 55.0 - z))
    points, cells = isosurface(np.maximum(np.maximum(large, small), tube), 0.0)
    used, cells = np.unique(cells, return_inverse=True)
    points, cells = points[used] * 1.5, cells.reshape(-1, 3)
    return PatchSurface(points, cells if volume(points, cells) > 0.0 else cells[:, ::-1])


DUMBBELL = dumbbell(4.0)
TEMPLATE = charge_template(800)


def test_a_mesh_is_thinned_to_exactly_so_many_even_triangles() -> None:
    found = collapsed(DUMBBELL.points, DUMBBELL.triangles, DUMBBELL, 777)
    assert found is not None
    points, normals, near, cells = found
    assert points.shape == normals.shape == (777, 3)
    assert cells.shape == (2 * 777 - 4, 3)
    assert is_manifold(cells)
    assert np.linalg.norm(DUMBBELL.points[near] - points, axis=1).max() < 3.0
    quality = triangle_quality(points, cells)
    assert quality.mean() > 0.93
    assert quality.min() > 0.4
    assert volume(points, cells) == pytest.approx(volume(DUMBBELL.points, DUMBBELL.triangles), rel=0.03)


def test_what_cannot_be_thinned_is_told() -> None:
    ball = charge_template(100)
    assert collapsed(ball.directions, ball.cells, PatchSurface(ball.directions, ball.cells), 5) is None


def test_a_coarse_mesh_is_refined_first() -> None:
    ball = charge_template(300)
    surface = PatchSurface(20.0 * ball.directions, ball.cells)
    drawn = even_mesh(surface.points, surface.triangles, surface, 1000)
    assert drawn is not None
    assert drawn.points.shape == (1000, 3)
    assert drawn.folded == 0
    np.testing.assert_allclose(np.linalg.norm(drawn.points, axis=1), 20.0, atol=0.05)
    assert triangle_quality(drawn.points, drawn.cells).min() > 0.6


def test_quartered_triangles_cover_the_same_surface() -> None:
    ball = charge_template(300)
    straight, curved, cells = midpoint_subdivision(20.0 * ball.directions, ball.cells)
    assert len(cells) == 4 * len(ball.cells)
    np.testing.assert_array_equal(straight[:300], curved[:300])
    assert volume(straight, cells) == pytest.approx(volume(20.0 * ball.directions, ball.cells))
    np.testing.assert_allclose(np.linalg.norm(curved, axis=1), 20.0, atol=0.02)


@pytest.mark.slow
def test_a_body_on_a_stem_gets_even_triangles_numbered_as_the_template_s() -> None:
    drawn = remesh(TEMPLATE.directions, DUMBBELL)
    carried = place_evenly(TEMPLATE.directions, TEMPLATE.cells, DUMBBELL, connectivity="auto")
    assert drawn is not None
    assert drawn.points.shape == TEMPLATE.directions.shape
    assert drawn.cells.shape == TEMPLATE.cells.shape
    assert is_manifold(drawn.cells)
    assert len(self_intersections(drawn.points, drawn.cells)) == 0
    quality = triangle_quality(drawn.points, drawn.cells)
    assert quality.mean() > 0.95
    assert quality.min() > 0.5
    np.testing.assert_allclose(DUMBBELL.project(drawn.points)[0], drawn.points, atol=0.05)
    # None is folded on the sphere, and each lies near the template's of its number, as seen from there.
    a, b, c = (drawn.directions[drawn.cells[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).min() > 0.0
    assert np.median(np.einsum("ij,ij->i", drawn.directions, TEMPLATE.directions)) > 0.9
    assert np.linalg.norm(drawn.points - carried.points, axis=1).mean() < 15.0


@pytest.mark.slow
def test_the_same_surface_is_drawn_the_same() -> None:
    first, again = (remesh(TEMPLATE.directions, DUMBBELL) for _ in range(2))
    assert first is not None
    assert again is not None
    assert first.points.tobytes() == again.points.tobytes()
    assert first.cells.tobytes() == again.cells.tobytes()
