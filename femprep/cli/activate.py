"""``femprep activate``: Purkinje fibres on a mesh, and the times at which a beat activates its points."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from femprep.cli import _arguments as shared
from femprep.cli._arguments import OUTPUT
from femprep.cli._configuration import parse_point
from femprep.cli._fields import given, option
from femprep.errors import OptionError
from femprep.options import ActivationOptions, PurkinjeOptions, choose

PURKINJE = "Purkinje fibres"
SPEEDS = "Activation"


def activate(
    mesh: Annotated[Path, typer.Argument(help="Mesh with fibres: every format femprep writes, and what meshio reads.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="File to write.", rich_help_panel=OUTPUT)],
    unit: shared.Unit = None,
    format: Annotated[
        str | None,
        typer.Option(
            "--format", help="Format of the new file, where its ending does not tell.", rich_help_panel=OUTPUT
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Picture of the map to draw, .png.", rich_help_panel=OUTPUT)
    ] = None,
    purkinje: Annotated[
        bool,
        typer.Option(
            "--purkinje/--no-purkinje",
            help="Grow Purkinje fibres. Else the beat begins at those the mesh has, or on the whole endocardium.",
            rich_help_panel=PURKINJE,
        ),
    ] = True,
    branch_length: Annotated[float | None, option(PurkinjeOptions, "branch_length", panel=PURKINJE)] = None,
    branch_angle: Annotated[float | None, option(PurkinjeOptions, "branch_angle", panel=PURKINJE)] = None,
    repulsion: Annotated[float | None, option(PurkinjeOptions, "repulsion", panel=PURKINJE)] = None,
    generations: Annotated[int | None, option(PurkinjeOptions, "generations", panel=PURKINJE)] = None,
    segment_length: Annotated[float | None, option(PurkinjeOptions, "segment_length", panel=PURKINJE)] = None,
    speed: Annotated[float | None, option(PurkinjeOptions, "speed", panel=PURKINJE)] = None,
    seed: Annotated[int | None, option(PurkinjeOptions, "seed", panel=PURKINJE)] = None,
    root_lv: Annotated[str | None, option(PurkinjeOptions, "root_lv", panel=PURKINJE, metavar="X,Y,Z")] = None,
    root_rv: Annotated[str | None, option(PurkinjeOptions, "root_rv", panel=PURKINJE, metavar="X,Y,Z")] = None,
    fibre_speed: Annotated[float | None, option(ActivationOptions, "fibre_speed", panel=SPEEDS)] = None,
    sheet_speed: Annotated[float | None, option(ActivationOptions, "sheet_speed", panel=SPEEDS)] = None,
    normal_speed: Annotated[float | None, option(ActivationOptions, "normal_speed", panel=SPEEDS)] = None,
    quiet: shared.Quiet = False,
) -> int:
    """Grow Purkinje fibres on the endocardia of a mesh with fibres, and map the times at which a beat activates it.

    The map shows within seconds whether fibres, nodes and stimuli fit. Beside OUT stands OUT's name with _purkinje.vtp,
    the fibres as lines. The exit status is 1 where points of the ventricles are never activated.
    """
    values = locals()
    tree = given(PurkinjeOptions, {**values, "root_lv": None, "root_rv": None})
    tree |= {name: parse_point(values[name], name) for name in ("root_lv", "root_rv") if values[name] is not None}
    if tree and not purkinje:
        first = next(iter(tree)).replace("_", "-")
        raise OptionError(
            f"--{first} shapes the Purkinje fibres, which --no-purkinje leaves out; leave one of them out"
        )
    grown = choose(PurkinjeOptions, None, tree)
    speeds = choose(ActivationOptions, None, given(ActivationOptions, values))
    from femprep.activation import add_activation, add_purkinje
    from femprep.activation.growth import require_growth
    from femprep.activation.times import require_fibres
    from femprep.export import read_mesh, write_mesh, write_purkinje
    from femprep.export.target import target_of
    from femprep.report.activation import draw
    from femprep.report.notices import lines

    if picture is not None and picture.suffix.lower() != ".png":
        raise OptionError(f"pictures are written as .png, not {picture.suffix or 'without an ending'!r}; name MAP.png")
    kind, _, stem = target_of(out, format)  # what is wrong with the name is told at once
    if purkinje:
        require_growth()
    found = read_mesh(mesh, unit=unit or "auto")
    require_fibres(found)
    read = found
    before = len(found.info.get("notices", ()))
    if purkinje:
        found = add_purkinje(found, grown)
    found = add_activation(found, speeds)
    paths = write_mesh(found, out, format=format)
    if found.purkinje is not None:
        paths.append(write_purkinje(found, out.with_name(f"{stem}_purkinje.vtp")))
    if picture is not None and (drawn := draw(found, picture)) is not None:
        paths.append(drawn)
    record = found.info["activation"]
    if not quiet:
        from femprep.cli._summary import print_left_out, print_losses

        print_left_out(read)
        print_losses(found, kind.name)
        if found.purkinje is not None:
            net = found.purkinje
            typer.echo(f"{net.lengths.sum():.0f} mm of Purkinje fibres with {len(net.junctions)} junctions")
        where = ", ".join(f"{x:.1f}" for x in record["last_at"])
        typer.echo(f"activated from {record['first_ms']:.1f} to {record['last_ms']:.1f} ms, last near {where} mm")
        for line in lines({"notices": found.info.get("notices", ())[before:]}, found.info["activation"]):
            typer.echo(f"note: {line}")
        for path in paths:
            typer.echo(path)
    return 1 if record["never_reached"] else 0
