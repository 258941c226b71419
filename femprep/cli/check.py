"""``femprep check``: quality and validity of anyone's mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def check(
    mesh: Annotated[Path, typer.Argument(help="Mesh file: .vtu, .vtk, .inp, .msh, .xdmf, .med, .mesh ...")],
    json: Annotated[bool, typer.Option("--json", help="Print the quality record as JSON.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing; only the exit status tells.")] = False,
) -> int:
    """Judge a mesh: element quality, orientation, boundary, tags.

    The exit status is 1 where a limit is not met.
    """
    from femprep.export import read_mesh
    from femprep.volume import check as judge

    report = judge(read_mesh(mesh))
    if json:
        typer.echo(report.model_dump_json(indent=2))
    elif not quiet:
        from femprep.cli._summary import print_quality

        print_quality(report)
    return 0 if report.passed else 1
