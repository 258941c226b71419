"""What a solver made of a mesh: the record of one passive inflation."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from femprep.model.record import Record

#: The reaction of the base may miss the pressure's load by so much, as a share of the load: CalculiX prints 7 digits.
MISFIT_LIMIT = 1e-5
#: The same where it comes to its end step by step: it stops within half a per cent of the forces at a node.
LARGE_DEFORMATIONS_LIMIT = 1e-3


class SolutionRecord(Record):
    """A mesh inflated by a solver: its base held, a pressure on its endocardium."""

    solver: Literal["ccx"] = Field(description="The program.")
    converged: bool = Field(description="Whether it came to its end, with displacements that are finite.")
    message: str = Field("", description="What it said last where it did not.")
    pressure_kpa: float = Field(description="Pressure on the endocardium, kPa.")
    greatest_displacement_mm: float | None = Field(None, description="Of any node, mm.")
    cavity_rest_ml: float | None = Field(None, description="Cavities before, mL.")
    cavity_ml: float | None = Field(None, description="Cavities inflated, mL.")
    reaction_n: tuple[float, float, float] | None = Field(None, description="What the held base bears in all, N.")
    reaction_misfit: float | None = Field(
        None,
        description="How far the reaction is from minus the pressure's load on free nodes, as a share of the load.",
    )
    misfit_limit: float = Field(MISFIT_LIMIT, description="What it may be at most.")

    @property
    def solved(self) -> bool:
        """Whether it converged, and the reaction balances the pressure."""
        return self.converged and self.reaction_misfit is not None and self.reaction_misfit <= self.misfit_limit

    @property
    def failure(self) -> str | None:
        """One line on what is wrong; None where nothing is."""
        if not self.converged:
            return f"CalculiX did not solve the inflation by {self.pressure_kpa:g} kPa: {self.message}"
        if not self.solved:
            return (
                f"the reaction on the base misses the load of {self.pressure_kpa:g} kPa by {self.reaction_misfit:.2g} "
                f"of it, asked for is at most {self.misfit_limit:g}: facets or numbers of the deck are wrong"
            )
        return None
