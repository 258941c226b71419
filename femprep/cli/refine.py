"""``femprep refine``: every element of a mesh cut into eight, as often as asked."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from femprep.cli import _arguments as shared


def refine(
    mesh: Annotated[Path, typer.Argument(help="Mesh to read: every format femprep writes, and what meshio reads.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="File to write.")],
    unit: shared.Unit = None,
    levels: Annotated[int, typer.Option(help="How often: each level halves the edges of all elements.")] = 1,
    format: Annotated[
        str | None, typer.Option("--format", help="Format of the new file, where its ending does not tell.")
    ] = None,
    optimise: Annotated[
        bool, typer.Option("--optimise/--no-optimise", help="Move nodes of poor tetrahedra, those of surfaces on them.")
    ] = True,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Cut every element of a mesh into eight, nested, with new nodes on smooth surfaces.

    New nodes of endocardium and epicardium lie on smooth surfaces through the nodes that are there, those of flat
    facets in their plane. Regions, facets and names are kept; point data are interpolated, and the cell data parent
    tell the element that each is a part of.
    """
    from femprep.cli._progress import bars
    from femprep.cli._summary import print_left_out, print_losses
    from femprep.export import read_mesh, write_mesh
    from femprep.export.target import target_of
    from femprep.report.notices import lines
    from femprep.volume.refine import refine as cut

    kind = target_of(out, format).format  # what is wrong with the name is told at once
    coarse = read_mesh(mesh, unit=unit or "auto")
    with bars(quiet) as progress:
        fine = cut(coarse, levels, optimised=optimise, progress=progress)
    paths = write_mesh(fine, out, format=format)
    if quiet:
        return
    print_left_out(coarse)
    typer.echo(f"{coarse.n_cells} elements -> {fine.n_cells}")
    for line in lines({"notices": fine.info.get("notices", ())[len(coarse.info.get("notices", ())) :]}):
        typer.echo(f"note: {line}")
    print_losses(fine, kind.name)
    for path in paths:
        typer.echo(path)
