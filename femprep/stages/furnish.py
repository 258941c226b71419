"""A mesh of a wall in; anatomy, activation and what second images show on it, and what a solver makes of it, out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from femprep.activation import add_activation, add_purkinje
from femprep.anatomy import (
    VentricularAxes,
    WallFields,
    add_aha,
    add_atrial_fibres,
    add_coordinates,
    add_fibres,
    add_pericardium,
    add_regions,
    on_wall,
    sample_image,
)
from femprep.errors import FemprepError
from femprep.export.abaqus.calculix import inflate
from femprep.export.content import content_of
from femprep.export.table import refusals
from femprep.image import IntensityImage, Segmentation
from femprep.model import Progress, VolumeMesh, verdict_of, with_failure
from femprep.model.stages import Stages
from femprep.options import Options
from femprep.volume import QualityReport
from femprep.volume.quality.judged import carry
from femprep.volume.quality.limits import judge_solution


def furnish(
    mesh: VolumeMesh,
    find_axes: Callable[[], VentricularAxes],
    options: Options,
    stages: Stages,
    tissue: Segmentation | None = None,
    images: Mapping[str, IntensityImage] | None = None,
) -> VolumeMesh:
    """The mesh with all that is asked for on it; what fails is left out, and stands in its verdict.

    Parameters
    ----------
    mesh : VolumeMesh
    find_axes : callable
        Gives the axes of the heart, when they are needed.
    options : Options
    stages : Stages
    tissue, images
        Second images: see :func:`femprep.add_regions`, :func:`femprep.sample_image`.
    """
    axes = None
    if options.fibres is not None:
        with stages("anatomy") as report:
            axes = find_axes()
            mesh = _with_anatomy(mesh, axes, options, report)
    if tissue is not None or images:
        with stages("second images"):
            mesh = _with_images(mesh, axes or find_axes(), tissue, images or {}, options)
    if options.purkinje is not None or options.activation is not None:
        with stages("activation"):
            mesh = _with_activation(mesh, axes, options)
    return mesh


def concluded(
    mesh: VolumeMesh, quality: QualityReport, judged: QualityReport, options: Options, stages: Stages
) -> tuple[VolumeMesh, QualityReport, dict[str, Any]]:
    """The mesh with its verdict, the report with that of the solver asked for, and what a run keeps of the solution.

    ``judged`` is the mesh's own report, ``quality``, with verdicts that a mesh alone cannot tell.
    """
    mesher = str(verdict_of(mesh).get("mesher", options.volume.mesher))
    mesh = carry(mesh, quality.options, mesher, judged.failures[len(quality.failures) :])
    if options.solve != "ccx":
        return mesh, judged, {}
    with stages("solve"):
        solution, inflated = inflate(mesh, options.export)
        return mesh, judge_solution(judged, solution), {"solution": solution, "inflated": inflated}


def _with_anatomy(mesh: VolumeMesh, axes: VentricularAxes, options: Options, report: Progress) -> VolumeMesh:
    """The mesh with coordinates, segments and fibres; where they fail, without, and with what failed in its verdict.

    The mesh is good for much without them, and took most of the time.
    """
    try:
        return on_wall(mesh, partial(_with_fibres, axes=axes, options=options, report=report))
    except FemprepError as error:
        mesh = with_failure(mesh, "fibres", f"fibres: not made: {error}")
        for name, reason in refusals(content_of(mesh), options.formats, options.export).items():
            mesh = with_failure(mesh, name, f"{name}: not written: {reason}")
        return mesh


def _with_fibres(mesh: VolumeMesh, axes: VentricularAxes, options: Options, report: Progress) -> VolumeMesh:
    """A wall with coordinates, segments, fibres and, where asked for, its pericardium, by the same fields."""
    assert options.fibres is not None
    fields = WallFields(mesh, axes)
    fields.solve(lambda stage, fraction: report(stage, 0.6 * fraction))
    for add in (add_coordinates, add_aha):
        mesh = add(mesh, axes=axes, fields=fields)
    report("anatomy", 0.7)
    mesh = add_fibres(mesh, options.fibres, axes=axes, fields=fields)
    if options.fibres.atria != "none":
        mesh = add_atrial_fibres(mesh, options.fibres.veins)
    return mesh if options.pericardium is None else add_pericardium(mesh, options.pericardium)


def _with_activation(mesh: VolumeMesh, axes: VentricularAxes | None, options: Options) -> VolumeMesh:
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
            mesh = with_failure(mesh, name, f"{name}: not made: {error}")
    return mesh


def _with_images(
    mesh: VolumeMesh,
    axes: VentricularAxes,
    tissue: Segmentation | None,
    images: Mapping[str, IntensityImage],
    options: Options,
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
        return found if tissue is None else add_regions(found, tissue, conforming=options.conforming)
    except FemprepError as error:
        return with_failure(mesh, "second images", f"second images: not laid on: {error}")
