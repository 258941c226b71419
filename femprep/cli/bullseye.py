"""``femprep bullseye``: a field of a mesh as the AHA's polar map."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from femprep.cli import _arguments as shared


def bullseye(
    mesh: Annotated[Path, typer.Argument(help="Mesh file with AHA segments: mesh.vtu of a run with --fibres.")],
    out: Annotated[Path, typer.Argument(help="Picture to write, .svg.")],
    unit: shared.Unit = None,
    field: Annotated[
        str,
        typer.Option(help="thickness, a quality measure (mean_ratio, minimum_dihedral ...) or scalar cell data."),
    ] = "thickness",
    statistic: Annotated[
        Literal["mean", "least", "largest"], typer.Option(help="What is taken of the elements of a segment.")
    ] = "mean",
    label: Annotated[str | None, typer.Option(help="Title; the field and the statistic if not given.")] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Draw a field of a mesh as a bull's eye of the 17 AHA segments.

    One number in each segment of the left ventricle: the base lies outside, the anterior wall at the top, the septum on
    the left.
    """
    from femprep.cli._summary import print_left_out
    from femprep.errors import OptionError
    from femprep.export import read_mesh
    from femprep.report.page.shared import write_page
    from femprep.report.pictures.bullseyes import draw

    if out.suffix.lower() != ".svg":
        raise OptionError(f"bull's eyes are written as .svg, not {out.suffix or 'without an ending'!r}; name OUT.svg")
    found = read_mesh(mesh, unit=unit or "auto")
    picture = draw(found, field, statistic=statistic, label=label)
    write_page(out, picture + "\n", "choose another name")
    if not quiet:
        print_left_out(found)
        typer.echo(out)
