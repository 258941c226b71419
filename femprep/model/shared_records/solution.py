"""What a solver made of a mesh: the record of one passive inflation, and how far it can be believed."""

from __future__ import annotations

from typing import Final, Literal

from pydantic import Field, computed_field

from femprep.model.record import Record

#: The reaction of the base may miss the pressure's load by so much, as a share of the load: CalculiX prints 7 digits.
MISFIT_LIMIT = 1e-5
#: The same where it comes to its end step by step: it stops within half a per cent of the forces at a node.
LARGE_DEFORMATIONS_LIMIT = 1e-3
#: Strains (stretch less 1) up to which a law describes a material. Small-strain elasticity leaves out the square of the
#: displacement gradient, which is 5 % of a strain of 0.1. A neo-Hookean law departs from measured curves of rubber at
#: stretches of about 1.4 (Treloar 1944, doi 10.1039/TF9444000059).
STRAIN_LIMITS: Final = {"linear": 0.1, "orthotropic": 0.1, "neo-hookean": 0.4}
#: Lower pressures that are advised lie below the proportional one by so much.
_MARGIN: Final = 0.95


class InflatedCavity(Record):
    """A cavity before and after an inflation."""

    name: str = Field(description="Which cavity: lv, rv...")
    pressure_kpa: float = Field(description="Pressure on its endocardium, kPa.")
    rest_ml: float = Field(description="Its volume below the base before, mL.")
    inflated_ml: float | None = Field(None, description="The same inflated, mL; null where nothing was solved.")


class SolutionRecord(Record):
    """A mesh inflated by a solver: its base held, a pressure on its endocardium."""

    solver: Literal["ccx"] = Field("ccx", description="The program.")
    material: Literal["linear", "neo-hookean", "orthotropic"] = Field(description="Material of the step.")
    converged: bool = Field(False, description="Whether it reached the whole pressure, with finite displacements.")
    message: str = Field("", description="What it said last where it did not.")
    cavities: tuple[InflatedCavity, ...] = Field(description="Every cavity, with its pressure and volumes.")
    greatest_displacement_mm: float | None = Field(None, description="Of any node, mm.")
    strain: float | None = Field(
        None, description="Principal strain (stretch less 1) of 99 % of the wall: at most this."
    )
    greatest_strain: float | None = Field(None, description="The largest principal strain of any element, by its size.")
    strain_limit: float = Field(description="Strain up to which the law of the material is valid.")
    inverted_elements: int | None = Field(None, description="Elements that the displacement turns inside out.")
    reaction_n: tuple[float, float, float] | None = Field(None, description="What the held base bears in all, N.")
    reaction_misfit: float | None = Field(
        None, description="How far the reaction is from minus the load on free nodes, as a share of the load."
    )
    misfit_limit: float = Field(MISFIT_LIMIT, description="What it may be at most.")

    @computed_field  # type: ignore[prop-decorator]
    @property
    def status(self) -> Literal["solved", "doubtful", "failed"]:
        """Doubtful: solved, but by strains that the material is not valid for."""
        return "failed" if self.failure else "doubtful" if self.doubt else "solved"

    @computed_field  # type: ignore[prop-decorator]
    @property
    def reason(self) -> str:
        """Why, and what to do; empty where it is solved."""
        return self.failure or self.doubt or ""

    @property
    def failure(self) -> str | None:
        """One line on what is wrong; None where nothing is."""
        if not self.converged:
            return f"CalculiX did not solve the inflation by {self.load}: {self.message}"
        if self.reaction_misfit is None or self.reaction_misfit > self.misfit_limit:
            return (
                f"the reaction on the base misses the load of {self.load} by {self.reaction_misfit:.2g} "
                f"of it, asked for is at most {self.misfit_limit:g}: facets or numbers of the deck are wrong"
            )
        if self.inverted_elements and self.material == "neo-hookean":
            return f"CalculiX's solution turns {self.inverted_elements} element(s) inside out; {self._remedy}"
        return None

    @property
    def doubt(self) -> str | None:
        """One line on why a solution that was found is not to be believed; None where it may be."""
        if self.strain is None or (self.strain <= self.strain_limit and not self.inverted_elements):
            return None
        turned = f", {self.inverted_elements} element(s) are inside out" if self.inverted_elements else ""
        return (
            f"the inflation by {self.load} was solved, but 1 % of the wall is strained by more than "
            f"{self.strain:.2g}{turned}, and the {self.material} material is valid up to about {self.strain_limit:g}; "
            f"{self._remedy}"
        )

    @property
    def load(self) -> str:
        """The pressures in words: ``1.5 kPa (lv), 0.5 kPa (rv)``."""
        return ", ".join(f"{one.pressure_kpa:g} kPa ({one.name})" for one in self.cavities)

    @property
    def _remedy(self) -> str:
        share = min(self.strain_limit / self.strain, 1.0) if self.strain else 1.0
        large = "" if self.material == "neo-hookean" else ", or take --material neo-hookean for large deformations"
        return f"lower --pressure to {_MARGIN * 100 * share:.2g} % of it, or raise --young-modulus{large}"
