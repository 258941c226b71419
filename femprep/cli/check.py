"""``femprep check``: quality and validity of anyone's mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from femprep.cli import _arguments as shared
from femprep.cli._apart import same_file
from femprep.cli._fields import given, option
from femprep.errors import OptionError
from femprep.options import CheckOptions, choose

LIMITS = "Limits"


def check(
    mesh: Annotated[Path, typer.Argument(help="Mesh file: .vtu, .vtk, .inp, .msh, .xdmf, .med, .mesh ...")],
    unit: shared.Unit = None,
    purpose: Annotated[str | None, option(CheckOptions, "purpose", panel=LIMITS)] = None,
    minimum_dihedral: Annotated[float | None, option(CheckOptions, "minimum_dihedral", panel=LIMITS)] = None,
    maximum_dihedral: Annotated[float | None, option(CheckOptions, "maximum_dihedral", panel=LIMITS)] = None,
    minimum_scaled_jacobian: Annotated[
        float | None, option(CheckOptions, "minimum_scaled_jacobian", panel=LIMITS)
    ] = None,
    minimum_mean_ratio: Annotated[float | None, option(CheckOptions, "minimum_mean_ratio", panel=LIMITS)] = None,
    mean_of_mean_ratio: Annotated[float | None, option(CheckOptions, "mean_of_mean_ratio", panel=LIMITS)] = None,
    minimum_time_step: Annotated[float | None, option(CheckOptions, "minimum_time_step", panel=LIMITS)] = None,
    wave_speed: Annotated[float | None, option(CheckOptions, "wave_speed", panel=LIMITS)] = None,
    space_constant: Annotated[float | None, option(CheckOptions, "space_constant", panel=LIMITS)] = None,
    worst: Annotated[int | None, option(CheckOptions, "worst", panel=LIMITS)] = None,
    html: Annotated[Path | None, typer.Option("--html", help="Write the report as a page as well.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the quality record as JSON.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing; only the exit status tells.")] = False,
) -> int:
    """Judge a mesh: element quality, orientation, boundary, tags.

    A mesh of femprep's is judged by the limits it was made with, which stand in its file. A purpose chooses others, and
    each may be given by hand. The exit status is 1 where one is not met.
    """
    options = choose(CheckOptions, None, given(CheckOptions, locals()))
    from femprep.export import read_mesh
    from femprep.volume import check as judge

    if html is not None and same_file(html, mesh):
        raise OptionError(f"--html {str(html)!r} is the mesh itself; choose another")
    found = read_mesh(mesh, unit=unit or "auto")
    report = judge(found, options=options)
    if html is not None:
        from femprep.report.page.quality import write_quality_page

        write_quality_page(report, html, title=mesh.name)
    if json:
        typer.echo(report.model_dump_json(indent=2))
    elif not quiet:
        from femprep.cli._summary import print_left_out, print_quality

        print_left_out(found)
        print_quality(report, worst=3 if worst is None else worst)
    return 0 if report.passed else 1
