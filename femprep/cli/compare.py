"""``femprep compare``: how far two surfaces lie apart, or every method of fitting one to a label map side by side."""

from __future__ import annotations

import json as json_text
from pathlib import Path
from typing import Annotated

import typer

from femprep.cli._configuration import parse_objects, parse_structures
from femprep.cli._fields import option
from femprep.options import Options

#: File names of surfaces; others are label maps.
SURFACES = (".vtp", ".stl", ".ply", ".obj", ".vtk")
LABELS = "A label map"


def compare(
    a: Annotated[
        Path,
        typer.Argument(help="Surface file: .vtp, .stl, .ply, .obj; or a label map, for every method side by side."),
    ],
    b: Annotated[
        Path | None, typer.Argument(help="Surface file to compare with; of a label map's object the true surface.")
    ] = None,
    slices: Annotated[
        Path | None, typer.Option(help="Image whose slice planes the in-slice distance is measured in.")
    ] = None,
    preset: Annotated[str | None, option(Options, "preset", panel=LABELS)] = None,
    structure: Annotated[
        list[str] | None, typer.Option(help="NAME=LABEL[,LABEL...], repeatable.", rich_help_panel=LABELS)
    ] = None,
    object: Annotated[
        str | None, typer.Option("--object", help="NAME=STRUCTURE[+STRUCTURE...]: what to fit.", rich_help_panel=LABELS)
    ] = None,
    vertices: Annotated[
        int | None,
        typer.Option(
            help="Number of vertices of femprep's own surfaces [dim]\\[default: 1252][/dim]", rich_help_panel=LABELS
        ),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print the record as JSON.")] = False,
) -> None:
    """Distances between two surfaces, in space and in the slices of an image; or every method on one label map.

    Of two surfaces: mean, rms, 95 % and greatest distance, in-slice distance, normals, volumes, triangle quality. Of a
    label map: marching cubes, smoothed and not, surface nets, slice-wise distances, these remeshed, the paper's method
    and femprep's own, with their distance to the true surface (where one is given) and to the labels' contours,
    normals, number and quality of triangles, and seconds.
    """
    from femprep.errors import OptionError
    from femprep.image import read_segmentation
    from femprep.surface import compare_surfaces, grid_planes, read_surface

    if not a.name.lower().endswith(SURFACES):
        if slices is not None:
            raise OptionError(f"--slices is for two surfaces; {a} is a label map, whose own slices count")
        _methods(a, b, preset, structure, object, vertices, json)
        return
    if b is None:
        raise OptionError(f"there is nothing to compare {a} with; give a second surface file")
    of_labels = {"preset": preset, "structure": structure, "object": object, "vertices": vertices}
    if idle := next((name for name, value in of_labels.items() if value is not None), None):
        raise OptionError(f"--{idle} is for a label map, and {a} is a surface; leave it out")
    # Only where the slices lie matters here, so any label will do.
    planes = grid_planes(read_segmentation(slices, structures={"any": 1}).grid) if slices is not None else None
    record = compare_surfaces(read_surface(a), read_surface(b), slices=planes)
    if json:
        typer.echo(record.model_dump_json(indent=2))
        return
    from femprep.cli._summary import print_comparison

    print_comparison(record)


def _methods(
    image: Path,
    truth: Path | None,
    preset: str | None,
    structure: list[str] | None,
    chosen: str | None,
    vertices: int | None,
    json: bool,
) -> None:
    """Every method on one object of a label map."""
    from femprep.cli._summary import print_methods
    from femprep.errors import OptionError
    from femprep.image import read_segmentation
    from femprep.surface import read_surface
    from femprep.surface.reference.side_by_side import VERTICES, all_methods, compare_methods

    seg = read_segmentation(image, structures=parse_structures(structure), preset=preset)
    objects = parse_objects([chosen] if chosen else None, dict(seg.structures))
    if len(objects) != 1:
        raise OptionError(f"{image} holds {', '.join(objects)}; name the one to fit by --object")
    name, parts = next(iter(objects.items()))
    found = compare_methods(
        seg.object(*parts, name=name),
        None if truth is None else read_surface(truth),
        all_methods(VERTICES if vertices is None else vertices),
    )
    if json:
        typer.echo(json_text.dumps([figures.model_dump() for figures in found], indent=2))
        return
    print_methods(name, found)
