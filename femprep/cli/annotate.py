"""``femprep annotate``: anyone's mesh to a folder with names, segments, fibres and decks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from femprep.cli import _arguments as shared
from femprep.cli._arguments import FIBRES, INPUT, OUTPUT
from femprep.cli._configuration import merged, parse_names, parse_places, parse_plane
from femprep.cli._fields import by_path, option
from femprep.cli._names import annotation_names, require_lasting, require_output
from femprep.options import AnnotateOptions, choose


def annotate(
    mesh: Annotated[
        Path, typer.Argument(help="Mesh file: every format femprep writes, and what meshio reads.", metavar="MESH")
    ],
    out: shared.Out,
    unit: shared.Unit = None,
    anatomy: Annotated[str | None, option(AnnotateOptions, "anatomy", panel=INPUT)] = None,
    name: Annotated[
        list[str] | None,
        typer.Option(
            help="THEIRS=OURS, repeatable: a number or name of the file's facets or regions, and what it is: endo_lv, "
            "epi, base, lv, septum...",
            rich_help_panel=INPUT,
        ),
    ] = None,
    at: Annotated[
        list[str] | None,
        typer.Option(
            help="NAME=X,Y,Z, repeatable: a point on or near the facets of that name, where two readings are possible.",
            rich_help_panel=INPUT,
        ),
    ] = None,
    base: Annotated[
        str | None,
        typer.Option(
            help="X,Y,Z,NX,NY,NZ: the base plane by a point and its normal out of the ventricle, where the mesh shows "
            "none.",
            rich_help_panel=INPUT,
        ),
    ] = None,
    config: shared.Config = None,
    fibres: Annotated[
        bool | None,
        typer.Option(
            "--fibres/--no-fibres", help="Coordinates, AHA segments and fibres, on by default.", rich_help_panel=FIBRES
        ),
    ] = None,
    endo_angle: shared.EndoAngle = None,
    epi_angle: shared.EpiAngle = None,
    mirrored: shared.Mirrored = None,
    purpose: shared.Purpose = None,
    format: shared.Formats = None,
    length_unit: shared.LengthUnit = None,
    quiet: shared.Quiet = False,
    json: Annotated[
        bool, typer.Option("--json", help="Print the run's record as JSON.", rich_help_panel=OUTPUT)
    ] = False,
) -> int:
    """Name the facets and regions of anyone's mesh of a heart; add coordinates, AHA segments and fibres; write decks.

    Facets are named by the file's own names, by --name, and by geometry. Where two readings are possible nothing is
    guessed: the message says which line of --config decides. The exit status is 1 where the mesh fails its check.
    """
    changes = by_path(annotate, locals()) | {
        "names": parse_names(name),
        "at": parse_places(at),
        "base": parse_plane(base),
        "formats": tuple(format) if format else None,
    }
    values = merged(config, **changes)
    if fibres is False:
        values["fibres"] = None
    options = choose(AnnotateOptions, None, values)

    require_output(out, options.formats, annotation_names)
    require_lasting(out, [mesh])

    from femprep.annotation import annotate as name_parts
    from femprep.cli._mesh_runs import typed
    from femprep.cli._progress import bars
    from femprep.export import read_mesh
    from femprep.report.annotated import write_annotation

    with bars(quiet or json) as progress:
        found = name_parts(read_mesh(mesh, unit=options.unit), options, progress)
        manifest = write_annotation(found, out, source=mesh, command=typed(), progress=progress)
    if json:
        typer.echo(manifest.model_dump_json(indent=2))
    elif not quiet:
        from femprep.cli._summary import print_annotation

        print_annotation(found, manifest, out)
    return 0 if found.quality.passed else 1
