"""Hearts with known surfaces: sizes in; label maps on any grid, exact surfaces and closed-form volumes out."""

from __future__ import annotations

from femprep.phantoms.bends import Bend
from femprep.phantoms.hearts import (
    atrium,
    biventricular,
    four_chambers,
    lv_ellipsoid,
    rv_bent,
    rv_crescent,
    sphere_shell,
    whole_heart,
)
from femprep.phantoms.phantom import Phantom, Region
from femprep.phantoms.solids import EllipsoidBody, LobedBody, Solid

__all__ = [
    "Bend",
    "EllipsoidBody",
    "LobedBody",
    "Phantom",
    "Region",
    "Solid",
    "atrium",
    "biventricular",
    "four_chambers",
    "lv_ellipsoid",
    "rv_bent",
    "rv_crescent",
    "sphere_shell",
    "whole_heart",
]
