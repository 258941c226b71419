"""Arguments that several commands take, and the panels of the help they stand in."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from femprep.cli._fields import option
from femprep.errors import OptionError
from femprep.export.table import FORMATS
from femprep.options import (
    AnnotateOptions,
    CheckOptions,
    ExportOptions,
    FibreOptions,
    ImageOptions,
    Options,
    SurfaceOptions,
)

INPUT: Final = "Input"
SURFACES: Final = "Surfaces"
FIBRES: Final = "Fibres"
OUTPUT: Final = "Output"
DECK: Final = "Deck"

Out = Annotated[Path, typer.Option("--out", "-o", help="Folder to make.", rich_help_panel=OUTPUT)]
Preset = Annotated[str | None, option(Options, "preset", panel=INPUT)]
Unit = Annotated[str | None, option(AnnotateOptions, "unit", panel=INPUT)]
Policy = Annotated[str | None, option(ImageOptions, "policy", panel=INPUT)]
Spacing = Annotated[tuple[float, float, float] | None, option(ImageOptions, "spacing", panel=INPUT, metavar="MM MM MM")]
CorrectShifts = Annotated[bool | None, option(ImageOptions, "correct_shifts", "--correct-shifts", panel=INPUT)]
FillPapillary = Annotated[bool | None, option(ImageOptions, "fill_papillary", "--fill-papillary", panel=INPUT)]
LongAxis = Annotated[
    list[str] | None,
    option(ImageOptions, "long_axis", panel=INPUT, default="none; repeatable", metavar="FILE[:...]"),
]
Contours = Annotated[
    list[str] | None,
    option(ImageOptions, "contours", panel=INPUT, default="none; repeatable", metavar="FILE[:...]"),
]
LeaveOut = Annotated[
    list[int] | None, option(ImageOptions, "leave_out", panel=INPUT, default="none; repeatable", metavar="N")
]
Frame = Annotated[int | None, option(ImageOptions, "frame", panel=INPUT, metavar="N")]
Mask = Annotated[
    list[str] | None,
    typer.Option(
        help="NAME=FILE, repeatable, in place of SEG: a file for each structure, all on one grid; every voxel that is "
        "not 0 counts.",
        rich_help_panel=INPUT,
    ),
]
Config = Annotated[
    Path | None, typer.Option(help="TOML file of options; the command line wins.", rich_help_panel=INPUT)
]
Method = Annotated[str | None, option(SurfaceOptions, "method", panel=SURFACES)]
Vertices = Annotated[int | None, option(SurfaceOptions, "vertices", panel=SURFACES)]
Singularities = Annotated[
    int | None, option(SurfaceOptions, "singularities", panel=SURFACES, default="from the object")
]
ControlPoints = Annotated[
    int | None, option(SurfaceOptions, "control_points", panel=SURFACES, default="from the object")
]
EndoAngle = Annotated[float | None, option(FibreOptions, "endo_angle", panel=FIBRES)]
EpiAngle = Annotated[float | None, option(FibreOptions, "epi_angle", panel=FIBRES)]
Mirrored = Annotated[str | None, option(FibreOptions, "mirrored", panel=FIBRES)]
Purpose = Annotated[str | None, option(CheckOptions, "purpose", panel=OUTPUT)]
Formats = Annotated[
    list[str] | None,
    typer.Option("--format", help=f"Further format, repeatable: {', '.join(FORMATS)}.", rich_help_panel=OUTPUT),
]
LengthUnit = Annotated[str | None, option(ExportOptions, "length_unit", panel=DECK)]
Step = Annotated[str | None, option(ExportOptions, "step", panel=DECK)]
Material = Annotated[str | None, option(ExportOptions, "material", panel=DECK)]
YoungModulus = Annotated[float | None, option(ExportOptions, "young_modulus", panel=DECK)]
PoissonRatio = Annotated[float | None, option(ExportOptions, "poisson_ratio", panel=DECK)]
FibreStiffness = Annotated[float | None, option(ExportOptions, "fibre_stiffness", panel=DECK)]
Pressure = Annotated[list[str] | None, option(ExportOptions, "pressure", panel=DECK, metavar="[CAVITY=]KPA")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.", rich_help_panel=OUTPUT)]


def require_step(given: Mapping[str, Any], written: bool, also: str = "") -> None:
    """Refuse options of a step where none is written; ``also`` are other options that would write one.

    Raises
    ------
    OptionError
    """
    for name in ("material", "young_modulus", "poisson_ratio", "fibre_stiffness", "pressure"):
        if given.get(name) is not None and not written:
            option = name.replace("_", "-")
            raise OptionError(f"--{option} is of the step, and none is written; add {also}--step inflation")
