"""``femprep surface``: closed template surfaces alone."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from femprep.cli import _arguments as shared
from femprep.cli._arguments import INPUT, OUTPUT, SURFACES
from femprep.cli._configuration import parse_objects, parse_structures, read_options
from femprep.cli._fields import by_path, option
from femprep.errors import OptionError
from femprep.options import SurfaceOptions


def surface(
    out: shared.Out,
    segmentation: Annotated[
        Path | None, typer.Argument(metavar="SEG", help="Label map: .nii, .nii.gz, .nrrd, .mha or .mhd.")
    ] = None,
    preset: shared.Preset = None,
    structure: Annotated[
        list[str] | None, typer.Option(help="NAME=LABEL[,LABEL...], repeatable.", rich_help_panel=INPUT)
    ] = None,
    object: Annotated[
        list[str] | None,
        typer.Option(
            "--object",
            help="NAME=STRUCTURE[+STRUCTURE...], repeatable: what to fit a surface to. [dim]\\[default: each structure "
            "that is no wall, and epi=lv+myo where both are there][/dim]",
            rich_help_panel=SURFACES,
        ),
    ] = None,
    frame: shared.Frame = None,
    policy: shared.Policy = None,
    spacing: shared.Spacing = None,
    leave_out: shared.LeaveOut = None,
    correct_shifts: shared.CorrectShifts = None,
    long_axis: shared.LongAxis = None,
    contours: shared.Contours = None,
    fill_papillary: shared.FillPapillary = None,
    config: shared.Config = None,
    vertices: shared.Vertices = None,
    cells: Annotated[str | None, option(SurfaceOptions, "cells", panel=SURFACES)] = None,
    method: shared.Method = None,
    connectivity: Annotated[str | None, option(SurfaceOptions, "connectivity", panel=SURFACES)] = None,
    curvature_sizing: Annotated[float | None, option(SurfaceOptions, "curvature_sizing", panel=SURFACES)] = None,
    singularities: shared.Singularities = None,
    control_points: shared.ControlPoints = None,
    quiet: shared.Quiet = False,
    json: Annotated[bool, typer.Option("--json", help="Print the run record as JSON.", rich_help_panel=OUTPUT)] = False,
) -> int:
    """Fit closed, smooth surfaces of a chosen number of vertices.

    Makes the folder OUT: surfaces/NAME.vtp, one for each object, run.json, and methods.md with methods.bib. The exit
    status is 1 where a surface lies farther from its labels than the limits say.
    """
    changes = by_path(surface, locals())
    options = read_options(config, structures=parse_structures(structure), **changes)
    from femprep.cli._mesh_runs import read_contours_alone, typed
    from femprep.cli._names import surface_names
    from femprep.cli._progress import bars
    from femprep.report.folder.output_folder import require_writable

    drawn = None
    if segmentation is None:
        if not contours or options.labels:
            raise OptionError("give either a label map, or --contours FILE without --structure and --preset")
        segmentation, drawn = read_contours_alone(options)
    objects = parse_objects(object, options.labels if drawn is None else drawn.structures)
    require_writable(out, surface_names(objects))

    from femprep.image import read_segmentation
    from femprep.pipeline import fit_surfaces
    from femprep.report.output import write_surfaces

    with bars(quiet or json) as progress:
        seg = drawn or read_segmentation(segmentation, options.structures, options.preset, options.image)
        fitted = fit_surfaces(seg, objects, options, progress)
        manifest = write_surfaces(fitted, out, source=segmentation, command=typed())
    if json:
        typer.echo(manifest.model_dump_json(indent=2))
    elif not quiet:
        from femprep.cli._summary import print_surfaces

        print_surfaces(fitted, manifest, out)
    return 1 if fitted.failures else 0
