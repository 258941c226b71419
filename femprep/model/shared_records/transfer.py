"""Records of a transfer of fields from mesh to mesh."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from femprep.model.record import Record


class FieldRecord(Record):
    """One field that was transferred, and what of it comes back."""

    name: str = Field(description="Name of the field.")
    on: Literal["elements", "points"] = Field(description="Where its values stand.")
    kind: Literal["number", "tag", "vector", "direction"] = Field(description="What it was taken for.")
    unit: str = Field(
        description="Of the errors: '' the field's own, '%' of the volume (or points), 'degrees' between directions."
    )
    back_mean: float | None = Field(
        None,
        description="There and back: mean difference from what it was (of a tag the share that came back another one); "
        "null where it was not carried back.",
    )
    back_95: float | None = Field(None, description="The same, not exceeded in 95 % of the volume; null for a tag.")
    back_largest: float | None = Field(None, description="The same, largest; null for a tag.")
    span: float | None = Field(None, description="Largest less least value of the field, to hold the errors against.")


class TransferRecord(Record):
    """How fields came from one mesh to another one, and how exactly."""

    length_unit: Literal["mm"] = Field("mm", description="Unit of all lengths.")
    source: str | None = Field(None, description="File name of the mesh the fields are from.")
    source_sha256: str | None = Field(None, description="SHA-256 of that file.")
    target: str | None = Field(None, description="File name of the mesh they were brought to.")
    target_sha256: str | None = Field(None, description="SHA-256 of that file.")
    parts: list[str] = Field(description="Parts of the wall that both have.")
    source_elements: int = Field(description="Elements of the source.")
    target_elements: int = Field(description="Elements of the target.")
    source_edge_mm: float = Field(description="Mean length of the source's edges.")
    target_edge_mm: float = Field(description="Mean length of the target's edges.")
    outside_share: float = Field(
        description="Share of the target's elements whose coordinates occur nowhere in the source, as beyond its base; "
        "the nearest coordinates there were taken."
    )
    place_back_mean_mm: float | None = Field(
        None,
        description="How far the centre of an element comes back from where it was, mean over the volume.",
    )
    place_back_95_mm: float | None = Field(None, description="The same, not exceeded in 95 % of the volume.")
    place_back_largest_mm: float | None = Field(None, description="The same, largest.")
    fields: list[FieldRecord] = Field(default_factory=list, description="The fields, in the order asked for.")
