"""A LabelObject in, a closed Surface out: the smooth surface, or the paper's method put together (2.2 to 2.7)."""

from __future__ import annotations

import logging
from typing import Any, Final, NamedTuple

import numpy as np

from femprep.errors import InputError, OptionError, ResourceError, require_kind
from femprep.image.boundary import BoundaryPoints, boundary_points
from femprep.image.canonical_frame import image_axes
from femprep.image.canonical_storage import stored_by_content
from femprep.image.object import LabelObject
from femprep.image.resample import isotropic
from femprep.mesh.measures.triangles import triangle_quality
from femprep.model import FloatArray, IntArray, Notice, Progress, Surface, records, split_quads
from femprep.model.products import product
from femprep.options import SurfaceOptions, choose, takes
from femprep.surface.fitting.laying import Outlines
from femprep.surface.fitting.smooth import smooth_map
from femprep.surface.fitting.taken import NoSurfaceError
from femprep.surface.fitting.ways import FALLBACK, FitAttempt, told
from femprep.surface.given.fit import lay_on
from femprep.surface.harmonic.field import Field, fit_strength
from femprep.surface.harmonic.leastsquares import BLOCK
from femprep.surface.harmonic.mend import HarmonicFit, Mapped, sound_map
from femprep.surface.harmonic.sources import place_sources
from femprep.surface.harmonic.spline import Basis
from femprep.template import charge_template, cubed_template, sphere_points

_log = logging.getLogger(__name__)

#: Table 1 of the paper: singularities M, control points K, vertices V.
TABLE_1: Final = {
    "lv": {"singularities": 227, "control_points": 204, "vertices": 1180},
    "rv": {"singularities": 246, "control_points": 225, "vertices": 1220},
    "la": {"singularities": 62, "control_points": 66, "vertices": 748},
    "ra": {"singularities": 57, "control_points": 58, "vertices": 684},
    "epi": {"singularities": 422, "control_points": 406, "vertices": 2472},
}
#: Default M and K lie between these.
_FEWEST, _MOST = 50, 450
#: Voxels of the isotropic grid along the sphere's radius, at least and at most.
_COARSEST, _FINEST = 16.0, 64.0
#: Greatest error of a flow line, mm.
_FLOW_ERROR = 2e-3
#: Least size of those voxels, in distances of neighbouring singularities.
_DENT_FREE = 0.25


@takes(SurfaceOptions)
def fit_surface(
    obj: LabelObject | Surface,
    *,
    boundary: BoundaryPoints | None = None,
    options: SurfaceOptions | None = None,
    progress: Progress | None = None,
    **changes: Any,
) -> Surface:
    """Fit a closed, smooth surface with a given number of vertices to a segmented object, or to a given surface.

    The surface (``method="smooth"``) is bent as evenly as the labels allow, each weighted by what it tells, see
    :func:`~femprep.surface.estimate.estimate_surface`, and a pre-meshed sphere is placed evenly on it. By
    ``method="paper"`` the sphere, about the object's barycentre, is carried along the gradient of a harmonic field to
    the surface that fits the object's boundary points in the least squares sense [1]_; by ``"even"`` its vertices are
    then moved along that surface until the triangles are even. Where no smooth surface can be had without crossing
    triangles the one of ``"even"`` is taken, with a notice.

    The template is turned with the heart where the object knows its ``frame``
    (:func:`femprep.orient`), so that vertex i lies at the same place in other phases and in other hearts; else with the
    image's axes, in the order and sense that the object's own shape tells. Along which axes the image is stored matters
    in neither case.

    No surface is returned whose triangles cross or are folded: the stopping function is smoothed until none do.

    Parameters
    ----------
    obj : LabelObject or Surface
        The object, one solid piece; or anyone's surface, which is mended, closed smoothly beyond its rims and laid out
        anew with a template's even triangles (``"smooth"`` alone). Where ``vertices`` is not given and 1500 do not come
        near it, 3000 are taken.
    boundary : BoundaryPoints, optional
        Points its surface should pass; by default the midpoints between its voxels and their neighbours outside.
    options : SurfaceOptions, optional
        Method, number of vertices V, and others. Numbers of singularities M and control points K are those of the
        harmonic field; by default there is one of each for every four voxel faces of the object's lateral surface,
        50 to 450.
    progress : callable, optional
        Told the stage and the fraction done.
    **changes
        Options by name, for example ``method="paper", vertices=1180, singularities=227, control_points=204`` (Table 1).

    Returns
    -------
    Surface
        ``directions`` are the template's vertices, moved or not, ``shape`` the smooth surface as a
        :class:`HarmonicShape` (by ``"smooth"`` as a
        :class:`~femprep.surface.fitting.placed_parametrisation.PlacedShape`), so that ``shape(directions)`` is
        ``points``; ``info`` tells the parameters, residuals (mm), and under ``notices`` what was mended.

    Raises
    ------
    InputError
        The object is too small; the given surface cannot be mended: the message says what is wrong with it, and where.
    OptionError
        An option is unknown or out of range, or not for a given surface.
    ResourceError
        The fit would need more memory than ``memory_limit``.
    StageError
        Triangles cross or are folded, and neither smoothing nor moving vertices mends it.

    References
    ----------
    .. [1] O. Skrinjar, A. Bistoquet, "Generation of myocardial wall surface meshes from segmented MRI", 2009,
       doi 10.1155/2009/313517.

    Examples
    --------
    >>> fp.fit_surface(cavity, vertices=500)
    Surface('lv': 500 points, 996 triangles)
    """
    require_kind(obj, (LabelObject, Surface), "Segmentation.object")
    chosen = choose(SurfaceOptions, options, changes)
    tell = progress or (lambda stage, fraction: None)
    tell("surface", 0.0)
    if isinstance(obj, Surface):
        if boundary is not None:
            raise OptionError("boundary points are those of labels; leave boundary out for a given surface")
        laid = lay_on(obj, chosen)
        tell("surface", 1.0)
        return laid
    obj, boundary = stored_by_content(obj, boundary)
    _enough(obj, boundary)
    axes, turn = image_axes(obj)
    template = (cubed_template if chosen.cells == "quad" else charge_template)(chosen.vertices)
    directions = product(template.directions, (turn if obj.frame is None else obj.frame).T)
    info: dict[str, Any] = {
        "method": chosen.method,
        "vertices": len(directions),
        "cells": chosen.cells,
        "boundary_points": len(boundary),
        "boundary": dict(boundary.info),
        "centre": obj.barycentre.tolist(),
    }
    notices: list[Notice] = []
    tried: tuple[FitAttempt, ...] = ()
    if chosen.method == "smooth":
        try:
            smooth, points, cells, more = smooth_map(
                obj, boundary, directions, template.cells, chosen.connectivity, chosen.curvature_sizing
            )
        except NoSurfaceError as error:
            # The harmonic surface is less accurate, but bends of a thin chamber cannot cross on it.
            line = f"{error}; the surface of method even is taken in its place"
            notices.append(Notice.of("repaired", line))
            info["method"], tried = "even", error.attempts
            _log.warning(line)
        else:
            info |= _residuals(smooth.height(boundary.points)) | more
            tell("surface", 1.0)
            return Surface(points, cells, name=obj.name, directions=smooth.directions, shape=smooth, info=info)
    fit, more = _harmonic_fit(obj, boundary, chosen, axes, turn, directions, template.cells, tell)
    info |= more
    field, level = fit.field, fit.level
    mapped = sound_map(fit, even=chosen.method != "paper")
    shape, points, directions = mapped.shape, mapped.points, mapped.directions
    raw = shape.stopping(directions)
    residual = (level - shape.levels(fit.feet)) / np.linalg.norm(field.gradient(boundary.points), axis=1)
    held = int(np.count_nonzero((raw < shape.lowest) | (raw > shape.highest)))
    if held:
        _log.warning("surface of %r: stopping value held within bounds at %d vertices", obj.name, held)
        worst = int(np.argmax(np.maximum(shape.lowest - raw, raw - shape.highest)))
        line = f"surface {obj.name} would leave the space between its sphere and its singularities at {held} of its "
        line += "vertices, and was held within it"
        notices.append(Notice.of("repaired", line, place=points[worst]))
    if mapped.solved.underdetermined:
        line = f"surface {obj.name} has more control points than boundary points: it was smoothed to be determined"
        notices.append(Notice.of("assumed", line))
    info |= _residuals(residual) | {"stopping_held": held} | mapped.info
    info["notices"] = [*records(*notices), *info.get("notices", [])]
    if tried:
        info["attempts"] = told([*tried, _instead(obj, mapped)])
    tell("surface", 1.0)
    return Surface(points, mapped.cells, name=obj.name, directions=directions, shape=shape, info=info)


def _instead(obj: LabelObject, mapped: Mapped) -> FitAttempt:
    """The attempt that a harmonic surface is, taken in place of smooth ones."""
    beginning, way = FALLBACK
    triangles = split_quads(mapped.cells)
    quality = triangle_quality(mapped.points, triangles)
    off = Outlines(obj).off(mapped.points - obj.barycentre, triangles)
    return FitAttempt(
        beginning=beginning,
        way=way,
        status="taken",
        least_quality=float(quality.min()),
        mean_quality=float(quality.mean()) if mapped.cells.shape[1] == 3 else None,
        distance_pixels=off.mean,
        greatest_pixels=off.greatest,
    )


def _harmonic_fit(
    obj: LabelObject,
    boundary: BoundaryPoints,
    chosen: SurfaceOptions,
    axes: FloatArray,
    turn: FloatArray,
    directions: FloatArray,
    cells: IntArray,
    tell: Progress,
) -> tuple[HarmonicFit, dict[str, Any]]:
    """The paper's field about an object and what its boundary asks of the stopping function; what was chosen for it."""
    singularities, control_points, radius, voxel, memory = _amounts(obj, boundary, chosen)
    centre = obj.barycentre
    tell("surface", 0.1)
    even = isotropic(obj, voxel)
    sources, placement = place_sources(
        product(product(sphere_points(singularities), turn.T), axes),
        even.mask,
        even.grid.to_index(centre[None, :])[0],
        voxel,
        radius,
    )
    tell("surface", 0.3)
    field = fit_strength(Field(centre, radius, centre + product(sources, axes.T), np.ones(1)), boundary.points)
    level = field.potential(boundary.points)
    steps = chosen.steps or field.enough_steps(boundary.points, level, _FLOW_ERROR)
    feet = field.directions(field.flow(boundary.points, level, 0.0, steps))
    tell("surface", 0.7)
    fit = HarmonicFit(
        field,
        Basis(product(sphere_points(control_points), turn.T), chosen.spline_order),
        feet,
        level,
        directions,
        cells,
        turn,
        steps,
        obj.name,
        chosen.connectivity,
        chosen.curvature_sizing,
    )
    return fit, {
        "singularities": singularities,
        "control_points": control_points,
        "radius": radius,
        "flow_steps": steps,
        "level_mean": float(level.mean()),
        "level_spread": float(level.std()),
        "sources": placement,
        "memory_gb": memory,
    }


class _Amounts(NamedTuple):
    """Singularities, control points, radius of their sphere and voxel they are placed by, mm; memory, GB."""

    singularities: int
    control_points: int
    radius: float
    voxel: float
    memory: float


def _amounts(obj: LabelObject, boundary: BoundaryPoints, chosen: SurfaceOptions) -> _Amounts:
    """What the paper's field about an object takes, refused where that is too much."""
    area = _area(obj, boundary)
    number = _default_number(obj, area)
    singularities = number if chosen.singularities is None else chosen.singularities
    control_points = number if chosen.control_points is None else chosen.control_points
    radius = float(chosen.sphere_ratio * np.linalg.norm(boundary.points - obj.barycentre, axis=1).max())
    # The paper erodes by two isotropic voxels and leaves their size open: the image's smallest. Singularities closer to
    # the surface than about half their distance from each other would dent it, so that fine voxels are not followed.
    wanted = max(float(obj.grid.spacing.min()), _DENT_FREE * float(np.sqrt(area / singularities)))
    voxel = float(np.clip(wanted, radius / _FINEST, radius / _COARSEST))
    memory = required_memory(len(boundary), singularities, control_points, chosen.vertices, radius / voxel)
    if memory > chosen.memory_limit:
        raise ResourceError(
            f"fitting {obj.name!r} with {control_points} control points to {len(boundary)} boundary points needs about "
            f"{memory:.1f} GB, the limit is {chosen.memory_limit:g} GB; lower control_points, or raise memory_limit"
        )
    return _Amounts(singularities, control_points, radius, voxel, memory)


def check_fit(obj: LabelObject, options: SurfaceOptions) -> None:
    """Check that a surface can be begun on an object, before anything is computed.

    Raises
    ------
    InputError
        The object is too small.
    ResourceError
        The fit would need more memory than ``memory_limit``.
    """
    boundary = _enough(obj, boundary_points(obj))
    if options.method != "smooth":
        _amounts(obj, boundary, options)


def _enough(obj: LabelObject, boundary: BoundaryPoints) -> BoundaryPoints:
    if len(boundary) < 12:
        raise InputError(f"object {obj.name!r} has {len(boundary)} boundary points, too few for a surface")
    return boundary


def required_memory(boundary: int, singularities: int, control_points: int, vertices: int, radius: float) -> float:
    """Memory a fit needs at most at one time, GB.

    Parameters
    ----------
    boundary, singularities, control_points, vertices : int
        Numbers N, M, K, V.
    radius : float
        Radius of the sphere in voxels of the grid on which singularities are placed.
    """
    points = 8.0 * (boundary * 20 + singularities * 10 + vertices * 30)
    # The normal matrix, its factor, the penalty and a temporary of each; two blocks of rows of G.
    solve = 8.0 * (6.0 * (control_points + 1.0) ** 2 + 3.0 * BLOCK * (control_points + 1.0))
    # Solution and its copy, and a few byte masks and the depth about the object.
    grid = (2.0 * radius + 5.0) ** 3 * 40.0
    return float((points + max(solve, grid)) / 1e9)


def _residuals(residual: FloatArray) -> dict[str, float]:
    """How far boundary points lie from the surface."""
    return {
        "residual_rms": float(np.sqrt(np.mean(residual * residual))),
        "residual_p95": float(np.quantile(np.abs(residual), 0.95)),
        "within_1mm": float(np.mean(np.abs(residual) <= 1.0)),
    }


def _area(obj: LabelObject, boundary: BoundaryPoints) -> float:
    """Area of the object's surface, mm2: two thirds of its voxel faces', all orientations being equally likely."""
    return float((obj.grid.voxel_volume / boundary.spacing).sum() / 1.5)


def _default_number(obj: LabelObject, area: float) -> int:
    """M and K from the object: one for every four voxel faces of a wall along the slices."""
    face = obj.grid.voxel_volume / float(obj.grid.spacing.min())
    # In tens: objects of about one size share their points on the sphere, which are made once.
    return int(np.clip(10 * round(area / (40.0 * face)), _FEWEST, _MOST))
