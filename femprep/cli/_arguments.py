"""Arguments that both ``femprep mesh`` and ``femprep surface`` take, and the panels of the help they stand in."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

from femprep.cli._fields import option
from femprep.options import ImageOptions, Options, SurfaceOptions

INPUT: Final = "Input"
SURFACES: Final = "Surfaces"
OUTPUT: Final = "Output"

Out = Annotated[Path, typer.Option("--out", "-o", help="Folder to make.", rich_help_panel=OUTPUT)]
Preset = Annotated[str | None, option(Options, "preset", panel=INPUT)]
Policy = Annotated[str | None, option(ImageOptions, "policy", panel=INPUT)]
Spacing = Annotated[tuple[float, float, float] | None, option(ImageOptions, "spacing", panel=INPUT, metavar="MM MM MM")]
CorrectShifts = Annotated[bool | None, option(ImageOptions, "correct_shifts", "--correct-shifts", panel=INPUT)]
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
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.", rich_help_panel=OUTPUT)]
