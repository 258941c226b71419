"""Anyone's surfaces of a heart: units, base and containment found and told, or refused in one line with the place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import own_shapes as shapes
import pytest

from femprep.errors import InputError
from femprep.model import Plane, Surface
from femprep.wall.own import OwnSurfaces, prepare_surfaces

TOP = Plane([0.0, 0.0, 20.0], [0.0, 0.0, 1.0])


def _told(own: OwnSurfaces) -> str:
    return "; ".join(notice.what for notice in own.notices)


def _scaled(surfaces: dict[str, Surface], by: float) -> dict[str, Surface]:
    return {name: replace(surface, points=by * surface.points) for name, surface in surfaces.items()}


@pytest.mark.parametrize("make", [shapes.cup, shapes.lidded])
def test_the_base_is_that_of_flat_rims_and_of_flat_lids(make: object) -> None:
    own = prepare_surfaces({name: make(name) for name in ("lv", "epi")})  # type: ignore[operator]
    assert own.base is not None
    assert own.base.normal == pytest.approx([0.0, 0.0, 1.0], abs=1e-5)
    assert own.base.point[2] == pytest.approx(20.0, abs=1e-3)
    assert own.anatomy == "lv"


def test_rims_in_no_plane_put_the_base_below_the_lowest_which_is_told() -> None:
    own = prepare_surfaces({"lv": shapes.cup("lv", 24.0), "epi": shapes.cup("epi", 20.0)})
    assert own.base is not None
    assert own.base.point[2] == pytest.approx(20.0, abs=0.1)
    assert "the rims of the surfaces lie in no plane" in _told(own)


def test_closed_surfaces_without_a_base_stay_closed_which_is_told() -> None:
    own = prepare_surfaces(shapes.heart())
    assert own.base is None
    assert "give a base plane by --base" in _told(own)


def test_closed_surfaces_that_meet_at_one_end_are_cut_below() -> None:
    surfaces = shapes.heart()
    points = surfaces["epi"].points.copy()
    above = points[:, 2] > 25.0
    points[above, 2] = 25.0 + 15.0 * np.tanh((points[above, 2] - 25.0) / 15.0)
    own = prepare_surfaces({**surfaces, "epi": replace(surfaces["epi"], points=points)})
    assert own.base is not None
    assert 30.0 < own.base.point @ own.base.normal < 40.5
    assert "meet at one end" in _told(own)


@pytest.mark.parametrize(("unit", "size"), [("m", 1e-3), ("um", 1e3), ("mm", 1.0)])
def test_units_are_guessed_from_the_size_and_told(unit: str, size: float) -> None:
    own = prepare_surfaces(_scaled(shapes.heart(), size), base=Plane(size * TOP.point, TOP.normal))
    assert own.unit == unit
    assert f"taken to be in {unit}" in _told(own)
    assert own.base is not None
    assert own.base.point[2] == pytest.approx(20.0)
    assert own.epi.points[:, 2].min() == pytest.approx(shapes.closed("epi").points[:, 2].min(), rel=1e-6)


def test_a_size_that_fits_two_units_is_asked_about() -> None:
    small = _scaled(shapes.heart(), 0.1)
    with pytest.raises(InputError, match=r"surface 'epi' measures .* --unit mm \(16.8 mm: .* --unit cm \(168 mm"):
        prepare_surfaces(small)
    assert prepare_surfaces(small, base=Plane(0.1 * TOP.point, TOP.normal), unit="cm").unit == "cm"


def test_what_lies_far_beyond_the_base_is_left_out() -> None:
    own = prepare_surfaces(shapes.heart(), base=TOP)
    assert 20.0 < own.epi.points[:, 2].max() < 40.0


def test_surfaces_of_no_hearts_size_or_of_different_units_are_refused() -> None:
    with pytest.raises(InputError, match=r"surface 'epi' measures .* a heart's size in none of"):
        prepare_surfaces(_scaled(shapes.heart(), 3e6))
    mixed = {**shapes.heart(), **_scaled({"lv": shapes.closed("lv")}, 1e-3)}
    with pytest.raises(InputError, match=r"surface 'lv' measures .* different units"):
        prepare_surfaces(mixed)


@pytest.mark.parametrize("unit", ["m", "um"])
def test_a_unit_given_in_which_no_heart_has_this_size_is_refused(unit: str) -> None:
    """A heart of 120 m asked the sweep for 27 million columns, and all memory."""
    with pytest.raises(
        InputError, match=rf"surface 'epi' measures .* mm in the unit '{unit}' given, which is no heart"
    ):
        prepare_surfaces(shapes.heart(), base=TOP, unit=unit)
    assert prepare_surfaces(shapes.heart(), base=TOP, unit="cm").unit == "cm"  # a heart of 1.3 m may be an elephant's


def test_an_endocardium_outside_is_refused_with_how_far_and_where() -> None:
    surfaces = shapes.heart()
    moved = replace(surfaces["lv"], points=surfaces["lv"].points + np.array([20.0, 0.0, 0.0]))
    with pytest.raises(InputError, match=r"surface 'lv' lies up to 1\d\.\d mm outside of surface 'epi', at \(4"):
        prepare_surfaces({**surfaces, "lv": moved}, base=TOP)
    with pytest.raises(InputError, match="have the names changed places"):
        prepare_surfaces({"lv": surfaces["epi"], "epi": surfaces["lv"]}, base=TOP)


def test_a_hole_below_the_base_is_refused_with_its_width_and_place() -> None:
    surfaces = {name: shapes.cup(name, vertices=1500) for name in ("lv", "epi")}
    torn = shapes.without(surfaces["lv"], (25.0, 0.0, -10.0), 16.0)
    with pytest.raises(InputError, match=r"surface 'lv' has a hole \d+\.\d mm wide .* below the base plane at \(2"):
        prepare_surfaces({**surfaces, "lv": torn})
    with pytest.raises(InputError, match=r"surface 'lv' has a hole"):
        prepare_surfaces({**surfaces, "lv": torn}, base=TOP)


def test_names_that_make_no_wall_are_refused() -> None:
    surfaces = shapes.heart()
    with pytest.raises(InputError, match="no surface named 'endo'; endocardia are lv, rv, la, ra"):
        prepare_surfaces({"endo": surfaces["lv"], "epi": surfaces["epi"]})
    with pytest.raises(InputError, match="surfaces lv make no wall; give one of: lv epi"):
        prepare_surfaces({"lv": surfaces["lv"]})


def test_a_unit_that_is_none_is_named():
    with pytest.raises(InputError, match="unit is 'MM'; expected auto, mm, cm, m, um"):
        prepare_surfaces(shapes.heart(), base=TOP, unit="MM")
