"""``femprep convert``: a mesh in another format."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from femprep.cli import _arguments as shared
from femprep.cli._arguments import DECK, require_step
from femprep.cli._configuration import parse_pressure
from femprep.cli._fields import given, option
from femprep.options import ExportOptions, PericardiumOptions, choose


def convert(
    mesh: Annotated[Path, typer.Argument(help="Mesh to read: every format femprep writes, and what meshio reads.")],
    out: Annotated[Path, typer.Argument(help="File to write.")],
    unit: shared.Unit = None,
    format: Annotated[
        str | None, typer.Option("--format", help="Format of the new file, where its ending does not tell.")
    ] = None,
    length_unit: shared.LengthUnit = None,
    step: shared.Step = None,
    material: shared.Material = None,
    young_modulus: shared.YoungModulus = None,
    poisson_ratio: shared.PoissonRatio = None,
    fibre_stiffness: shared.FibreStiffness = None,
    pressure: shared.Pressure = None,
    pericardium: Annotated[
        float | None, option(PericardiumOptions, "stiffness", "--pericardium", panel=DECK, default="none")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Write a mesh in another format.

    Regions, facet tags and fibres go along where the format holds them; what it leaves out is told.
    """
    chosen = given(ExportOptions, {**locals(), "pressure": parse_pressure(pressure)})
    options = choose(ExportOptions, None, chosen)
    require_step(chosen, options.step != "none")
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
