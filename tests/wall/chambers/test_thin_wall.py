"""Where the wall of a cavity is thinner than allowed: told, or refused."""

from __future__ import annotations

import pytest
from wall_shapes import Ellipsoid, template_surface

from femprep.errors import InputError
from femprep.options import WallOptions
from femprep.wall import Part, thin_wall


def ball(radius: float):
    return template_surface(Ellipsoid((radius,) * 3), 600, "ball")


def test_a_thin_wall_is_told_or_refused():
    bodies = [Part(ball(20.0), 0.0, 0.0)]
    cavity = template_surface(Ellipsoid((16.0, 16.0, 19.5)), 600, "la")
    record = thin_wall(bodies, "la", cavity, WallOptions(minimum_thickness=2.0))
    assert record is not None
    assert record["thickened"] == "la"
    assert 0.02 < record["share_of_vertices"] < 0.5
    assert abs(record["thickness_before_mm"] - 0.5) < 0.15
    assert thin_wall(bodies, "la", ball(15.0), WallOptions(minimum_thickness=2.0)) is None
    with pytest.raises(InputError, match=r"the wall of 'la' is 0\.\d+ mm thick near .* below minimum_thickness = 2 mm"):
        thin_wall(bodies, "la", cavity, WallOptions(minimum_thickness=2.0, policy="strict"))
