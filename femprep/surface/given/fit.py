"""Anyone's surface in, a template laid evenly on it out: what every stage after it takes."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from femprep.errors import OptionError, StageError
from femprep.mesh.measures.triangles import areas, triangle_quality, vertex_normals, vertex_sums
from femprep.mesh.operations.collapse import collapsed
from femprep.mesh.operations.midpoint_subdivision import midpoint_subdivision
from femprep.mesh.patches import PatchSurface
from femprep.mesh.polygons import decimated_to
from femprep.mesh.sampling import sample_surface
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import is_closed
from femprep.model import FloatArray, IntArray, Surface, split_quads
from femprep.model.products import unit_vectors
from femprep.options import SurfaceOptions
from femprep.surface.estimate.chords import outset
from femprep.surface.fitting.laying import Laying, Off, TemplateToLay
from femprep.surface.fitting.slide import Goal
from femprep.surface.fitting.taken import Taken
from femprep.surface.fitting.ways import ACCEPTANCE
from femprep.surface.given.beyond import closed_beyond
from femprep.surface.given.lid import without_lid
from femprep.surface.given.mend import mended
from femprep.template import charge_template, cubed_template

_log = logging.getLogger(__name__)

#: A surface whose triangles are at least so good is smooth through its own vertices: least and mean Q.
_FAIR: Final = (0.1, 0.7)
#: One of more vertices than this times the template's, or with worse triangles, is drawn anew with this many.
_FINE: Final = 6.0
_DRAWN: Final = 4.0
#: Vertices of the finer template that is tried where the usual one does not come near the given surface.
_FINER: Final = 3000
#: Points at which the distance from it is taken.
_SAMPLES: Final = 6000


def lay_on(given: Surface, chosen: SurfaceOptions) -> Surface:
    """Lay a template on a given surface.

    Parameters
    ----------
    given : Surface
        Open surfaces are closed beyond their rims, flat lids taken off and closed likewise, so that what comes out is
        smooth where a base plane will cut it. One with the directions of a template is returned as it is.
    chosen : SurfaceOptions
        Where ``vertices`` is not given and 1500 do not come near the surface, 3000 are taken.

    Returns
    -------
    Surface
        Closed. ``info`` has ``distance_mean_mm`` and ``distance_greatest_mm`` from the given surface.

    Raises
    ------
    InputError
        The surface cannot be mended.
    OptionError
        A method other than ``"smooth"``: the others fit labels.
    StageError
        It bends too sharply for so many vertices.
    """
    if given.directions is not None and is_closed(given.cells):
        return given
    if chosen.method != "smooth":
        raise OptionError(f"method {chosen.method!r} fits labels; a given surface is laid out by method 'smooth'")
    sound = mended(given)
    lidless = without_lid(sound.points, sound.cells)
    open_ = sound.cells if lidless is None else lidless.cells
    closed = closed_beyond(sound.points, open_)
    yardstick = _GivenPoints(sound.points, open_)
    laid = _laid(given.name, *closed, yardstick, chosen)
    if _far(laid) > 1.0 and "vertices" not in chosen.model_fields_set:
        try:
            finer = _laid(given.name, *closed, yardstick, chosen.model_copy(update={"vertices": _FINER}))
        except StageError as error:
            _log.info("%s", error)
        else:
            laid = min(laid, finer, key=_far)
    return _surface(sound, laid, chosen)


class _GivenPoints:
    """What a template is measured against: points of the given surface, without what was added to close it."""

    pixel = 1.0
    exact = True

    def __init__(self, points: FloatArray, cells: IntArray) -> None:
        self.points = np.asarray(sample_surface(points, cells, _SAMPLES).points)
        self.middle = points[np.unique(cells)].mean(axis=0)

    def off(self, points: FloatArray, triangles: IntArray) -> Off:
        """How far it is from a surface about the middle, mm."""
        distance = ClosestFinder(points + self.middle, triangles)(self.points).distance
        return Off(float(distance.mean()), float(distance.max()))


class _Fit(NamedTuple):
    """A template on a smooth surface, its distance from what was given, the middle of its coordinates."""

    taken: Taken
    off: Off
    middle: FloatArray


def _far(laid: _Fit) -> float:
    """How many times farther than accepted a template lies from the given surface."""
    return max(laid.off.mean / ACCEPTANCE.given_mean, laid.off.greatest / ACCEPTANCE.given_greatest)


def _laid(name: str, points: FloatArray, cells: IntArray, yardstick: _GivenPoints, chosen: SurfaceOptions) -> _Fit:
    template = (cubed_template if chosen.cells == "quad" else charge_template)(chosen.vertices)
    surface = _smooth(points - yardstick.middle, cells, chosen.vertices)
    wanted = Goal(surface, len(split_quads(template.cells)), chosen.curvature_sizing).area
    # Where the triangles given are themselves as large, what they cut off has been cut off already.
    own = areas(points, cells)
    total = vertex_sums(own, cells, len(points))
    around = total / np.maximum(np.bincount(cells.ravel(), minlength=len(points)), 1)
    there = around[cells][ClosestFinder(points - yardstick.middle, cells)(surface.points).triangle].mean(axis=1)
    out = outset(surface, wanted - there)
    to_lay = TemplateToLay(template.directions, template.cells, chosen.connectivity, chosen.curvature_sizing)
    tried = Laying("as given", to_lay, yardstick, surface, out, None).attempts()
    refusal = f"surface {name!r} bends too sharply for {chosen.vertices} vertices; use more, or smooth it"
    taken = Taken.of(tried, refusal)
    return _Fit(taken, yardstick.off(taken.placed.points, split_quads(taken.placed.cells)), yardstick.middle)


class _Facets:
    """The given triangles themselves, to which an even mesh keeps while it is drawn."""

    def __init__(self, points: FloatArray, cells: IntArray) -> None:
        self._finder = ClosestFinder(points, cells)
        self._normals = vertex_normals(points, cells)

    def settle(self, queries: FloatArray, near: IntArray | None = None) -> tuple[FloatArray, FloatArray, IntArray]:
        """Feet, unit normals there, and the triangles they lie in."""
        found = self._finder(queries)
        return found.points, unit_vectors(found.at(self._normals)), found.triangle


def _smooth(points: FloatArray, cells: IntArray, vertices: int) -> PatchSurface:
    """The smooth surface through a mesh: through its own vertices where they are even, else through others on it."""
    quality = triangle_quality(points, cells)
    fair = quality.min() >= _FAIR[0] and quality.mean() >= _FAIR[1]
    if fair and len(points) <= _FINE * vertices:
        return PatchSurface(points, cells)
    facets = _Facets(points, cells)
    count = int(_DRAWN * vertices)
    start, rough = decimated_to(points, cells, 4 * count)
    while len(start) < 1.5 * count:
        _, start, rough = midpoint_subdivision(start, rough)
    found = collapsed(start, rough, facets, count)
    if found is None:
        return PatchSurface(points, cells)
    return PatchSurface(found[0], found[3])


def _surface(given: Surface, laid: _Fit, chosen: SurfaceOptions) -> Surface:
    placed = laid.taken.placed
    shape = laid.taken.shape(np.eye(3), laid.middle)
    own = laid.taken.info(given.name, chosen.connectivity)
    info = {
        **given.info,
        "method": "given",
        "vertices": len(placed.points),
        "cells": chosen.cells,
        "given": {"points": len(given.points), "triangles": len(given.cells)},
        "distance_mean_mm": laid.off.mean,
        "distance_greatest_mm": laid.off.greatest,
        **own,
        "notices": [*given.info.get("notices", ()), *own["notices"]],
    }
    return replace(
        given,
        points=shape.to_world(placed.points),
        cells=placed.cells,
        directions=shape.directions,
        shape=shape,
        info=info,
    )
