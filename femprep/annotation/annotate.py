"""Anyone's volume mesh in; the same with its facets and regions named, in mm, with segments and fibres, out."""

from __future__ import annotations

import logging
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np
from scipy.spatial import cKDTree

from femprep.anatomy import wall_thickness
from femprep.annotation.atrium import by_atrium
from femprep.annotation.flat import by_plane, spread
from femprep.annotation.given import check_names, given_facets, given_regions, is_ours, with_places
from femprep.annotation.parts import require_joined, with_parts_joined
from femprep.annotation.reading import Name, NoReading, Question, Reading, ReadingAttempt
from femprep.annotation.records import Annotation
from femprep.annotation.region_facets import facets_of_regions
from femprep.annotation.regions import match_regions, regions_by_place
from femprep.annotation.shell import Shell, shell_of
from femprep.annotation.ventricles import is_atrium, with_anatomy
from femprep.annotation.ways import READING_WAYS
from femprep.errors import FemprepError, InputError
from femprep.export.content import require_elements
from femprep.mesh.length_unit import UNIT, in_millimetres, require_unit
from femprep.mesh.measures.volume_elements import all_volumes, element_volumes
from femprep.mesh.operations.turned import turned_cells
from femprep.model import FACET_TAGS, Notice, Plane, Progress, TagArray, VolumeMesh, noted, tag_name, with_failure
from femprep.model.blocks import chosen_rows, nodes_of
from femprep.model.notice import NOTICES
from femprep.model.stages import Stages
from femprep.model.tags import FOREIGN, FOREIGN_FACETS, TAKEN
from femprep.model.units import MILLIMETRES
from femprep.model.used_points import on_used_points
from femprep.options import AnnotateOptions, choose, takes
from femprep.volume import check

_log = logging.getLogger(__name__)

#: Above this share, negative tetrahedra are those of a program that does not mind their sense.
_SENSELESS = 0.1
#: Points lie in a plane where they spread across it by less than this share of along it.
_FLAT = 1e-6
#: How names of the file's own are known.
_TOLD: Final = Name(1.0, "the file's own name, or one given for it")


@takes(AnnotateOptions)
def annotate(
    mesh: VolumeMesh, options: AnnotateOptions | None = None, progress: Progress | None = None, **changes: Any
) -> Annotation:
    """Name the boundary facets and regions of anyone's volume mesh of a heart, and add what follows from them.

    Facets are named by what the file itself says, by names given for it, and by geometry: flat pieces or sharp rims are
    base and apex, the side that encloses a cavity is endocardium, the left ventricle has the thicker wall; a heart with
    open valves is told by the space between its walls.

    Parameters
    ----------
    mesh : VolumeMesh
        What :func:`femprep.read_mesh` gives, with or without names.
    options : AnnotateOptions, optional
    progress : callable, optional
        Called with ``(stage, fraction)``.
    **changes
        Options by name in place of those given.

    Returns
    -------
    Annotation
        The mesh in mm, each name with how sure it is.

    Raises
    ------
    InputError
        There are no elements, the boundary is none of a heart's, or two readings are possible; the message holds the
        line of the configuration that decides.

    Examples
    --------
    >>> fp.annotate(mesh).mesh.facet_names
    {'endo': 101, 'epi': 102, 'base': 103}
    """
    options = choose(AnnotateOptions, options, changes)
    require_elements(mesh)
    stages = Stages(progress)
    with stages("boundary"):
        mesh = in_millimetres(mesh, options.unit, heart=True)
        require_unit(mesh)
        unit = str(mesh.info.get(UNIT, {"unit": "mm"})["unit"])
        scale = MILLIMETRES[unit]
        mesh = _used(_positive(mesh))
        _check_solid(mesh)
        assumed = check_names(mesh, options.names)
        mesh = with_parts_joined(mesh, shell_of(mesh))
        shell = shell_of(mesh)
        require_joined(shell)
    with stages("facets"):
        given = given_facets(mesh, shell, options.names)
        reading, attempts = read_boundary(shell, given, options, scale)
        theirs, known = mesh.region, given_regions(mesh, options.names)
        mesh = _named(mesh, shell, reading)
    with stages("regions"):
        mesh, names, questions = _regions(mesh, theirs, known)
        mesh = facets_of_regions(mesh, shell, names)
        tag = np.where(given > 0, reading.tag, mesh.facet_tag).astype(np.int32)
        mesh = replace(mesh, facet_tag=tag, info=noted(mesh.info, *assumed))
    _ask([*reading.questions, *questions])
    if is_atrium(mesh):  # it has no segments in which the thickness is shown
        mesh = mesh.with_data(cell={"thickness": wall_thickness(mesh)})
    if options.fibres is not None:
        with stages("anatomy"):
            mesh = _anatomy(mesh, options, reading)
    with stages("quality"):
        quality = check(mesh, options=options.check)
    return Annotation(
        mesh, quality, options, unit, {**reading.names, **names}, attempts, reading.openings, stages.seconds
    )


def _positive(mesh: VolumeMesh) -> VolumeMesh:
    """Elements turned where the file lists them the other way round; a few negative ones are inverted, and stay."""
    cells, turned = dict(mesh.cells), 0
    for kind, block in mesh.cells.items():
        # The corners of a curved tetrahedron tell its side.
        straight = (block[:, :4], "tetra") if kind.startswith("tetra") else (block, kind)
        negative = element_volumes(mesh.points, *straight) < 0
        if len(block) and negative.mean() > _SENSELESS:
            cells[kind] = np.where(negative[:, None], turned_cells(kind, block), block)
            turned += int(negative.sum())
    if not turned:
        return mesh
    words = "{amount} list their corners the other way round, and were turned"
    return replace(
        mesh, cells=cells, info=noted(mesh.info, Notice.of("repaired", words, amount=turned, unit="elements"))
    )


def _check_solid(mesh: VolumeMesh) -> None:
    """Refuse a mesh whose points lie in a plane."""
    apart = mesh.points - mesh.points.mean(axis=0)
    across = np.linalg.eigvalsh(apart.T @ apart)
    if not across[0] > _FLAT**2 * across[-1]:
        raise InputError("all points of the mesh lie in a plane; a mesh of a heart's wall has elements with a volume")


def _used(mesh: VolumeMesh) -> VolumeMesh:
    """The mesh without points that no element uses, which solvers stumble over."""
    used = np.isin(np.arange(len(mesh.points)), nodes_of(mesh.cells))
    if used.all():
        return mesh
    whole = [np.empty(0, dtype=bool), *(used[block].all(axis=1) for block in mesh.facets.values())]
    keep = np.concatenate(whole)
    fields, _ = on_used_points(mesh, mesh.cells, chosen_rows(mesh.facets, keep))
    words = f"{np.count_nonzero(~used)} points that no element uses"
    return VolumeMesh(
        region=mesh.region,
        facet_tag=mesh.facet_tag[keep],
        cell_data=mesh.cell_data,
        facet_data={name: values[keep] for name, values in mesh.facet_data.items()},
        planes=mesh.planes,
        info=noted(mesh.info, Notice.of("left out", words)),
        **fields,
    )


def read_boundary(
    shell: Shell, given: TagArray, options: AnnotateOptions, scale: float
) -> tuple[Reading, tuple[ReadingAttempt, ...]]:
    """The first reading of the boundary that fits, with given names over it; and what was tried."""
    attempts: list[ReadingAttempt] = []
    reading: Reading | None = None
    if (given > 0).all():
        reading = Reading("names", given, {tag_name(int(tag)): _TOLD for tag in np.unique(given)})
        attempts.append(ReadingAttempt("names", True, "every boundary facet has a name that is known"))
    ways = READING_WAYS
    if options.anatomy != "auto":
        ways = {"atrium": partial(by_atrium, chamber="la" if options.anatomy == "left-atrium" else "ra")}
    if options.base is not None:
        point, normal = np.array(options.base[:3]) * scale, np.array(options.base[3:])
        if not np.linalg.norm(normal) > 0:
            raise InputError("the base plane's normal is 0, 0, 0; give the direction out of the ventricle")
        ways = {"base plane": partial(by_plane, base=Plane(point, normal, "given"))}
    for name, way in ways.items():
        if reading is not None:
            break
        try:
            reading = way(shell)
            attempts.append(ReadingAttempt(name, True, "fits", _figures(reading, shell)))
        except NoReading as error:
            attempts.append(ReadingAttempt(name, False, str(error)))
            _log.info("%s: %s", name, error)
    if reading is None:
        tried = "; ".join(f"{attempt.way}: {attempt.why}" for attempt in attempts)
        raise InputError(
            "the boundary is read in none of the ways known; give the base plane by --base X,Y,Z,NX,NY,NZ, or the "
            f"line base = [x, y, z, nx, ny, nz] of --config ({tried})"
        )
    at = {name: tuple(scale * x for x in place) for name, place in options.at.items()}
    if (given > 0).any() and reading.way != "names":
        reading = _over(reading, given)
    return with_places(shell, reading, at) if at else reading, tuple(attempts)  # type: ignore[arg-type]


def _over(reading: Reading, given: TagArray) -> Reading:
    """Names of the file's own over those of geometry."""
    tag = np.where(given > 0, given, reading.tag)
    names = {name: own for name, own in reading.names.items() if np.any(tag == FACET_TAGS[name])}
    names |= {tag_name(int(number)): _TOLD for number in np.unique(given[given > 0])}
    return replace(reading, tag=tag.astype(np.int32), names=names)


def _figures(reading: Reading, shell: Shell) -> dict[str, float | int | str]:
    areas = {tag_name(int(tag)): float(shell.area[reading.tag == tag].sum()) for tag in np.unique(reading.tag)}
    return {f"area of {name}, mm2": round(area, 1) for name, area in areas.items()}


def _named(mesh: VolumeMesh, shell: Shell, reading: Reading) -> VolumeMesh:
    """The mesh with all of its boundary facets, named, and no others."""
    tag = spread(shell, reading.tag)
    info = {key: value for key, value in mesh.info.items() if key not in (FOREIGN, FOREIGN_FACETS, NOTICES)}
    kept = [one for one in mesh.info.get(NOTICES, ()) if is_ours(mesh) or not one["what"].startswith(TAKEN)]
    info = {**info, NOTICES: kept} if kept else info
    loose = tag == 0
    if loose.any():
        # A boundary of its own that no way has a name for: a bit of tissue that hangs on nothing, or a small void.
        tag[loose] = tag[~loose][cKDTree(shell.centre[~loose]).query(shell.centre[loose])[1]]
        words = f"{loose.sum()} facets that border on nothing named were named as the nearest"
        info = noted(info, Notice.of("assumed", words))
    # No planes: a base of theirs is flat to its file's digits alone, which the check of ours would refuse.
    return replace(mesh, facets=shell.facets, facet_tag=tag, facet_data={}, planes={}, info=info)


def _regions(
    mesh: VolumeMesh, theirs: TagArray, given: dict[int, int]
) -> tuple[VolumeMesh, dict[str, Name], list[Question]]:
    tags, which = np.unique(theirs, return_inverse=True)
    if set(tags.tolist()) <= set(given):
        region = np.array([given[tag] for tag in tags.tolist()])[which.ravel()]
        return replace(mesh, region=region), {tag_name(int(tag)): _TOLD for tag in np.unique(region)}, []
    ours = regions_by_place(mesh)
    if len(tags) == 1:
        found = np.unique(ours)
        near = Name(0.9 if len(found) > 1 else 1.0, "between the surfaces that are nearest")
        return replace(mesh, region=ours), {tag_name(int(tag)): near for tag in found}, []
    region, names, questions = match_regions(theirs, ours, np.abs(all_volumes(mesh.points, mesh.cells)), given)
    return replace(mesh, region=region), names, questions


def _ask(questions: list[Question]) -> None:
    """Two readings are possible: one line decides.

    Raises
    ------
    InputError
    """
    if questions:
        words = "; ".join(f"{question.words}; if so, add to --config: {question.line}" for question in questions)
        raise InputError(f"two readings are possible: {words}")


def _anatomy(mesh: VolumeMesh, options: AnnotateOptions, reading: Reading) -> VolumeMesh:
    """Coordinates, segments and fibres; where they fail the mesh goes without, which its verdict says."""
    assert options.fibres is not None
    theirs = {name: values for name, values in mesh.cell_data.items() if name in ("fiber", "sheet", "normal")}
    if theirs:
        # What the file brought is kept beside ours.
        kept = {f"file_{name}": values for name, values in theirs.items()}
        mesh = replace(mesh, cell_data={k: v for k, v in mesh.cell_data.items() if k not in theirs} | kept)
    try:
        return with_anatomy(mesh, options.fibres, reading.openings)
    except FemprepError as error:
        return with_failure(mesh, "fibres", f"fibres: not made: {error}")
