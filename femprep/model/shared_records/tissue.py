"""Records of tissue that a second image showed in a wall."""

from __future__ import annotations

from pydantic import Field

from femprep.model.record import Record


class TissueRecord(Record):
    """One tissue in the wall."""

    name: str = Field(description="Its name.")
    tag: int = Field(description="Number of its region.")
    labels: list[int] = Field(description="Its labels in the image.")
    voxels_ml: float = Field(description="Volume of all its voxels, mL.")
    off_wall_ml: float = Field(description="Volume of those whose centre lies a pixel or more off the wall, mL.")
    wall_ml: float = Field(
        description="Volume of the labels' voxels up to the ends of the wall, mL, those a pixel or more off it left "
        "out; where the rest of the wall is labelled too, the volume of the wall nearest to them. The shares and the "
        "region are held to it."
    )
    shares_ml: float = Field(description="Sum of its share of each element, mL.")
    region_ml: float = Field(description="Volume of its region, mL.")
    nearest_voxel_ml: float = Field(
        description="What the region would be if each element had the label of the voxel at its centre, mL."
    )
    edge_mm: float = Field(description="How far within the outline between the slices its edge was put, mm.")
    threshold: float | None = Field(
        description="Least share of an element of the region; none where elements were cut along the outline."
    )
    centroid_mm: tuple[float, float, float] | None = Field(None, description="Centroid of its shares, mm LPS.")
    transmurality_percent: float | None = Field(
        None,
        description="Mean share of the wall's thickness it takes, of the lines through the wall on which it takes a "
        "tenth or more, %; of the left ventricle and the whole septum.",
    )
    transmurality_of_segments: list[float | None] | None = Field(
        None, description="The same in each of the 17 AHA segments; null where no such line is."
    )
    share_of_segments: list[float | None] | None = Field(
        None, description="Its share of the volume of each AHA segment, %."
    )


class TissuesRecord(Record):
    """All that a second image of labels brought."""

    source: str | None = Field(None, description="Name of the image's file.")
    spacing_mm: tuple[float, float, float] = Field(description="Its voxel sizes, mm.")
    beyond_ml: float = Field(
        description="Volume of the wall between the last slices' outer faces and one slice distance farther, where "
        "their labels go on, mL."
    )
    unknown_ml: float = Field(description="Volume of the wall farther off than that, where there is no tissue, mL.")
    tissues: list[TissueRecord] = Field(description="The tissues.")
