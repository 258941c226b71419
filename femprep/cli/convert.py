"""``femprep convert``: a mesh in another format."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from femprep.cli import _arguments as shared
from femprep.cli._fields import given, option
from femprep.errors import OptionError
from femprep.options import ExportOptions, PericardiumOptions, choose

DECK = "Deck"


def convert(
    mesh: Annotated[Path, typer.Argument(help="Mesh to read: every format femprep writes, and what meshio reads.")],
    out: Annotated[Path, typer.Argument(help="File to write.")],
    unit: shared.Unit = None,
    format: Annotated[
        str | None, typer.Option("--format", help="Format of the new file, where its ending does not tell.")
    ] = None,
    length_unit: Annotated[str | None, option(ExportOptions, "length_unit", panel=DECK)] = None,
    step: Annotated[str | None, option(ExportOptions, "step", panel=DECK)] = None,
    material: Annotated[str | None, option(ExportOptions, "material", panel=DECK)] = None,
    young_modulus: Annotated[float | None, option(ExportOptions, "young_modulus", panel=DECK)] = None,
    poisson_ratio: Annotated[float | None, option(ExportOptions, "poisson_ratio", panel=DECK)] = None,
    fibre_stiffness: Annotated[float | None, option(ExportOptions, "fibre_stiffness", panel=DECK)] = None,
    pressure: Annotated[float | None, option(ExportOptions, "pressure", panel=DECK)] = None,
    pericardium: Annotated[
        float | None, option(PericardiumOptions, "stiffness", "--pericardium", panel=DECK, default="none")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Write a mesh in another format.

    Regions, facet tags and fibres go along where the format holds them; what it leaves out is told.
    """
    chosen = given(ExportOptions, locals())
    options = choose(ExportOptions, None, chosen)
    idle = [name.replace("_", "-") for name in chosen if name not in ("length_unit", "step")]
    if idle and options.step == "none":
        raise OptionError(f"--{idle[0]} is of the step, and none is written; add --step inflation")
    from femprep.export import read_mesh, write_mesh
    from femprep.export.target import target_of

    kind = target_of(out, format).format  # what is wrong with the name is told at once
    found = read_mesh(mesh, unit=unit or "auto")
    if pericardium is not None:
        from femprep.anatomy import add_pericardium

        found = add_pericardium(found, stiffness=pericardium)
    paths = write_mesh(found, out, format=format, options=options)
    if not quiet:
        from femprep.cli._summary import print_left_out, print_losses

        print_left_out(found)
        print_losses(found, kind.name)
        for path in paths:
            typer.echo(path)
