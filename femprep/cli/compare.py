"""``femprep compare``: how far two surfaces lie apart, in space and in the slices of an image."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def compare(
    a: Annotated[Path, typer.Argument(help="Surface file: .vtp, .stl, .ply, .obj.")],
    b: Annotated[Path, typer.Argument(help="Surface file to compare with.")],
    slices: Annotated[
        Path | None, typer.Option(help="Image whose slice planes the in-slice distance is measured in.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the record as JSON.")] = False,
) -> None:
    """Distances between two surfaces, in space and in the slices of an image.

    Mean, rms, 95 % and greatest distance, in-slice distance, normals, volumes, triangle quality.
    """
    from femprep.image import read_segmentation
    from femprep.surface import compare_surfaces, grid_planes, read_surface

    # Only where the slices lie matters here, so any label will do.
    planes = grid_planes(read_segmentation(slices, structures={"any": 1}).grid) if slices is not None else None
    record = compare_surfaces(read_surface(a), read_surface(b), slices=planes)
    if json:
        typer.echo(record.model_dump_json(indent=2))
        return
    from femprep.cli._summary import print_comparison

    print_comparison(record)
