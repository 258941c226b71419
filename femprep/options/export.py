"""Options of writing a mesh for a solver."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, ValidationError, ValidatorFunctionWrapHandler, field_validator

from femprep.options.base import StageOptions


class ExportOptions(StageOptions):
    """Writing the mesh for a solver.

    Examples
    --------
    >>> fp.ExportOptions(length_unit="m").step
    'none'
    """

    length_unit: Literal["mm", "cm", "m"] = Field(
        "mm",
        description="Unit of length in the files of solvers; femprep's own files stay in mm, openCARP's are in "
        "micrometres.",
    )
    step: Literal["none", "inflation"] = Field(
        "none",
        description="Analysis written into the deck where the format holds one: "
        "none, or passive inflation with the base fixed.",
    )
    material: Literal["linear", "neo-hookean", "orthotropic"] = Field(
        "linear",
        description="Material of the step: linear elastic, neo-Hookean (large deformations, pressure follows the "
        "wall), or linear elastic and stiffer along the fibres, which the mesh must have.",
    )
    young_modulus: float = Field(30.0, gt=0, description="Young's modulus of the material of the step, kPa.")
    poisson_ratio: float = Field(0.4, gt=-1, lt=0.5, description="Poisson's ratio of the material of the step.")
    fibre_stiffness: float = Field(
        3.0, ge=1, description="How many times stiffer the orthotropic material is along the fibres than across."
    )
    pressure: float | dict[str, float] = Field(
        1.0,
        description="Pressure on the endocardium in the step, kPa; or one for each cavity, as lv=1.5 and rv=0.5: a "
        "cavity that is not named has none.",
    )

    @field_validator("pressure", mode="wrap")
    @classmethod
    def _one_or_by_cavity(cls, value: Any, validate: ValidatorFunctionWrapHandler) -> Any:
        try:
            return validate(value)
        except ValidationError:
            raise ValueError("expected a number of kPa, or one for each cavity, as lv=1.5") from None
