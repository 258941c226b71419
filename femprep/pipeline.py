"""The stages in order: a segmentation in, surfaces, wall, mesh and quality out. No computing, no paths."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Final

from femprep.anatomy import (
    VentricularAxes,
    flip,
    orient,
    ventricular_axes,
)
from femprep.anatomy.tissue.regions import own_tissue
from femprep.errors import FemprepError, require_kind
from femprep.image import IntensityImage, LabelObject, Segmentation, leave_out_slices
from femprep.image.papillary import fill_helps, fill_papillary
from femprep.image.size import require_heart_size
from femprep.image.unnamed import require_named
from femprep.model import Notice, Progress, VolumeMesh, Wall
from femprep.model.stages import Stages
from femprep.options import Options, choose, takes
from femprep.options.advice import SURFACES_ALONE, Fixed
from femprep.preflight import check_apart, check_labels, check_options, check_second_images
from femprep.report.beside import volumes_beside_labels, wall_difference
from femprep.report.run import Run, Surfaces
from femprep.stages.fill import fill
from femprep.stages.furnish import concluded, furnish
from femprep.surface import fit_surface
from femprep.surface.alignment import align_slices
from femprep.surface.fit import check_fit
from femprep.volume import check
from femprep.volume.quality.advice import Reached, surfaces_reached, what_helps, with_hints, with_shape_help
from femprep.volume.quality.fidelity import mesh_fidelity, surface_fidelity, with_fidelity
from femprep.volume.quality.limits import judge_wall_volume
from femprep.wall.anatomies import ANATOMIES, Layout, WallSurfaces, lay_out, structures_of
from femprep.wall.outlines import Outline
from femprep.wall.planes.misnamed import require_order

_log = logging.getLogger(__name__)
#: How far two bases move towards the apex where they give no wall, mm: surfaces round off beside their last slice.
_INWARD: Final = 2.0


@takes(Options)
def mesh_segmentation(
    seg: Segmentation,
    options: Options | None = None,
    progress: Progress | None = None,
    *,
    tissue: Segmentation | None = None,
    images: Mapping[str, IntensityImage] | None = None,
    **changes: object,
) -> Run:
    """Mesh the wall of a segmented heart, the whole way.

    Parameters
    ----------
    seg : Segmentation
        Label map with the structures ``lv`` (cavity) and ``myo`` (myocardium); for both ventricles also ``rv`` and,
        where it has one, ``rv_wall``.
    options : Options, optional
        All options; the defaults where not given.
    progress : callable, optional
        Called with ``(stage, fraction)``.
    tissue : Segmentation, optional
        A second image of labels, whose structures are scar, border zone, fat...: see :func:`femprep.add_regions`. Where
        not given, those structures of ``seg`` itself.
    images : mapping of str to IntensityImage, optional
        Images to sample, by the name of the field: see :func:`femprep.sample_image`.
    **changes
        Options by name in place of those given.

    Returns
    -------
    Run

    Raises
    ------
    InputError, OptionError, ResourceError
        The segmentation or an option is wrong.
    StageError
        A stage failed on valid input.

    Examples
    --------
    >>> run = fp.mesh_segmentation(seg, volume={"edge_length": 5.0})  # doctest: +SKIP
    >>> run.quality.passed  # doctest: +SKIP
    True
    """
    return mesh_map(seg, choose(Options, options, changes), progress, {}, tissue, images)


def mesh_map(
    seg: Segmentation,
    options: Options,
    progress: Progress | None,
    fixed: Fixed,
    tissue: Segmentation | None = None,
    images: Mapping[str, IntensityImage] | None = None,
) -> Run:
    """As :func:`mesh_segmentation`; nothing that the command fixes is advised."""
    require_kind(seg, Segmentation, "read_segmentation")
    _log.debug("options: %s", options)
    stages = Stages(progress)
    check_second_images(seg, options, tissue, images or {})
    given = seg
    seg, layout, axes = begin(given, options, stages, fixed)
    if tissue is None and options.anatomy != "whole-heart":
        tissue = own_tissue(seg)

    def reached(other: Options) -> float | None:
        if other.image == options.image:
            return 0.0
        try:
            return surfaces_reached(_prepared(given, other, Stages(None)), other)
        except FemprepError:
            return None

    with with_hints(seg, options, fixed, reached):
        fitted, wall, mesh = _filled(seg, layout, options, stages)
    filled = mesh
    mesh = furnish(mesh, lambda: axes or ventricular_axes(seg), options, stages, tissue, images)
    with stages("quality") as report:
        quality = check(mesh, options=options.check)
        report("quality", 0.6)
        volumes = volumes_beside_labels(filled, seg, fitted.objects, wall.planes)
        fidelity = mesh_fidelity(mesh, fitted.outlines, seg.grid, quality.options.maximum_label_distance)
        judged = judge_wall_volume(with_shape_help(quality, options, fixed), wall_difference(volumes))
        helps = what_helps(seg, fidelity, fitted, options, fixed, reached)
        helps += fill_helps(seg) if helps else []
        judged = with_fidelity(judged, fidelity, helps)
    mesh, judged, solved = concluded(mesh, quality, judged, options, stages)
    made = (fitted.objects, fitted.surfaces, wall, mesh, judged, fidelity, tuple(volumes), stages.seconds)
    return Run(seg, options, *made, **solved)


def _filled(
    seg: Segmentation, layout: Layout, options: Options, stages: Stages
) -> tuple[WallSurfaces, Wall, VolumeMesh]:
    """Surfaces, wall and mesh of a heart.

    Two bases that give none are moved 2 mm towards the apex; where that gives none either, one plane cuts both.
    """
    try:
        fitted = ANATOMIES[options.anatomy](seg, layout, options, stages)
        return fitted, *fill(fitted, options, stages)
    except FemprepError as error:
        if layout.right_base is None:
            raise
        why = error.args[0]
    offset = options.wall.base_offset + _INWARD
    inward = options.model_copy(update={"wall": options.wall.model_copy(update={"base_offset": offset})})
    with suppress(FemprepError):
        fitted = ANATOMIES[options.anatomy](seg, lay_out(seg, inward, stages), options, stages)
        words = f"both bases lie {{amount}} nearer to the apex, because there was no wall without that: {why}"
        notice = Notice.of("moved", words, amount=_INWARD, unit="mm")
        return fitted, *fill(replace(fitted, notices=[*fitted.notices, notice]), options, stages)
    fitted = ANATOMIES[options.anatomy](seg, lay_out(seg, options, stages, one_base=True), options, stages)
    notice = Notice.of("moved", f"one plane cuts both ventricles, because two bases gave no wall: {why}")
    return fitted, *fill(replace(fitted, notices=[*fitted.notices, notice]), options, stages)


Begun = tuple[Segmentation, Layout, VentricularAxes | None]


def begin(seg: Segmentation, options: Options, stages: Stages, fixed: Fixed | None = None) -> Begun:
    """All that labels and options tell, and every refusal that follows from it, before anything takes long.

    Advice that names a value is tried, as far as this.
    """

    require_heart_size(seg, structures_of(seg, options.anatomy).values())
    with with_hints(seg, options, fixed or {}, _passes(lambda other: _begin(seg, other, Stages(None)))):
        return _begin(seg, options, stages)


def _passes(attempt: Callable[[Options], object]) -> Reached:
    """Whether an attempt with other options succeeds, with no distance to tell."""

    def reached(options: Options) -> float | None:
        try:
            attempt(options)
        except FemprepError:
            return None
        return 0.0

    return reached


def _begin(seg: Segmentation, options: Options, stages: Stages) -> Begun:
    check_options(options)
    check_apart(seg.structures)
    require_order(seg)
    seg = _prepared(seg, options, stages)
    layout = lay_out(seg, options, stages)
    with stages("preflight"):
        return seg, layout, check_labels(seg, layout, options)


def _prepared(seg: Segmentation, options: Options, stages: Stages) -> Segmentation:
    """The segmentation with its heart's axes: flipped, slices left out or moved back if asked or with views."""
    seg = flip(seg) if options.flip else seg
    if options.image.leave_out:
        seg = leave_out_slices(seg, options.image.leave_out)
    if options.image.correct_shifts or seg.views:
        with stages("slice shifts"):
            seg = align_slices(seg)
    seg = require_named(fill_papillary(seg) if options.image.fill_papillary else seg)
    return orient(seg, basal_end=options.wall.basal_end)


def fit_surfaces(
    seg: Segmentation,
    objects: Mapping[str, tuple[str, ...]],
    options: Options | None = None,
    progress: Progress | None = None,
) -> Surfaces:
    """Fit a closed surface to each object of a segmentation.

    Parameters
    ----------
    seg : Segmentation
    objects : mapping of str to tuple of str
        Structures each object is the union of, by the object's name.
    options : Options, optional
    progress : callable, optional
        Called with ``(stage, fraction)``.

    Returns
    -------
    Surfaces

    Examples
    --------
    >>> options = fp.Options(surface={"vertices": 500})
    >>> list(fp.fit_surfaces(seg, {"lv": ("lv",)}, options).surfaces)
    ['lv']
    """
    options = options or Options()
    stages = Stages(progress)
    require_heart_size(seg, objects.values())

    def begun(other: Options, stages: Stages) -> tuple[Segmentation, dict[str, LabelObject]]:
        prepared = _prepared(seg, other, stages)
        with stages("objects"):
            made = {name: prepared.object(*parts, name=name, options=other.image) for name, parts in objects.items()}
            for obj in made.values():
                check_fit(obj, other.surface)
        return prepared, made

    surfaces = {}
    with with_hints(seg, options, SURFACES_ALONE, _passes(lambda other: begun(other, Stages(None)))):
        prepared, found = begun(options, stages)
        for name, obj in found.items():
            with stages(f"surface {name}") as report:
                fitted = fit_surface(obj, options=options.surface, progress=report)
                surfaces[name] = replace(fitted, name=name)
    fidelity = surface_fidelity(surfaces, [Outline(name, obj) for name, obj in found.items()], prepared.grid)
    return Surfaces(prepared, options, found, surfaces, fidelity, stages.seconds)
