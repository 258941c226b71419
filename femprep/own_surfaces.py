"""The stages in order for anyone's surfaces: endocardium and epicardium in; wall, mesh and quality out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from femprep.anatomy import on_wall, ventricular_axes
from femprep.annotation.regions import regions_by_place
from femprep.errors import OptionError
from femprep.image import IntensityImage, Segmentation
from femprep.mesh.measures.triangles import areas
from femprep.mesh.topology import volume
from femprep.model import Progress, Surface
from femprep.model.arrays import mapping
from femprep.model.stages import Stages
from femprep.options import Options, choose, takes
from femprep.options.advice import GIVE_BASE, GIVEN_SURFACES, advice_within
from femprep.preflight import check_options, check_second_images
from femprep.report.beside import volumes_beside_given
from femprep.report.run import Run
from femprep.stages.fill import fill
from femprep.stages.furnish import concluded, furnish
from femprep.surface import fit_surface
from femprep.surface.given.beyond import closed_beyond
from femprep.volume import check
from femprep.volume.quality.given_fidelity import given_fidelity, with_given_fidelity
from femprep.volume.validate import check_roughly
from femprep.wall import given_openings, keep_apart
from femprep.wall.anatomies import WallSurfaces
from femprep.wall.own import OUTER, OwnSurfaces, anatomy_of, facets_of, prepare_surfaces


@takes(Options)
def mesh_surfaces(
    surfaces: Mapping[str, Surface],
    options: Options | None = None,
    progress: Progress | None = None,
    *,
    tissue: Segmentation | None = None,
    images: Mapping[str, IntensityImage] | None = None,
    **changes: object,
) -> Run:
    """Mesh the wall between anyone's surfaces of a heart, the whole way.

    Parameters
    ----------
    surfaces : mapping of str to Surface
        ``lv`` (and ``rv``; and ``la``, ``ra``): the endocardia; ``epi``: the epicardium around all of them. Which there
        are tells the anatomy. What :func:`femprep.prepare_surfaces` does to them is done.
    options : Options, optional
        All options; those of labels have no effect.
    progress : callable, optional
        Called with ``(stage, fraction)``.
    tissue : Segmentation, optional
        A second image of labels, in the surfaces' coordinates, whose structures are scar, border zone, fat...: see
        :func:`femprep.add_regions`.
    images : mapping of str to IntensityImage, optional
        Images to sample, by the name of the field: see :func:`femprep.sample_image`.
    **changes
        Options by name in place of those given.

    Returns
    -------
    Run
        Its quality report holds how far the finished mesh lies from the given surfaces, mm.

    Raises
    ------
    InputError, OptionError, ResourceError
        A surface or an option is wrong.
    StageError
        A stage failed on valid input.

    Examples
    --------
    >>> surfaces = {"lv": fp.read_surface("endo.stl"), "epi": fp.read_surface("epi.stl")}  # doctest: +SKIP
    >>> fp.mesh_surfaces(surfaces, volume={"edge_length": 3.0}).quality.passed  # doctest: +SKIP
    True
    """
    options = choose(Options, options, dict(changes))
    anatomy = anatomy_of(mapping(surfaces, "surfaces", Surface))
    if "anatomy" in options.model_fields_set and options.anatomy != anatomy:
        raise OptionError(f"anatomy is {options.anatomy!r}, but surfaces {', '.join(surfaces)} are those of {anatomy}")
    options = choose(Options, options, {"anatomy": anatomy})
    stages = Stages(progress)
    with advice_within(options, GIVEN_SURFACES):
        check_options(options)
        with stages("surfaces"):
            own = prepare_surfaces(surfaces, unit=options.unit, options=options.wall)
            _check(own, options, tissue is not None or bool(images))
            points = np.concatenate([surface.points for surface in own.surfaces.values()])
            check_second_images(points, options, tissue, images or {})
        fitted = _fitted(own, options, stages)
        wall, mesh = fill(fitted, options, stages)
    if anatomy != "lv":
        with stages("regions"):
            mesh = on_wall(mesh, lambda part: replace(part, region=regions_by_place(part)))
    filled, mirrored = mesh, "auto" if options.fibres is None else options.fibres.mirrored
    mesh = furnish(mesh, lambda: ventricular_axes(filled, mirrored=mirrored), options, stages, tissue, images)
    with stages("quality"):
        quality = check(mesh, options=options.check)
        given = {facets_of(name, own.anatomy): surface for name, surface in own.surfaces.items()}
        judged = with_given_fidelity(quality, given_fidelity(mesh, given))
    mesh, judged, solved = concluded(mesh, quality, judged, options, stages)
    more: dict[str, Any] = {
        "volumes": tuple(volumes_beside_given(mesh, wall, own)),
        "seconds": stages.seconds,
        **solved,
    }
    return Run(None, options, {}, fitted.surfaces, wall, mesh, judged, **more, given=own)


def _check(own: OwnSurfaces, options: Options, second: bool) -> None:
    """Refuse what a later stage could not but fail on."""
    if own.base is None and own.anatomy != "whole-heart":
        for wanted, name in (
            (options.fibres is not None, "fibres"),
            (second, "second images"),
            (options.volume.mesher == "sweep", "the sweep"),
        ):
            if wanted:
                needs = "needs" if name == "the sweep" else "need"
                raise OptionError(f"{name} {needs} a base, and the surfaces are closed all round", advice=[GIVE_BASE])
    outer, *inner = (closed_beyond(s.points, s.triangles) for s in (own.epi, *own.endo.values()))
    tissue = volume(*outer) - sum(volume(*one) for one in inner)
    side = sum(float(areas(*one).sum()) for one in (outer, *inner))
    if tissue > 0.0:
        check_roughly(tissue, side, options.wall.minimum_thickness, options.volume)


def _fitted(own: OwnSurfaces, options: Options, stages: Stages) -> WallSurfaces:
    """Templates on all surfaces, apart from each other, and the planes they are cut by."""
    laid = {}
    for name, surface in own.surfaces.items():
        with stages(f"surface {name}") as report:
            laid[name] = fit_surface(surface, options=options.surface, progress=report)
    endo = {name: laid[name] for name in own.endo}
    repaired: list[dict[str, Any]] = []
    if len(endo) > 1:
        endo, repaired = keep_apart(endo, options.wall.minimum_thickness, options.wall.maximum_push)
    openings = given_openings(options.wall.valves)
    return WallSurfaces(
        {}, endo, laid[OUTER], own.base, openings=openings, repaired=repaired, notices=list(own.notices)
    )
