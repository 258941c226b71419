"""The least thickness of a wall, which a wall that is cut and one that is swept share."""

from __future__ import annotations

from pydantic import Field

from femprep.options.base import StageOptions


class LeastThickness(StageOptions):
    """How thin a wall may be, and how far it may be thickened: one option for every mesher."""

    minimum_thickness: float = Field(
        1.0,
        ge=0,
        description="Least wall thickness, mm; where the wall is thinner the epicardium is pushed outwards. Swept "
        "layers ask for a tenth of an edge each in any case.",
    )
    maximum_push: float = Field(
        8.0, ge=0, description="Farthest the epicardium may be pushed outwards to reach the least thickness, mm."
    )
