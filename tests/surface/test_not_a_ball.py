"""Objects that are not balls: a tunnel is closed over, pieces are dropped and said, a C-shaped ring keeps its gap."""

from __future__ import annotations

import logging

import numpy as np
import pytest

from femprep.errors import InputError
from femprep.image import Grid, LabelObject, make_object
from femprep.surface import fit_surface, label_distance, surface_quality

SPACING = np.array([1.5, 1.5, 8.0])
INDEX = np.indices((60, 60, 9)).reshape(3, -1).T
PLACE = (INDEX - [29.5, 29.5, 4.0]) * SPACING


def labelled(inside: np.ndarray, **changes: object) -> LabelObject:
    grid = Grid((60, 60, 9), SPACING, np.zeros(3), np.eye(3))
    return make_object(inside.reshape(60, 60, 9), grid, "body", **changes)


def ball(centre: tuple[float, float, float], radius: float) -> np.ndarray:
    return np.linalg.norm(PLACE - centre, axis=1) < radius


@pytest.mark.slow
def test_a_tunnel_is_closed_over_and_said(caplog: pytest.LogCaptureFixture) -> None:
    drilled = ball((0.0, 0.0, 0.0), 28.0) & ~(np.hypot(PLACE[:, 0] - 6.0, PLACE[:, 1]) < 2.5)
    with caplog.at_level(logging.WARNING):
        obj = labelled(drilled)
    assert obj.report["tunnels"] == 1
    assert "tunnel" in caplog.text
    surface = fit_surface(obj, vertices=800)
    assert surface_quality(surface).sound
    assert surface.volume == pytest.approx(4.0 / 3.0 * np.pi * 28.0**3, rel=0.06)


def test_of_several_pieces_the_largest_is_kept_and_said(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        obj = labelled(ball((-12.0, 0.0, 0.0), 20.0) | ball((30.0, 0.0, 0.0), 8.0))
    assert obj.report["pieces"] == 2
    assert "largest of 2 pieces" in caplog.text
    surface = fit_surface(obj, vertices=600)
    assert surface_quality(surface).sound
    assert surface.points[:, 0].max() < 29.5 * 1.5 + 14.0


def test_strict_policy_refuses_pieces_with_the_reason() -> None:
    with pytest.raises(InputError, match="in 2 pieces"):
        labelled(ball((-12.0, 0.0, 0.0), 20.0) | ball((30.0, 0.0, 0.0), 10.0), policy="strict")


@pytest.mark.slow
def test_a_c_shaped_object_keeps_its_gap() -> None:
    ring = np.abs(np.hypot(PLACE[:, 0], PLACE[:, 1]) - 26.0) < 7.0
    gap = (PLACE[:, 0] > 0.0) & (np.abs(PLACE[:, 1]) < 9.0)
    obj = labelled(ring & ~gap & (np.abs(PLACE[:, 2]) < 20.0))
    surface = fit_surface(obj, vertices=1500)
    quality = surface_quality(surface)
    assert quality.sound
    assert surface.volume == pytest.approx(obj.volume, rel=0.1)
    assert label_distance(surface, obj).nearest < 0.8
    # Nothing lies in the middle of the gap.
    local = surface.points - (np.array([29.5, 29.5, 4.0]) * SPACING)
    assert not np.any((local[:, 0] > 15.0) & (np.abs(local[:, 1]) < 5.0))
