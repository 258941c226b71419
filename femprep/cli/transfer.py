"""``femprep transfer``: fields of one mesh on another one, by ventricular coordinates."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from femprep.cli import _arguments as shared
from femprep.cli._apart import same_file
from femprep.errors import OptionError


def transfer(
    source: Annotated[Path, typer.Argument(metavar="FROM", help="Mesh with the fields and ventricular coordinates.")],
    target: Annotated[Path, typer.Argument(metavar="TO", help="Mesh to bring them to, with ventricular coordinates.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="File to write: TO with the fields.")],
    field: Annotated[
        list[str],
        typer.Option(help="Name of a field of FROM's elements or points, repeatable; region for its regions."),
    ],
    unit: shared.Unit = None,
    format: Annotated[
        str | None, typer.Option("--format", help="Format of the new file, where its ending does not tell.")
    ] = None,
    there_and_back: Annotated[
        bool,
        typer.Option("--there-and-back/--one-way", help="Carry the fields back too, to measure what comes back."),
    ] = True,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")] = False,
) -> None:
    """Bring fields from one heart, phase, mesh or level to another by their ventricular coordinates.

    Numbers are interpolated, tags taken over, directions turned with the wall. Both meshes need the coordinates that
    femprep mesh --fibres and femprep annotate add, and the same anatomy. What the fields lose there and back is
    printed, and kept beside OUT in a file .transfer.json.
    """
    from femprep.anatomy import transfer as bring
    from femprep.export import read_mesh, write_mesh
    from femprep.export.target import target_of
    from femprep.model.shared_records.transfer import TransferRecord
    from femprep.report.manifest import file_sha256
    from femprep.report.notices import lines
    from femprep.report.page.shared import write_page

    place = target_of(out, format)  # what is wrong with the name is told at once
    if any(same_file(source, one) for one in (place.file, place.folder)) and not same_file(source, target):
        raise OptionError(f"--out {str(out)!r} is the mesh that the fields come from; choose another")
    one, other = (read_mesh(path, unit=unit or "auto") for path in (source, target))
    moved = bring(one, other, field, there_and_back=there_and_back)
    record = TransferRecord(**moved.info["transfer"]).model_copy(
        update={"source": source.name, "target": target.name}
        | {
            name: file_sha256(path)
            for name, path in (("source_sha256", source), ("target_sha256", target))
            if path.is_file()
        }
    )
    paths = write_mesh(moved, out, format=format)
    told = out.with_name(f"{place.stem}.transfer.json")
    write_page(told, record.model_dump_json(indent=2) + "\n", "choose another name")
    if quiet:
        return
    from femprep.cli._summary import print_left_out, print_losses, print_transfer

    print_left_out(one)
    print_left_out(other)
    print_transfer(record)
    for line in lines({"notices": moved.info.get("notices", ())[len(other.info.get("notices", ())) :]}):
        typer.echo(f"note: {line}")
    print_losses(moved, place.format.name)
    for path in (*paths, told):
        typer.echo(path)
