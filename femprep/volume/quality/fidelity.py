"""A finished mesh and the labels it was made from in, how far its facets lie from their outlines in each slice out.

That is what "every check passed" has to mean: each surface may be as good as it gets, and the mesh still leave the
labels by what was done to it since.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from femprep.image import Grid
from femprep.image.boundary import boundary_points
from femprep.image.long_axis import is_stack
from femprep.mesh.plane_sections import plane_sections
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import BoolArray, FloatArray, IntArray, Plane, Surface, VolumeMesh, cutting
from femprep.model.facets import facet_triangles
from femprep.model.notice import spot
from femprep.model.shared_records.label_fidelity import FidelityRecord, SliceFidelity
from femprep.options import CheckOptions
from femprep.surface.measure.inslice import dense
from femprep.surface.measure.sections import label_contours
from femprep.volume.quality.cut_openings import is_cut
from femprep.volume.quality.report import QualityReport
from femprep.volume.quality.verdicts import Verdicts
from femprep.wall.chambers.openings import Opening
from femprep.wall.outlines import Outline

#: Distance of neighbouring samples along an outline, mm.
_STEP: Final = 0.2
#: An outline counts where it lies at least so many pixels within the planes that clip the mesh.
_WITHIN: Final = 1.0
#: A slice lies in such a plane where it is parallel to it and no farther than this, mm: there the rim of the facets is
#: what is measured, by a cut as far inside.
_IN_PLANE: Final = 1e-3
#: An opening is so deep to either side, by its radius.
_DEEP: Final = 0.5


@dataclass(frozen=True, eq=False)
class Fidelity:
    """How far surfaces lie from the outlines of their labels.

    Attributes
    ----------
    records : tuple of FidelityRecord
        One for each surface.
    off : mapping of str to (n, 3) array
        By surface, points of the outlines and of the surface's sections that lie farther from each other than the limit
        given, mm LPS.
    """

    records: tuple[FidelityRecord, ...] = ()
    off: Mapping[str, FloatArray] = field(default_factory=dict)


def mesh_fidelity(mesh: VolumeMesh, outlines: Iterable[Outline], grid: Grid, limit: float | None = None) -> Fidelity:
    """Measure the facets of a finished mesh against the outlines of the labels.

    In the middle plane of each slice the facets' section and the labels' outline are sampled; a distance is that of a
    sample of one to the nearest sample of the other, both ways; in about cubic voxels to the facets, and to the labels'
    boundary in all directions. Where facets belong to several bodies, as an epicardium around two ventricles, it is
    taken from the outline to the facets only.

    Parameters
    ----------
    mesh : VolumeMesh
        With facet tags. Outlines beyond its planes and in openings that were cut do not count; an opening that was left
        closed does, whatever others of its name were cut.
    outlines : iterable of Outline
    grid : Grid
        Of the label map, whose slices are counted.
    limit : float, optional
        Distance in pixels beyond which points are listed.

    Returns
    -------
    Fidelity
    """
    names = mesh.facet_names
    followed = (
        replace(one, openings=tuple(opening for opening in one.openings if is_cut(opening, mesh)))
        for one in outlines
        if one.facets in names
    )
    return _gather(
        ((one.facets, mesh.points, facet_triangles(mesh, one.facets), one) for one in followed),
        mesh.planes,
        grid,
        limit,
    )


def surface_fidelity(
    surfaces: Mapping[str, Surface], outlines: Iterable[Outline], grid: Grid, planes: Mapping[str, Plane] | None = None
) -> Fidelity:
    """Measure closed surfaces against the outlines of what they ought to follow.

    Parameters
    ----------
    surfaces : mapping
        By the names of the outlines' facets.
    outlines : iterable of Outline
    grid : Grid
        Of the label map, whose slices are counted.
    planes : mapping of str to Plane, optional
        By facet name. Outlines beyond them do not count.

    Returns
    -------
    Fidelity
    """
    jobs = ((one.facets, surfaces[one.facets], one) for one in outlines)
    return _gather(((name, found.points, found.triangles, one) for name, found, one in jobs), planes or {}, grid, None)


def judge_fidelity(records: Iterable[FidelityRecord], options: CheckOptions) -> Verdicts:
    """Compare distances to the labels with their limits."""
    held = Verdicts()
    for record in records:
        what = f"{record.surface} against the labels of {record.labels}"
        for name, value, limit in (
            ("mean_label_distance", record.mean_pixels, options.mean_label_distance),
            ("maximum_label_distance", record.greatest_pixels, options.maximum_label_distance),
        ):
            if limit is None or not held.misses(f"{record.surface}_{name}", "at most", limit, value):
                continue
            if name == "mean_label_distance":
                held.failures.append(
                    f"{what}: {value:.2f} pixels ({record.mean_mm:.2f} mm) from their outlines in the mean over "
                    f"slices, asked for is at most {limit:g}"
                )
                continue
            off = sorted((one for one in record.slices if one.greatest_pixels > limit), key=lambda s: -s.greatest_mm)
            worst, others = off[0], ", ".join(str(one.slice) for one in sorted(off[1:], key=lambda s: s.slice))
            held.failures.append(
                f"{what}: {value:.1f} pixels ({worst.greatest_mm:.1f} mm) from the outline in slice {worst.slice} at "
                f"{spot(worst.at_mm)}"
                + (f", beyond the limit also in slices {others}" if others else "")
                + f"; asked for is at most {limit:g}"
            )
    return held


def with_fidelity(report: QualityReport, found: Fidelity, help_: Iterable[str] = ()) -> QualityReport:
    """A quality report that holds the distances to the labels too, and its verdict; lines of help follow a failure."""
    held = judge_fidelity(found.records, report.options)
    if held.failures:
        held.failures += help_
    return held.on(report, fidelity=found.records)


def _gather(
    jobs: Iterable[tuple[str, FloatArray, IntArray, Outline]],
    planes: Mapping[str, Plane],
    grid: Grid,
    limit: float | None,
) -> Fidelity:
    records: list[FidelityRecord] = []
    off: dict[str, FloatArray] = {}
    for name, points, triangles, outline in jobs:
        pixel = outline.obj.grid.drawn_pixel or outline.obj.grid.pixel
        slices = _slices(points, triangles, outline, list(cutting(outline.facets, planes).values()), grid)
        if not slices:
            continue
        records.append(_record(name, outline.obj.name, pixel, slices))
        if limit is not None:
            beyond = [one.points[one.distance > limit * pixel] for one in slices]
            off[name] = np.concatenate([off.get(name, np.empty((0, 3))), *beyond])
    return Fidelity(tuple(records), off)


@dataclass(frozen=True, eq=False)
class _Slice:
    """Samples of both curves in one slice, how far each is from the other curve, how many are of the outline."""

    number: int
    points: FloatArray
    distance: FloatArray
    outline: int
    missed: bool

    @property
    def mean(self) -> float:
        """Mean of both ways, mm."""
        ways = [self.distance[: self.outline], self.distance[self.outline :]]
        return float(np.mean([way.mean() for way in ways if len(way)]))


def _slices(
    points: FloatArray, triangles: IntArray, outline: Outline, planes: Sequence[Plane], grid: Grid
) -> list[_Slice]:
    """Every slice in which the object has an outline within the planes."""
    margin = _WITHIN * outline.obj.grid.pixel
    middles, contours = label_contours(outline.obj)
    near = [ClosestFinder(surface.points, surface.triangles) for surface in outline.beside]
    finder = ClosestFinder(points, triangles)
    # Where slices are as thin as pixels an end of the surface is nearly parallel to them: distances are those in space.
    space = None if is_stack(outline.obj.grid) else cKDTree(boundary_points(outline.obj).points)
    found = []
    for middle, loops in zip(middles, contours):
        number = round(float(grid.to_index(middle.point[None])[0, grid.stack_axis]))
        curve, kept = dense(loops, _STEP), None
        for plane in planes:
            away = plane.signed_distance(curve)
            if np.abs(away).max() < _IN_PLANE:
                middle = Plane(middle.point - _IN_PLANE * plane.normal, middle.normal)
            else:
                kept = _both(kept, away < -margin)
        for opening in outline.openings:
            kept = _both(kept, _clear_of(opening, curve, margin))
        for neighbour in near:
            kept = _both(kept, neighbour(curve).distance > outline.clear)
        inside = curve if kept is None else curve[kept]
        if not len(inside):
            continue
        sections = plane_sections(points, triangles, [middle])[0]
        if not sections:
            found.append(_Slice(number, inside, finder(inside).distance, len(inside), True))
            continue
        section = dense(sections, _STEP)
        there = finder(inside).distance if space else np.asarray(cKDTree(section).query(inside)[0])
        if near:
            found.append(_Slice(number, inside, there, len(inside), False))
            continue
        back = cKDTree(curve).query(section)[0]
        back = np.minimum(back, space.query(section)[0]) if space else back
        both = np.concatenate([inside, section]), np.concatenate([there, back])
        found.append(_Slice(number, *both, len(inside), False))
    return found


def _clear_of(opening: Opening, points: FloatArray, margin: float) -> BoolArray:
    """Whether points lie beside an opening, whose rim need not be flat, and not in it."""
    along = opening.plane.signed_distance(points)
    across = np.linalg.norm(points - opening.plane.point - along[:, None] * opening.plane.normal, axis=1)
    beside = (across > opening.radius + margin) | (np.abs(along) > _DEEP * opening.radius)
    return np.asarray(beside, dtype=np.bool_)


def _both(first: BoolArray | None, second: BoolArray) -> BoolArray:
    return second if first is None else first & second


def _record(name: str, labels: str, pixel: float, slices: list[_Slice]) -> FidelityRecord:
    rows = []
    for one in slices:
        worst = int(one.distance.argmax())
        x, y, z = (round(float(c), 2) for c in one.points[worst])
        mean, greatest = one.mean, float(one.distance[worst])
        rows.append(
            SliceFidelity(
                slice=one.number,
                mean_mm=mean,
                greatest_mm=greatest,
                mean_pixels=mean / pixel,
                greatest_pixels=greatest / pixel,
                at_mm=(x, y, z),
                missed=one.missed,
            )
        )
    return FidelityRecord(
        surface=name,
        labels=labels,
        pixel_mm=pixel,
        mean_mm=float(np.mean([row.mean_mm for row in rows])),
        greatest_mm=max(row.greatest_mm for row in rows),
        mean_pixels=float(np.mean([row.mean_pixels for row in rows])),
        greatest_pixels=max(row.greatest_pixels for row in rows),
        slices=tuple(rows),
    )
