"""Surfaces and planes of a heart in, its wall and the mesh in it out, by the mesher asked for."""

from __future__ import annotations

import logging
from dataclasses import replace

from femprep.errors import FemprepError, StageError
from femprep.model import Notice, VolumeMesh, Wall, noted
from femprep.model.stages import Stages
from femprep.options import Options
from femprep.sweeping import boundary_wall, sweep
from femprep.sweeping.matching.match import match_surfaces
from femprep.volume import tetrahedralize
from femprep.volume.ventricles import label_chambers, label_ventricles
from femprep.wall import build_wall, fill_cavities, open_wall
from femprep.wall.anatomies import WallSurfaces
from femprep.wall.chambers.right_base import cut_right_base
from femprep.wall.joining.build import apex_info

_log = logging.getLogger(__name__)


def fill(fitted: WallSurfaces, options: Options, stages: Stages) -> tuple[Wall, VolumeMesh]:
    """The wall of some surfaces, and the mesh in it, by the mesher asked for."""
    wall, mesh = (_swept if options.volume.mesher == "sweep" else _tetrahedra)(fitted, options, stages)
    return replace(wall, info=noted(wall.info, *fitted.notices)), mesh


def _tetrahedra(fitted: WallSurfaces, options: Options, stages: Stages) -> tuple[Wall, VolumeMesh]:
    """Fill the wall by fTetWild; a left ventricle's, where that comes to nothing, by swept tetrahedra."""
    try:
        return _tetwild(fitted, options, stages)
    except StageError as error:
        if options.anatomy != "lv" or fitted.base is None or options.blood_pool or options.volume.sizing is not None:
            raise
        failed = error
    _log.warning("no mesh by fTetWild (%s); the wall is swept instead", failed)
    own = {"element": "tetra", "template": None}
    try:
        wall, mesh = _swept(fitted, options.model_copy(update={"sweep": options.sweep.model_copy(update=own)}), stages)
    except FemprepError as error:
        # Its cause is that of the mesher that was asked for; by that a cohort knows it.
        both = f"{failed.args[0]}; nor could the wall be swept: {error.args[0]}"
        raise StageError(both, advice=(*failed.advice, *error.advice)) from failed
    words = f"fTetWild gave no mesh of the wall, which was swept instead, to the same tags: {failed}"
    runs = [record.model_dump(mode="json", exclude_none=True) for record in getattr(failed, "records", ())]
    info = noted({**mesh.info, "instead_of": "tetwild", "attempts": runs}, Notice.of("not reached", words))
    return wall, replace(mesh, info=info)


def joined_wall(fitted: WallSurfaces, options: Options, stages: Stages) -> Wall:
    """The surfaces joined to a wall, cut at its bases, its valves open if asked."""
    with stages("wall") as report:
        wall = build_wall(
            epi=fitted.epi, endo=fitted.endo, base=fitted.base, apex=fitted.apex, options=options.wall, progress=report
        )
        wall = replace(wall, info={**wall.info, "repaired": [*fitted.repaired, *wall.info["repaired"]]})
        wall = open_wall(wall, fitted.openings) if fitted.openings else wall
        if fitted.right_base is not None and fitted.body is not None:
            wall = cut_right_base(wall, fitted.right_base, fitted.body, options.wall.minimum_thickness)
    return wall


def _tetwild(fitted: WallSurfaces, options: Options, stages: Stages) -> tuple[Wall, VolumeMesh]:
    """Join the surfaces to a wall and fill it by fTetWild."""
    wall = joined_wall(fitted, options, stages)
    with stages("volume") as report:
        blood = fill_cavities(wall) if options.blood_pool else None
        mesh = tetrahedralize(wall, options=options.volume, progress=report, blood=blood, limits=options.limits)
    if fitted.body is not None:
        with stages("regions"):
            mesh = (label_ventricles if options.anatomy == "biv" else label_chambers)(mesh, fitted.body)
    return wall, mesh


def _swept(fitted: WallSurfaces, options: Options, stages: Stages) -> tuple[Wall, VolumeMesh]:
    """Match the surfaces and fill the wall between them by layers; its boundary is the wall."""
    assert fitted.base is not None  # anatomy lv, as the options make sure
    layers = options.layers
    frame = fitted.objects["lv"].frame if "lv" in fitted.objects else None
    if layers.toward is None and frame is not None:
        x, y, z = frame[:, 0].tolist()
        layers = layers.model_copy(update={"toward": (x, y, z)})
    with stages("match") as report:
        matched = match_surfaces(
            endo=fitted.endo["lv"],
            epi=fitted.epi,
            base=fitted.base,
            apex=fitted.apex,
            options=layers,
            progress=report,
        )
    with stages("volume") as report:
        mesh = sweep(matched, options=layers, progress=report)
    wall = boundary_wall(mesh)
    return replace(wall, info={**wall.info, "apex": apex_info(fitted.epi, fitted.apex)}), mesh
