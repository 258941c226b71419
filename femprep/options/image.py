"""Options of reading a label map."""

from __future__ import annotations

from pydantic import Field, NonNegativeInt, PositiveFloat

from femprep.options.base import Policy, StageOptions


class ImageOptions(StageOptions):
    """Reading a label map and choosing its structures.

    Examples
    --------
    >>> fp.ImageOptions(policy="strict").minimum_voxels
    8
    """

    policy: Policy = Field("repair", description="What to do with pieces, voids and holes: mend and report, or refuse.")
    spacing: tuple[PositiveFloat, PositiveFloat, PositiveFloat] | None = Field(
        None, description="Voxel sizes in mm that replace the file's, for a file that carries none."
    )
    frame: int | None = Field(
        None, ge=1, description="Which frame of a map with several, counted from 1; all others are left out."
    )
    minimum_voxels: int = Field(8, ge=1, description="Smallest number of voxels an object may have.")
    leave_out: tuple[NonNegativeInt, ...] = Field(
        (),
        description="Slices, by number from 0, whose labels are left out: an end is cut off, others are drawn from "
        "their neighbours.",
    )
    correct_shifts: bool = Field(
        False, description="Estimate breath-hold shifts of the slices from the labels and move the slices back."
    )
    long_axis: tuple[str, ...] = Field(
        (),
        description="Label maps of long-axis views of the same heart at the same time: FILE, or "
        "FILE:NAME=LABEL[,NAME=LABEL...] where its labels are others than the stack's; a name with * is a pattern in "
        "the folder of the stack.",
    )
    contours: tuple[str, ...] = Field(
        (),
        description="Files of contours, in place of a label map, or beside one, which gets their long-axis contours: "
        "FILE (GPFile, Segment .mat, .cvi42wsx, RTSTRUCT, JSON), or FILE:lv=NAME[,epi=NAME...] with the names of a "
        "structure set; a name with * is a pattern.",
    )
    fill_papillary: bool = Field(
        False,
        description="Make papillary muscles that are labelled as wall, or not at all, part of the left ventricle's "
        "cavity: what its slices lack of their convex hull, as far as the wall stays as thick as usual.",
    )
