"""How far the facets of a mesh lie from the surfaces they were made from: a record, JSON-ready."""

from __future__ import annotations

from pydantic import Field

from femprep.model.record import Record


class SurfaceFidelity(Record):
    """How far facets of the finished mesh lie from the surface that was given for them, below the base; both ways."""

    surface: str = Field(description="Facet tag.")
    given: str = Field(description="Name of the surface given.")
    mean_mm: float = Field(description="Mean over both surfaces of the distance to the other one, mm.")
    p95_mm: float = Field(description="95th percentile of it, mm.")
    greatest_mm: float = Field(description="Greatest such distance, mm.")
    at_mm: tuple[float, float, float] = Field(description="Where that is, mm LPS.")
