"""Options of the wall."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from femprep.options.base import Policy
from femprep.options.thickness import LeastThickness


class WallOptions(LeastThickness):
    """Clipping the surfaces and joining them to a wall.

    Examples
    --------
    >>> fp.WallOptions(base_offset=2.0).minimum_thickness
    1.0
    """

    policy: Policy = Field(
        "repair", description="What to do with a wall that is too thin: push apart and report, or refuse."
    )
    basal_end: Literal["auto", "first", "last"] = Field(
        "auto",
        description="Which end of the stack is basal: found, or the first or last slice, which lays the base along the "
        "slices in cubic voxels, too.",
    )
    base: tuple[float, float, float, float, float, float] | Literal["annulus"] | None = Field(
        None,
        description="Base plane in place of the one that the labels show: point x, y, z and normal x, y, z away from "
        "the apex, mm LPS; or annulus, the plane through the mitral annulus that long-axis views show.",
    )
    base_offset: float = Field(
        0.0, description="Move the base plane from where the labels put it, mm, positive towards the apex."
    )
    repair: bool = Field(
        False,
        description="Smooth external surfaces where they cross themselves; by more than 5 mm is refused.",
    )
    apex: Literal["closed", "clipped"] = Field(
        "closed", description="Whether the wall is closed at the apex or cut there by a plane."
    )
    rv_wall_thickness: float = Field(
        3.0, gt=0, description="Thickness of the right ventricle's free wall where the labels have none, mm."
    )
    atrial_wall_thickness: float = Field(
        2.0, gt=0, description="Thickness of the walls of the atria where the labels have none, mm."
    )
    openings: Literal["closed", "labels"] = Field(
        "closed",
        description="Valves and vessels of the whole heart: closed by tissue, or cut open where the labels show them, "
        "that is, where cavities touch each other or the background.",
    )
    valves: dict[str, tuple[float, ...]] = Field(
        default_factory=dict,
        description="Further openings of the whole heart, by name (mitral, tricuspid, aortic, pulmonary, veins_la, "
        "veins_ra): centre x, y, z, normal x, y, z out of the ventricle or atrium, radius; mm, LPS. They take the "
        "place of those of that name that the labels show.",
    )
