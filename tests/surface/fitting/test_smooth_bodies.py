"""The smooth surface of random bodies sampled in thick slices: sound and of their volume."""

from __future__ import annotations

import numpy as np
import pytest
from faults import faults
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from surface_shapes import BALL, body

from femprep.image import Grid, LabelObject, make_object
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import volume
from femprep.report.notices import lines
from femprep.surface import fit_surface, surface_quality

BODIES = {
    "lengths": st.tuples(st.floats(12.0, 30.0), st.floats(12.0, 30.0), st.floats(25.0, 60.0)),
    "waves": st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6),
    "bend": st.floats(0.0, 1.4),
    "pixel": st.floats(1.4, 2.0),
    "slices": st.sampled_from([5.0, 8.0, 10.0]),
    "seed": st.integers(0, 10_000),
}
#: The volume may be off by this share: 600 flat triangles' chords cut off a hundredth or two of it.
VOLUME = 0.05


def sampled(lengths, waves, bend, pixel, slices, seed) -> tuple[LabelObject, float]:
    """Labels of a body, tilted and moved at random in its stack; and its true volume."""
    rng = np.random.default_rng(seed)
    tilt = Rotation.from_euler("xyz", rng.normal(scale=15.0, size=3), degrees=True).as_matrix()
    points = body(lengths, waves, bend) @ tilt.T + rng.uniform(-5.0, 5.0, size=3)
    spacing = np.array([pixel, pixel, slices])
    low, high = np.floor(points.min(axis=0) / spacing) - 1, np.ceil(points.max(axis=0) / spacing) + 1
    shape = (high - low + 1).astype(int)
    index = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), axis=-1).reshape(-1, 3)
    inside = ClosestFinder(points, BALL.cells).signed((index + low) * spacing) < 0.0
    direction = Rotation.random(random_state=seed).as_matrix()
    grid = Grid(tuple(int(n) for n in shape), spacing, direction @ (low * spacing) + [30.0, -80.0, 12.0], direction)
    return make_object(inside.reshape(shape), grid, "body"), volume(points, BALL.cells)


def faults_of_surface(lengths, waves, bend, pixel, slices, seed) -> list[str]:
    """What is unsound, uneven or of the wrong volume about the surface of a body's labels."""
    obj, true = sampled(lengths, waves, bend, pixel, slices, seed)
    surface = fit_surface(obj, vertices=600)
    quality = surface_quality(surface)
    replaced = [line for line in lines(surface.info) if "in its place" in line]
    return faults(
        (quality.sound, "not sound"),
        (not replaced, f"replaced: {replaced}"),
        (surface.volume == pytest.approx(true, rel=VOLUME), f"volume {surface.volume:.0f} mm3 of {true:.0f} mm3"),
        (quality.q.mean > 0.95, f"mean quality {quality.q.mean:.3f}"),
        (quality.q.min > 0.5, f"least quality {quality.q.min:.3f}"),
    )


CHECKS = list(HealthCheck)


@pytest.mark.slow
@settings(max_examples=100, deadline=None, derandomize=True, suppress_health_check=CHECKS)
@given(**BODIES)
def test_the_surfaces_of_many_bodies_are_sound(lengths, waves, bend, pixel, slices, seed):
    assert faults_of_surface(lengths, waves, bend, pixel, slices, seed) == []
