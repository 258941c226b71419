"""A smooth surface and a template in, the template laid on it by one way after the other until one is good out."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from femprep.errors import InputError
from femprep.image.object import LabelObject
from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.patches import PatchSurface
from femprep.mesh.search.intersection import self_intersections
from femprep.mesh.topology import volume
from femprep.model import FloatArray, IntArray, Surface, split_quads
from femprep.surface.fitting.chart import Chart
from femprep.surface.fitting.place import Placed, place_evenly
from femprep.surface.fitting.remeshing import remesh
from femprep.surface.fitting.slide import Connectivity
from femprep.surface.fitting.ways import ACCEPTANCE, LAYING_WAYS, FitAttempt, LayingWay
from femprep.surface.measure.inslice import label_distance, missed_distance


class TemplateToLay(NamedTuple):
    """A template in the image's axes, and how it is laid.

    Attributes
    ----------
    directions : (V, 3) array
    cells : (m, 3) or (m, 4) array
    connectivity, curvature
        As for :func:`~femprep.surface.fitting.place.place_evenly`.
    """

    directions: FloatArray
    cells: IntArray
    connectivity: Connectivity
    curvature: float


class Off(NamedTuple):
    """Distance from the outlines in the slices, pixels: mean, and greatest in any place."""

    mean: float
    greatest: float

    def short(self, best: Off, cut: float, exact: bool = True) -> Off:
        """How many times farther than it should be a template is, on a surface that is ``best`` off itself.

        In the mean flat triangles come no closer than that surface, give or take half of the most they cut off,
        ``cut`` pixels; where it is too far itself, another may come closer. That does not hold where the outlines are
        not all that the surface follows (``exact``): then no other comes closer either.
        """
        mean, greatest = ACCEPTANCE.distance, ACCEPTANCE.greatest
        if best.mean <= mean or not exact:
            mean = max(mean, best.mean + 0.5 * cut)
        if not exact:
            greatest = max(greatest, best.greatest + 0.5 * ACCEPTANCE.greatest)
        return Off(self.mean / mean, self.greatest / greatest)


class Yardstick(Protocol):
    """What a template is measured against: labels' outlines, or a given surface."""

    @property
    def pixel(self) -> float:
        """Unit of distances from it, mm."""
        ...

    @property
    def exact(self) -> bool:
        """Whether the surface follows nothing else."""
        ...

    def off(self, points: FloatArray, triangles: IntArray) -> Off:
        """How far a surface is from it, in that unit."""
        ...


class Outlines:
    """What a surface is measured against: an object's outlines in its slices.

    Parameters
    ----------
    obj : LabelObject
        At rest; surfaces are given from its barycentre.
    """

    def __init__(self, obj: LabelObject) -> None:
        self._obj = obj
        self.pixel = obj.grid.pixel
        self.exact = not obj.views

    def off(self, points: FloatArray, triangles: IntArray) -> Off:
        """How far a surface is from them."""
        surface = Surface(self._obj.barycentre + points, triangles, self._obj.name)
        try:
            found = label_distance(surface, self._obj)
        except InputError:
            # It has shrunk away from all slices.
            return Off(np.inf, np.inf)
        farthest = max(found.farthest, missed_distance(surface, self._obj) if found.skipped else 0.0)
        return Off(found.nearest / self.pixel, farthest / self.pixel)


class Laid(NamedTuple):
    """An attempt and what it came to.

    Attributes
    ----------
    attempt : FitAttempt
    poor : float
        How many times worse than good it is in triangles and mean distance; infinite for no candidate.
    far : float
        How many times too great its greatest distance is.
    shape : PatchSurface, optional
    placed : Placed, optional
    """

    attempt: FitAttempt
    poor: float = np.inf
    far: float = 0.0
    shape: PatchSurface | None = None
    placed: Placed | None = None

    @property
    def short(self) -> float:
        """How many times worse than good it is at most."""
        return max(self.poor, self.far)


class Laying:
    """Lays a template on a smooth surface.

    Parameters
    ----------
    beginning : str
        Name of the beginning the surface comes from.
    template : TemplateToLay
    yardstick : Yardstick
    estimate : PatchSurface
        The surface the labels most likely come from.
    surface : PatchSurface
        The same, set out by what flat triangles cut off.
    chart : Chart, optional
        A map of it to the sphere that is known.
    """

    def __init__(
        self,
        beginning: str,
        template: TemplateToLay,
        yardstick: Yardstick,
        estimate: PatchSurface,
        surface: PatchSurface,
        chart: Chart | None,
    ) -> None:
        self._beginning, self._template, self._yardstick = beginning, template, yardstick
        self._surface, self._chart = surface, chart
        self._best = yardstick.off(estimate.points, estimate.triangles)
        self._cut = float(np.linalg.norm(surface.points - estimate.points, axis=1).mean()) / yardstick.pixel

    def attempts(self) -> list[Laid]:
        """Every way that was wanted, in order, with what it came to."""
        maps: list[Laid] = []
        for way in LAYING_WAYS:
            if way.wanted != "uneven" or (way.known and self._chart is None):
                continue
            maps.append(self._laid(way))
            if (maps[-1].attempt.least_quality or 0.0) >= ACCEPTANCE.fair:
                break
        # Of these maps the one with the best triangles alone is a candidate.
        best = max(range(len(maps)), key=lambda k: -1.0 if (q := maps[k].attempt.least_quality) is None else q)
        tried = [self._measured(one) if k == best else one for k, one in enumerate(maps)]
        for way in LAYING_WAYS:
            good = min(tried, key=lambda one: one.short)
            # Where the surface itself is too far in some place, no template on it is closer; another surface may be.
            if good.short <= 1.0 or (good.poor <= 1.0 and self._best.greatest > ACCEPTANCE.greatest):
                break
            wanted = way.wanted == "bad" or (way.wanted == "far" and good.far > 1.0)
            if wanted and (not way.redrawn or (self._template.connectivity != "template" and self._in_triangles)):
                tried.append(self._measured(self._laid(way)))
        return tried

    @property
    def _in_triangles(self) -> bool:
        return int(self._template.cells.shape[1]) == 3

    def _laid(self, way: LayingWay) -> Laid:
        """The template laid by a way, its triangles measured."""
        template = self._template
        curvature = max(template.curvature, way.finer)
        placed = (
            remesh(template.directions, self._surface, curvature)
            if way.redrawn
            else place_evenly(
                template.directions,
                template.cells,
                self._surface,
                chart=self._chart if way.known else None,
                connectivity=template.connectivity,
                curvature=curvature,
            )
        )
        quality = -1.0 if placed is None else _quality(placed)
        if placed is None or quality < 0.0:
            status = "no mesh" if placed is None else "folded"
            attempt = FitAttempt(beginning=self._beginning, way=way.name, status=status)
            return Laid(attempt, shape=self._surface, placed=placed)
        mean = float(triangle_quality(placed.points, placed.cells).mean()) if self._in_triangles else None
        record = FitAttempt(
            beginning=self._beginning, way=way.name, status="sound", least_quality=quality, mean_quality=mean
        )
        return Laid(record, shape=self._surface, placed=placed)

    def _measured(self, laid: Laid) -> Laid:
        """The same, measured against the labels and what is accepted."""
        record = laid.attempt
        if laid.placed is None or record.least_quality is None:
            return laid
        off = self._yardstick.off(laid.placed.points, split_quads(laid.placed.cells))
        far = off.short(self._best, self._cut, self._yardstick.exact)
        poor = [ACCEPTANCE.least / max(record.least_quality, 1e-9), far.mean]
        if record.mean_quality is not None:
            poor.append((1.0 - record.mean_quality) / (1.0 - ACCEPTANCE.mean))
        told = record.model_copy(update={"distance_pixels": off.mean, "greatest_pixels": off.greatest})
        return laid._replace(poor=max(poor), far=far.greatest, attempt=told)


def _quality(placed: Placed) -> float:
    """Least Q of a placed template's triangles, -1 where some cross or are folded."""
    triangles = split_quads(placed.cells)
    if placed.folded or not volume(placed.points, triangles) > 0.0:
        return -1.0
    if len(self_intersections(placed.points, triangles)):
        return -1.0
    return float(triangle_quality(placed.points, triangles).min())
