"""``femprep convert``: a mesh in another format."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def convert(
    mesh: Annotated[Path, typer.Argument(help="Mesh file to read.")],
    out: Annotated[Path, typer.Argument(help="File to write.")],
    format: Annotated[
        str | None, typer.Option("--format", help="Format of the new file, where its ending does not tell.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Write a mesh in another format.

    Regions, facet tags and fibres go along where the format holds them.
    """
    from femprep.export import read_mesh, write_mesh

    paths = write_mesh(read_mesh(mesh), out, format=format)
    if not quiet:
        for path in paths:
            typer.echo(path)
