"""Contours in, their JSON file out: the format in which any program can hand contours over."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Final, Literal

from pydantic import Field

from femprep.model import Notice
from femprep.model.record import Record

if TYPE_CHECKING:
    from femprep.image.contours import Contours

#: What the file is known by.
FORMAT: Final = "femprep contours"

Number = Annotated[float, Field(allow_inf_nan=False)]
Point = tuple[Number, Number, Number]
Surface = Literal["lv", "rv", "la", "ra", "epi", "rv_epi", "mitral", "tricuspid", "aortic", "pulmonary", "apex"]


class PlaneRecord(Record):
    """The image plane that contours were drawn on."""

    name: str = Field(description="Name of the plane, by which contours refer to it; each has its own.")
    origin: Point = Field(description="World position of the centre of the first pixel, mm LPS.")
    axes: tuple[Point, Point] = Field(
        description="Unit vectors along which the first and the second pixel index grow, at a right angle."
    )
    spacing: tuple[Number, Number] = Field(description="Pixel size along them, mm.")
    thickness: Number = Field(gt=0.0, description="Thickness of the slice, mm.")
    short_axis: bool = Field(description="Whether the plane is a slice of the short-axis stack, or a long-axis view.")


class ContourRecord(Record):
    """One outline, or the points of one landmark, on one plane."""

    surface: Surface = Field(
        description="What is outlined: a cavity, epi (left ventricle with its myocardium), rv_epi (right ventricle "
        "with its free wall); or a landmark."
    )
    plane: str = Field(description="Name of the plane.")
    closed: bool = Field(False, description="Whether the line returns to its first point.")
    points: tuple[Point, ...] = Field(description="World points in order along the line, mm LPS.")


class ContourFile(Record):
    """Contours of one heart at one time."""

    format: Literal["femprep contours"] = Field(FORMAT, description="Always this.")
    version: Literal[1] = Field(1, description="Version of the format.")
    unit: Literal["mm"] = Field("mm", description="Unit of all lengths.")
    coordinates: Literal["LPS"] = Field("LPS", description="World coordinates, as in DICOM: left, posterior, superior.")
    source: str = Field("", description="Where the contours come from.")
    planes: tuple[PlaneRecord, ...] = Field(description="Image planes.")
    contours: tuple[ContourRecord, ...] = Field(description="Outlines and landmarks.")
    notices: tuple[Notice, ...] = Field((), description="What was assumed or repaired on the way.")


def file_of(contours: Contours) -> ContourFile:
    """The file of contours."""
    planes = [
        {
            "name": plane.name,
            "origin": plane.origin.tolist(),
            "axes": plane.axes.T.tolist(),
            "spacing": plane.spacing.tolist(),
            "thickness": plane.thickness,
            "short_axis": plane.short_axis,
        }
        for plane in contours.planes
    ]
    lines = [
        {"surface": one.surface, "plane": one.plane, "closed": one.closed, "points": one.points.tolist()}
        for one in contours.contours
    ]
    return ContourFile.model_validate(
        {"source": contours.source, "planes": planes, "contours": lines, "notices": contours.notices}
    )
