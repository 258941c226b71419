"""How far surfaces lie from the outlines of the labels they were made from: records, JSON-ready."""

from __future__ import annotations

from pydantic import Field

from femprep.model.record import Record


class SliceFidelity(Record):
    """How far a surface lies from the outline of its labels in one slice."""

    slice: int = Field(description="Number of the slice in the label map, from 0.")
    mean_mm: float = Field(description="Mean over both curves of the distance to the other one, mm.")
    greatest_mm: float = Field(description="Greatest such distance, mm.")
    mean_pixels: float = Field(description="The mean, in pixels.")
    greatest_pixels: float = Field(description="The greatest, in pixels.")
    at_mm: tuple[float, float, float] = Field(description="Where that is, mm LPS.")
    missed: bool = Field(description="The surface does not reach the slice: distances are to where it comes nearest.")


class FidelityRecord(Record):
    """How far one surface of the finished mesh lies from the outlines of its labels, below the base."""

    surface: str = Field(description="Facet tag, or name of a closed surface.")
    labels: str = Field(description="Object of the label map whose outlines it ought to follow.")
    pixel_mm: float = Field(description="Size of a pixel, mm.")
    mean_mm: float = Field(description="Mean over the slices, mm.")
    greatest_mm: float = Field(description="Greatest of any slice, mm.")
    mean_pixels: float = Field(description="Mean over the slices, in pixels.")
    greatest_pixels: float = Field(description="Greatest of any slice, in pixels.")
    slices: tuple[SliceFidelity, ...] = Field(description="Each slice that holds an outline.")
