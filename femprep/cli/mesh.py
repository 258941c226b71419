"""``femprep mesh``: the main job, from a label map to a folder with mesh, decks and figures."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from femprep.cli import _arguments as shared
from femprep.cli._arguments import DECK, FIBRES, INPUT, OUTPUT, require_step
from femprep.cli._configuration import (
    parse_masks,
    parse_plane,
    parse_pressure,
    parse_samples,
    parse_structures,
    parse_surfaces,
    parse_valves,
    read_options,
    split_tissues,
)
from femprep.cli._fields import by_path, option, takes_options_of
from femprep.cli._mesh_runs import mesh_file, mesh_own, mesh_phases
from femprep.cli._names import require_lasting
from femprep.errors import OptionError
from femprep.model.image_file import image_file, piece_of
from femprep.options import (
    Options,
    PericardiumOptions,
    SweepOptions,
    VolumeOptions,
    WallOptions,
)
from femprep.options.advice import SEQUENCE, TEMPLATE, advice_within

WALL, VOLUME, IMAGES = "Wall", "Volume mesh", "Further images"


def mesh_options(
    *,
    frame: shared.Frame = None,
    anatomy: Annotated[str | None, option(Options, "anatomy", panel=INPUT)] = None,
    preset: shared.Preset = None,
    unit: Annotated[str | None, option(Options, "unit", panel=INPUT)] = None,
    structure: Annotated[
        list[str] | None,
        typer.Option(
            help="NAME=LABEL[,LABEL...], repeatable: lv is the cavity, myo the wall; rv, rv_wall.",
            rich_help_panel=INPUT,
        ),
    ] = None,
    policy: shared.Policy = None,
    spacing: shared.Spacing = None,
    leave_out: shared.LeaveOut = None,
    correct_shifts: shared.CorrectShifts = None,
    long_axis: shared.LongAxis = None,
    contours: shared.Contours = None,
    fill_papillary: shared.FillPapillary = None,
    flip: Annotated[bool | None, option(Options, "flip", "--flip", panel=INPUT)] = None,
    sequence: Annotated[
        bool,
        typer.Option(
            "--sequence",
            help="The label maps, or the frames of one, are phases of one heart: sweep them with one connectivity, and "
            "write their displacements from the first as one time series.",
            rich_help_panel=INPUT,
        ),
    ] = False,
    template: Annotated[
        Path | None,
        typer.Option(
            help="mesh.vtu swept before: its element, columns, rows and layers, so that nodes correspond to its.",
            rich_help_panel=VOLUME,
        ),
    ] = None,
    config: shared.Config = None,
    method: shared.Method = None,
    vertices: shared.Vertices = None,
    singularities: shared.Singularities = None,
    control_points: shared.ControlPoints = None,
    apex: Annotated[str | None, option(WallOptions, "apex", panel=WALL)] = None,
    basal_end: Annotated[str | None, option(WallOptions, "basal_end", panel=WALL)] = None,
    base: Annotated[
        str | None,
        typer.Option(
            help="X,Y,Z,NX,NY,NZ: the base plane by a point and its normal away from the apex, mm LPS, in place of the "
            "one that the labels show; or annulus: the plane through the mitral annulus that long-axis views show.",
            rich_help_panel=WALL,
        ),
    ] = None,
    repair: Annotated[bool | None, option(WallOptions, "repair", "--repair", panel=WALL)] = None,
    base_offset: Annotated[float | None, option(WallOptions, "base_offset", panel=WALL)] = None,
    minimum_thickness: Annotated[float | None, option(WallOptions, "minimum_thickness", panel=WALL)] = None,
    rv_wall_thickness: Annotated[float | None, option(WallOptions, "rv_wall_thickness", panel=WALL)] = None,
    atrial_wall_thickness: Annotated[float | None, option(WallOptions, "atrial_wall_thickness", panel=WALL)] = None,
    openings: Annotated[str | None, option(WallOptions, "openings", panel=WALL)] = None,
    valve: Annotated[
        list[str] | None,
        typer.Option(
            help="NAME=X,Y,Z,NX,NY,NZ,R, repeatable: a further opening of the whole heart, by centre, normal out of "
            "its chamber, and radius; mm, LPS. Names: mitral, tricuspid, aortic, pulmonary, veins_la, veins_ra.",
            rich_help_panel=WALL,
        ),
    ] = None,
    mesher: Annotated[str | None, option(VolumeOptions, "mesher", panel=VOLUME)] = None,
    quality: Annotated[str | None, option(VolumeOptions, "quality", panel=VOLUME)] = None,
    edge_length: Annotated[float | None, option(VolumeOptions, "edge_length", panel=VOLUME)] = None,
    refinement: Annotated[str | None, option(VolumeOptions, "refinement", panel=VOLUME)] = None,
    elements_through_wall: Annotated[
        int | None, option(VolumeOptions, "elements_through_wall", panel=VOLUME, default="from the edge length")
    ] = None,
    sizing: Annotated[str | None, option(VolumeOptions, "sizing", panel=VOLUME)] = None,
    element: Annotated[str | None, option(SweepOptions, "element", panel=VOLUME)] = None,
    layers: Annotated[int | None, option(SweepOptions, "layers", panel=VOLUME, default="from the edge length")] = None,
    blood_pool: Annotated[
        bool, typer.Option("--blood-pool", help="Mesh the blood in the cavities as well.", rich_help_panel=VOLUME)
    ] = False,
    conforming: Annotated[
        bool,
        typer.Option(
            "--conforming", help="Cut elements along the outlines of the tissue of --regions.", rich_help_panel=IMAGES
        ),
    ] = False,
    order: Annotated[str | None, option(VolumeOptions, "order", panel=VOLUME)] = None,
    time_limit: Annotated[float | None, option(VolumeOptions, "time_limit", panel=VOLUME)] = None,
    fibres: Annotated[
        bool,
        typer.Option("--fibres", help="Add ventricular coordinates, AHA segments and fibres.", rich_help_panel=FIBRES),
    ] = False,
    endo_angle: shared.EndoAngle = None,
    epi_angle: shared.EpiAngle = None,
    pericardium: Annotated[
        float | None, option(PericardiumOptions, "stiffness", "--pericardium", panel=FIBRES, default="none")
    ] = None,
    purkinje: Annotated[
        bool,
        typer.Option("--purkinje", help="Grow Purkinje fibres on the endocardia.", rich_help_panel=FIBRES),
    ] = False,
    activation: Annotated[
        bool,
        typer.Option(
            "--activation",
            help="Times of activation, from the Purkinje fibres or the endocardia; needs --fibres.",
            rich_help_panel=FIBRES,
        ),
    ] = False,
    mirrored: shared.Mirrored = None,
    purpose: shared.Purpose = None,
    format: shared.Formats = None,
    length_unit: shared.LengthUnit = None,
    step: shared.Step = None,
    solve: Annotated[str | None, option(Options, "solve", panel=DECK)] = None,
    material: shared.Material = None,
    young_modulus: shared.YoungModulus = None,
    poisson_ratio: shared.PoissonRatio = None,
    fibre_stiffness: shared.FibreStiffness = None,
    pressure: shared.Pressure = None,
) -> Options:
    """Options of a run from those of the command line, a file, and a template; all commands that mesh take them."""
    same = _read_template(template)
    fixed = SEQUENCE if sequence else TEMPLATE if same else {}
    if fixed:
        if mesher not in (None, "sweep"):
            advice = ["leave it out", *fixed.values()]
            raise OptionError(f"--mesher {mesher} keeps no connectivity, unlike the sweep", advice=advice)
        mesher = "sweep"
    changes = by_path(mesh_options, locals())
    changes |= {
        "structures": parse_structures(structure),
        "formats": tuple(format) if format else None,
        "blood_pool": blood_pool or None,
        "conforming": conforming or None,
        "wall__policy": policy,
        "export__pressure": parse_pressure(pressure),
        "wall__base": parse_plane(base, "annulus"),
        "wall__valves": parse_valves(valve),
        "volume__order": int(order) if order in ("1", "2") else order,
        **{
            name: {}
            for name, asked in {"fibres": fibres, "purkinje": purkinje, "activation": activation}.items()
            if asked
        },
        **{f"sweep__{name}": value for name, value in same.items()},
    }
    with advice_within(None, fixed):
        options = read_options(config, **changes)
        require_step(locals(), options.export.step != "none" or options.solve != "none", "--solve ccx or ")
    return options


def _read_template(path: Path | None) -> dict[str, Any]:
    """Options of the sweep that give the connectivity of a mesh made before; none without one."""
    if path is None:
        return {}
    from femprep.export import read_mesh
    from femprep.sweeping import template_of

    return dict(template_of(read_mesh(path)))


@takes_options_of(mesh_options)
def mesh(
    out: shared.Out,
    segmentation: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="SEG",
            help="Label map: .nii, .nii.gz, .nrrd, .seg.nrrd, .mha, .mhd or DICOM SEG; several: see --sequence.",
        ),
    ] = None,
    mask: shared.Mask = None,
    surface: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[NAME=]FILE[#PIECE]",
            help="Repeatable, in place of SEG: external surfaces, .stl, .ply, .obj, .off, .vtp, .vtu, .vtm, .vtk or "
            ".elem; lv (rv, la, ra) is an endocardium, epi the epicardium around all. Without names the pieces of the "
            "files are named by their position; FILE#2 is the second largest piece.",
            rich_help_panel=INPUT,
        ),
    ] = None,
    regions: Annotated[
        Path | None,
        typer.Option(
            help="Label map of scar, border zone, fat..., of any grid and pose; behind it NAME=LABEL[,LABEL...]: scar, "
            "border, fat, edema, hypoperfused, no_reflow, and healthy for the rest of the wall.",
            rich_help_panel=IMAGES,
        ),
    ] = None,
    sample: Annotated[
        list[str] | None,
        typer.Option(
            help="[NAME=]FILE, repeatable: image of intensities whose value every element and point gets, in a field "
            "of that name, or of the file's.",
            rich_help_panel=IMAGES,
        ),
    ] = None,
    image: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FILE[:FRAME]",
            help="The image that the labels were drawn on, of any grid: report.html shows it under the outlines; of "
            "several frames that one, from 1. Of --sequence one for each phase, in their order.",
            rich_help_panel=IMAGES,
        ),
    ] = None,
    quiet: shared.Quiet = False,
    json: Annotated[
        bool, typer.Option("--json", help="Print run and quality records as JSON.", rich_help_panel=OUTPUT)
    ] = False,
    **given: Any,
) -> int:
    """Mesh the myocardial wall of a segmented image, or between your own surfaces (--surface).

    Makes the folder OUT: surfaces/*.vtp, wall.vtp, mesh.vtu, facets.vtp, one deck per --format, quality.json,
    run.json, report.html, methods.md and methods.bib. A run that fails writes nothing and leaves an earlier OUT as it
    was; one that succeeds replaces the files of the earlier run and leaves yours.
    """
    maps, tissues = split_tissues(segmentation or ())
    if bool(tissues) != bool(regions):
        raise OptionError(
            "--regions takes a label map and its tissues: --regions lge.nii.gz scar=1 border=2"
            if regions
            else f"{next(iter(tissues))}=... names tissue: --regions FILE gives its image, --structure its label in SEG"
        )
    if given["sequence"] and (regions or sample):
        raise OptionError("--regions and --sample belong to one heart; leave --sequence out, then femprep transfer")
    images = parse_samples(sample)
    shown = [image_file(item) for item in image or ()]
    masks = parse_masks(mask)
    second = (regions, tissues, images)
    surfaces = parse_surfaces(surface)
    require_lasting(out, [*(piece_of(path)[0] for path in surfaces.values()), *filter(None, [given["template"]])])
    if surfaces:
        if maps or masks:
            raise OptionError("give either surfaces or a label map or masks, not both")
        if shown:
            raise OptionError("--image lies under the slices of a label map; surfaces have none, leave it out")
        if given["sequence"] or given["structure"] or given["preset"]:
            raise OptionError("surfaces name themselves; leave --sequence, --structure and --preset out")
        return mesh_own(surfaces, out, mesh_options(**given), quiet=quiet, json=json, second=second)
    alone = bool(given["contours"]) and not maps and not masks
    if (maps and masks) or not (maps or masks or alone):
        raise OptionError("give either a label map, masks (--mask lv=FILE --mask myo=FILE) or --contours FILE")
    if given["contours"] and masks:
        raise OptionError("--contours stand alone or beside a label map; leave the masks out")
    if alone and (given["structure"] or given["preset"] or given["long_axis"]):
        raise OptionError("contours name themselves; leave --structure, --preset and --long-axis out")
    if masks and (given["sequence"] or given["structure"] or given["preset"]):
        raise OptionError("masks name their structures themselves; leave --sequence, --structure and --preset out")
    if len(maps) > 1 and not given["sequence"]:
        raise OptionError(f"{len(maps)} label maps given; add --sequence where they are phases of one heart")
    if given["sequence"] and shown and (len(maps) == 1 or alone):
        raise OptionError("--image is one for each phase; give the phases as files of their own, or leave it out")
    if given["sequence"] and given["frame"] and len(maps) == 1:
        raise OptionError("--sequence takes all frames of a map and --frame one of them; leave one of the two out")
    if shown and len(shown) != max(len(maps), 1):
        wanted = f"one for each of the {len(maps)} phases" if given["sequence"] else "one"
        raise OptionError(f"--image is given {len(shown)} times; {wanted} is needed, or none")
    options = mesh_options(**given)
    if given["sequence"]:
        return mesh_phases(maps, out, options, quiet=quiet, json=json, images=shown)
    first = shown[0] if shown else None
    return mesh_file(
        maps[0] if maps else masks or None, out, options, quiet=quiet, json=json, second=second, image=first
    )
