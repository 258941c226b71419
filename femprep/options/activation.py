"""Options of Purkinje fibres and of activation."""

from __future__ import annotations

from typing import Final

from pydantic import Field, model_validator

from femprep.options.base import StageOptions

_Point = tuple[float, float, float]
#: Straight pieces of a branch at most: growing one takes half a millisecond, and there are hundreds of branches.
_MOST_SEGMENTS: Final = 200


class PurkinjeOptions(StageOptions):
    """Purkinje fibres on the endocardia of the ventricles.

    Examples
    --------
    >>> fp.PurkinjeOptions(branch_length=6.0).generations
    20
    """

    branch_length: float = Field(
        8.0, ge=0.5, description="Mean length of a branch, mm; lengths vary about it by half of it."
    )
    branch_angle: float = Field(
        8.6, gt=0, le=90, description="Angle by which each of two branches turns from the one they come from, degrees."
    )
    repulsion: float = Field(0.1, ge=0, le=1, description="How much branches turn away from what is there already.")
    generations: int = Field(20, ge=1, le=60, description="How often branches part, at most.")
    segment_length: float = Field(1.0, gt=0, description="Length of the straight pieces of a branch, mm.")
    speed: float = Field(2.5, ge=1e-3, le=100, description="Speed of conduction in Purkinje fibres, m/s.")
    seed: int = Field(0, ge=0, lt=2**32, description="Number that random lengths and sides are drawn from.")
    root_lv: _Point | None = Field(
        None, description="Where the left bundle branch begins, mm LPS; below the base of the septum where not given."
    )
    root_rv: _Point | None = Field(
        None, description="Where the right bundle branch begins, mm LPS; below the base of the septum where not given."
    )

    @model_validator(mode="after")
    def _branches_have_segments(self) -> PurkinjeOptions:
        if self.branch_length < 3 * self.segment_length:
            raise ValueError(
                f"a branch of {self.branch_length:g} mm needs three segments at least; segment_length is "
                f"{self.segment_length:g} mm"
            )
        if self.branch_length > _MOST_SEGMENTS * self.segment_length:
            raise ValueError(
                f"a branch of {self.branch_length:g} mm has {self.branch_length / self.segment_length:.3g} segments of "
                f"{self.segment_length:g} mm, more than {_MOST_SEGMENTS}; give longer segments or shorter branches"
            )
        return self


class ActivationOptions(StageOptions):
    """Spread of activation through the wall of the ventricles.

    Speeds are those measured in pigs' left ventricles: Caldwell et al. 2009, doi 10.1161/CIRCEP.108.830133.

    Examples
    --------
    >>> fp.ActivationOptions().fibre_speed
    0.67
    """

    fibre_speed: float = Field(0.67, ge=1e-3, le=100, description="Speed of activation along fibres, m/s.")
    sheet_speed: float = Field(
        0.30, ge=1e-3, le=100, description="Speed of activation across fibres within sheets, m/s."
    )
    normal_speed: float = Field(0.17, ge=1e-3, le=100, description="Speed of activation across sheets, m/s.")
