"""Options of the pericardium."""

from __future__ import annotations

from pydantic import Field

from femprep.options.base import StageOptions


class PericardiumOptions(StageOptions):
    """Springs of the pericardium on the epicardium.

    Examples
    --------
    >>> fp.PericardiumOptions().stiffness
    1.0
    """

    stiffness: float = Field(
        1.0, gt=0, description="Stiffness of the pericardium at the apex, pressure per displacement, kPa/mm."
    )
