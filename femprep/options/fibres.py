"""Options of fibres and sheets."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from femprep.options.base import StageOptions

#: Openings of the atria that a rule for their fibres begins from.
Vein = Literal[
    "left_pulmonary", "right_pulmonary", "left_appendage", "superior_cava", "inferior_cava", "right_appendage"
]


class FibreOptions(StageOptions):
    """Fibre and sheet directions; all angles in degrees, their signs drawn in femprep/anatomy/fibres.py.

    Examples
    --------
    >>> fp.FibreOptions(endo_angle=70.0).epi_angle
    -60.0
    """

    endo_angle: float = Field(60.0, ge=-90, le=90, description="Helix angle at the endocardium, degrees.")
    epi_angle: float = Field(-60.0, ge=-90, le=90, description="Helix angle at the epicardium, degrees.")
    rv_endo_angle: float | None = Field(
        None, ge=-90, le=90, description="Helix angle at the RV endocardium, degrees; as the LV's where not given."
    )
    rv_epi_angle: float | None = Field(
        None, ge=-90, le=90, description="Helix angle at the RV epicardium, degrees; as the LV's where not given."
    )
    endo_sheet_angle: float = Field(
        0.0, ge=-180, le=180, description="Sheet angle at the endocardium, degrees from the transmural direction."
    )
    epi_sheet_angle: float = Field(
        0.0, ge=-180, le=180, description="Sheet angle at the epicardium, degrees from the transmural direction."
    )
    outflow_endo_angle: float = Field(
        90.0, ge=-90, le=90, description="Helix angle at the endocardium of outflow tracts, degrees; rule doste alone."
    )
    outflow_epi_angle: float = Field(
        0.0, ge=-90, le=90, description="Helix angle at the epicardium of outflow tracts, degrees; rule doste alone."
    )
    rule: Literal["linear", "bayer", "doste"] = Field(
        "linear",
        description="Interpolate frames and then rotate them by an angle linear in depth, "
        "or rotate first and then interpolate, as Bayer et al. 2012 print it, "
        "or the first with fibres that run out into the outflow tracts after Doste et al. 2019, for open valves.",
    )
    depth: Literal["distance", "laplace"] = Field(
        "distance", description="Depth in the wall by distance, or the harmonic field itself as in Bayer et al. 2012."
    )
    mirrored: Literal["auto", "yes", "no"] = Field(
        "auto", description="Whether the heart is a mirror image, whose fibres are mirrored: found, or said."
    )
    nodes: bool = Field(False, description="Fibres at the nodes too, beside those of the elements.")
    atria: Literal["none", "piersanti"] = Field(
        "none",
        description="Fibres of the atria of a whole heart, with open valves and veins, after Piersanti et al. 2021.",
    )
    veins: dict[Vein, tuple[tuple[float, float, float], ...]] = Field(
        default_factory=dict,
        description="Points near the rims of veins of the atria, mm; told from where the rims lie where not given.",
    )

    @model_validator(mode="after")
    def _atria_have_elements(self) -> FibreOptions:
        if self.atria != "none" and self.nodes:
            raise ValueError("fibres of the atria are those of elements; give nodes = false with them")
        return self
