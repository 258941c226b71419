"""The stages in order: a segmentation in, surfaces, wall, mesh and quality out. No computing, no paths."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

from femprep.activation import add_activation, add_purkinje
from femprep.anatomy import (
    VentricularAxes,
    WallFields,
    add_aha,
    add_coordinates,
    add_fibres,
    add_pericardium,
    add_regions,
    flip,
    on_wall,
    orient,
    sample_image,
    ventricular_axes,
)
from femprep.errors import FemprepError, StageError
from femprep.export.abaqus.calculix import inflate
from femprep.export.content import content_of, refusals
from femprep.image import IntensityImage, Segmentation, align_slices
from femprep.image.size import require_heart_size
from femprep.model import Notice, Progress, VolumeMesh, Wall, noted, verdict_of, with_verdict
from femprep.model.stages import Stages
from femprep.options import Options, choose, takes
from femprep.preflight import check_labels, check_options, check_second_images
from femprep.report.beside_labels import volumes_beside_labels, wall_difference
from femprep.report.run import Run, Surfaces
from femprep.surface import fit_surface
from femprep.surface.fit import check_fit
from femprep.sweeping import boundary_wall, sweep
from femprep.sweeping.matching.match import match_surfaces
from femprep.volume import check, tetrahedralize
from femprep.volume.quality.advice import advised, what_helps
from femprep.volume.quality.fidelity import mesh_fidelity, surface_fidelity, with_fidelity
from femprep.volume.quality.judged import carry
from femprep.volume.quality.limits import judge_solution, judge_wall_volume
from femprep.volume.ventricles import label_chambers, label_ventricles
from femprep.wall import build_wall, fill_cavities, open_wall
from femprep.wall.anatomies import ANATOMIES, Layout, Parts, lay_out, structures_of
from femprep.wall.joining.build import apex_info

_log = logging.getLogger(__name__)


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
        A second image of labels, whose structures are scar, border zone, fat...: see :func:`femprep.add_regions`.
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
    options = choose(Options, options, changes)
    _log.debug("options: %s", options)
    stages = Stages(progress)
    check_second_images(seg, options, tissue, images or {})
    seg, layout, axes = begin(seg, options, stages)
    with advised(seg, options):
        parts = ANATOMIES[options.anatomy](seg, layout, options, stages)
        wall, mesh = fill(parts, options, stages)
    if axes is not None:
        with stages("anatomy") as report:
            mesh = with_anatomy(mesh, axes, options, report)
    plain = mesh
    if options.purkinje is not None or options.activation is not None:
        with stages("activation"):
            mesh = with_activation(mesh, axes, options)
    if tissue is not None or images:
        with stages("second images"):
            mesh = with_images(mesh, axes or ventricular_axes(seg), tissue, images or {})
    with stages("quality") as report:
        quality = check(mesh, options=options.check)
        report("quality", 0.6)
        volumes = volumes_beside_labels(plain, parts.objects, wall.planes)
        fidelity = mesh_fidelity(mesh, parts.outlines, seg.grid, quality.options.maximum_label_distance)
        judged = judge_wall_volume(quality, wall_difference(volumes))
        judged = with_fidelity(judged, fidelity, what_helps(seg, fidelity, parts, options))
        mesher = str(verdict_of(mesh).get("mesher", options.volume.mesher))
        mesh = carry(mesh, quality.options, mesher, judged.failures[len(quality.failures) :])
    solution = None
    if options.solve == "ccx":
        with stages("solve"):
            solution = inflate(mesh, options.export)
            judged = judge_solution(judged, solution)
    made = (parts.objects, parts.surfaces, wall, mesh, judged, fidelity, tuple(volumes), stages.seconds, solution)
    return Run(seg, options, *made)


def begin(seg: Segmentation, options: Options, stages: Stages) -> tuple[Segmentation, Layout, VentricularAxes | None]:
    """All that labels and options tell, and every refusal that follows from it, before anything takes long."""
    check_options(options)
    require_heart_size(seg, structures_of(seg, options.anatomy).values())
    seg = _prepared(flip(seg) if options.flip else seg, options, stages)
    layout = lay_out(seg, options, stages)
    with stages("preflight"):
        return seg, layout, check_labels(seg, layout, options)


def with_anatomy(mesh: VolumeMesh, axes: VentricularAxes, options: Options, report: Progress) -> VolumeMesh:
    """The mesh with coordinates, segments and fibres; where they fail, without, and with what failed in its verdict.

    The mesh is good for much without them, and took most of the time.
    """
    try:
        return on_wall(mesh, partial(_with_fibres, axes=axes, options=options, report=report))
    except FemprepError as error:
        failures = {"fibres": [f"fibres: not made: {error}"]}
        for name, reason in refusals(content_of(mesh), options.formats, options.export).items():
            failures[name] = [f"{name}: not written: {reason}"]
        return with_verdict(mesh, failures=failures)


def _with_fibres(mesh: VolumeMesh, axes: VentricularAxes, options: Options, report: Progress) -> VolumeMesh:
    """A wall with coordinates, segments, fibres and, where asked for, its pericardium, by the same fields."""
    assert options.fibres is not None
    fields = WallFields(mesh, axes)
    fields.solve(lambda stage, fraction: report(stage, 0.6 * fraction))
    for add in (add_coordinates, add_aha):
        mesh = add(mesh, axes=axes, fields=fields)
    report("anatomy", 0.7)
    mesh = add_fibres(mesh, options.fibres, axes=axes, fields=fields)
    return mesh if options.pericardium is None else add_pericardium(mesh, options.pericardium)


def with_activation(mesh: VolumeMesh, axes: VentricularAxes | None, options: Options) -> VolumeMesh:
    """The mesh with Purkinje fibres and times of activation; what fails is left out, and stands in its verdict."""
    added: dict[str, Callable[[VolumeMesh], VolumeMesh]] = {}
    if options.purkinje is not None:
        added["purkinje"] = partial(add_purkinje, options=options.purkinje, axes=axes)
    if options.activation is not None:
        added["activation"] = partial(add_activation, options=options.activation)
    for name, add in added.items():
        try:
            mesh = add(mesh)
        except FemprepError as error:
            failures = {**verdict_of(mesh).get("failures", {}), name: [f"{name}: not made: {error}"]}
            mesh = with_verdict(mesh, failures=failures)
    return mesh


def with_images(
    mesh: VolumeMesh, axes: VentricularAxes, tissue: Segmentation | None, images: Mapping[str, IntensityImage]
) -> VolumeMesh:
    """The mesh with what second images show along its wall; with coordinates and segments, where it had none.

    Where that fails the mesh stays as it is, and what failed is in its verdict.
    """
    try:
        found = mesh
        if "apicobasal" not in mesh.point_data:
            found = on_wall(mesh, lambda part: add_aha(add_coordinates(part, axes=axes), axes=axes))
        for name, image in images.items():
            found = sample_image(found, image, name)
        return found if tissue is None else add_regions(found, tissue)
    except FemprepError as error:
        earlier = verdict_of(mesh).get("failures", {})
        return with_verdict(mesh, failures={**earlier, "second images": [f"second images: not laid on: {error}"]})


def _prepared(seg: Segmentation, options: Options, stages: Stages) -> Segmentation:
    """The segmentation with its heart's axes; its slices moved back against breath-hold shifts where asked for."""
    if options.image.correct_shifts:
        with stages("slice shifts"):
            seg = align_slices(seg)
    return orient(seg, basal_end=options.wall.basal_end)


def fill(parts: Parts, options: Options, stages: Stages) -> tuple[Wall, VolumeMesh]:
    """The wall of some surfaces, and the mesh in it, by the mesher asked for."""
    wall, mesh = (_swept if options.volume.mesher == "sweep" else _tetrahedra)(parts, options, stages)
    return replace(wall, info=noted(wall.info, *parts.notices)), mesh


def _tetrahedra(parts: Parts, options: Options, stages: Stages) -> tuple[Wall, VolumeMesh]:
    """Fill the wall by fTetWild; a left ventricle's, where that comes to nothing, by swept tetrahedra."""
    try:
        return _tetwild(parts, options, stages)
    except StageError as error:
        if options.anatomy != "lv" or parts.base is None or options.blood_pool or options.volume.sizing is not None:
            raise
        failed = error
    _log.warning("no mesh by fTetWild (%s); the wall is swept instead", failed)
    own = {"element": "tetra", "template": None}
    try:
        wall, mesh = _swept(parts, options.model_copy(update={"sweep": options.sweep.model_copy(update=own)}), stages)
    except FemprepError as error:
        # Its cause is that of the mesher that was asked for; by that a cohort knows it.
        raise StageError(f"{failed}; nor could the wall be swept: {error}") from failed
    words = f"fTetWild gave no mesh of the wall, which was swept instead, to the same tags: {failed}"
    runs = [record.model_dump(mode="json", exclude_none=True) for record in getattr(failed, "records", ())]
    info = noted({**mesh.info, "instead_of": "tetwild", "attempts": runs}, Notice.of("not reached", words))
    return wall, replace(mesh, info=info)


def _tetwild(parts: Parts, options: Options, stages: Stages) -> tuple[Wall, VolumeMesh]:
    """Join the surfaces to a wall and fill it by fTetWild."""
    with stages("wall") as report:
        wall = build_wall(
            epi=parts.epi, endo=parts.endo, base=parts.base, apex=parts.apex, options=options.wall, progress=report
        )
        wall = replace(wall, info={**wall.info, "repaired": [*parts.repaired, *wall.info["repaired"]]})
        wall = open_wall(wall, parts.openings) if parts.openings else wall
    with stages("volume") as report:
        blood = fill_cavities(wall) if options.blood_pool else None
        mesh = tetrahedralize(wall, options=options.volume, progress=report, blood=blood)
    if parts.body is not None:
        with stages("regions"):
            mesh = (label_ventricles if options.anatomy == "biv" else label_chambers)(mesh, parts.body)
    return wall, mesh


def _swept(parts: Parts, options: Options, stages: Stages) -> tuple[Wall, VolumeMesh]:
    """Match the surfaces and fill the wall between them by layers; its boundary is the wall."""
    assert parts.base is not None  # anatomy lv, as the options make sure
    layers = options.layers
    frame = parts.objects["lv"].frame if "lv" in parts.objects else None
    if layers.toward is None and frame is not None:
        x, y, z = frame[:, 0].tolist()
        layers = layers.model_copy(update={"toward": (x, y, z)})
    with stages("match") as report:
        matched = match_surfaces(
            endo=parts.endo["lv"],
            epi=parts.epi,
            base=parts.base,
            apex=parts.apex,
            options=layers,
            progress=report,
        )
    with stages("volume") as report:
        mesh = sweep(matched, options=layers, progress=report)
    wall = boundary_wall(mesh)
    return replace(wall, info={**wall.info, "apex": apex_info(parts.epi, parts.apex)}), mesh


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
    seg = _prepared(seg, options, stages)
    with stages("objects"):
        found = {name: seg.object(*parts, name=name, options=options.image) for name, parts in objects.items()}
        for obj in found.values():
            check_fit(obj, options.surface)
    surfaces = {}
    for name, obj in found.items():
        with stages(f"surface {name}") as report:
            fitted = fit_surface(obj, options=options.surface, progress=report)
            surfaces[name] = replace(fitted, name=name)
    fidelity = surface_fidelity(surfaces, found, seg.grid)
    return Surfaces(seg, options, found, surfaces, fidelity, stages.seconds)
