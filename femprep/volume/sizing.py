"""A wall and what is asked of its elements in, the edge length wanted at every place out, on a background mesh.

The edge length is a number, a field given by the user, or follows from the thickness of the wall and the number of
elements asked for through it. It may grow by no more than a given rate from place to place.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from femprep.errors import FileError, InputError
from femprep.mesh.quadratic import edges_of
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.vtk.reading import load
from femprep.model import BoolArray, FloatArray, IntArray, Wall, tag_name
from femprep.options import VolumeOptions

#: A field of edge lengths: a function of points ``(n, 3)``, or points ``(k, 3)`` and the length at each ``(k,)``, mm.
Sizing = Callable[[FloatArray], npt.ArrayLike] | tuple[npt.ArrayLike, npt.ArrayLike]

#: Edge lengths by the thickness over the number of elements. fTetWild's edges are 0.96 of the length asked for on
#: average, and a chain of them runs aslant through the wall.
THROUGH: Final = 1.05
#: Name of the point data that holds edge lengths in a file.
FIELD_NAME: Final = "edge_length"
_SIZING_FILES: Final = (".vti", ".vtu", ".vtp", ".vtk")

#: How much edges grow outside of the body by mm of distance, and how long they become there at most, mm.
_GROWTH: Final = 1.0
LONGEST: Final = 12.0
#: Nodes of the background mesh: most of them, their distance at least, and how far they reach beyond the wall, mm.
_MOST_NODES: Final = 60_000
_LEAST_STEP: Final = 1.5
_MARGIN: Final = 2.0


@dataclass(frozen=True)
class SizingField:
    """Edge lengths on a mesh of tetrahedra that covers the wall.

    Attributes
    ----------
    points : (n, 3) array
        mm.
    tets : (m, 4) array
        Positive.
    values : (n,) array
        Edge length at each point, mm.
    finest, coarsest : float
        Smallest and largest edge length in and next to the wall, mm.
    elements : float
        Tetrahedra of one cubic edge length that fill the wall, the integral of 1 / length^3 over it.
    """

    points: FloatArray
    tets: IntArray
    values: FloatArray
    finest: float
    coarsest: float
    elements: float

    def coarser(self, levels: int) -> SizingField:
        """Lengths of the elements that become these when they are halved so often."""
        times = 2.0**levels
        lengths = times * self.values, times * self.finest, times * self.coarsest
        return SizingField(self.points, self.tets, *lengths, self.elements / times**3)


def grown(values: FloatArray, far: FloatArray, longest: float = LONGEST) -> FloatArray:
    """Edge lengths so far outside of a body, where elements are dropped in the end, by those next to it, mm."""
    return np.maximum(values, np.minimum(values + _GROWTH * far, longest))


def graded(points: FloatArray, tets: IntArray, values: FloatArray, rate: float) -> FloatArray:
    """The largest lengths ``(n,)`` no larger than those given that grow by no more than a rate along edges, mm.

    Parameters
    ----------
    points : (n, 3) array
    tets : (m, 4) array
        Tetrahedra, whose edges between these points count; they may name further points.
    values : (n,) array
        Lengths given.
    rate : float
    """
    ends = edges_of({"tetra": tets}, int(tets.max()) + 1).ends
    one, two = ends[ends[:, 1] < len(points)].T
    growth = rate * np.linalg.norm(points[two] - points[one], axis=1)
    values = values.copy()
    while True:
        before = values.copy()
        np.minimum.at(values, two, before[one] + growth)
        np.minimum.at(values, one, before[two] + growth)
        if np.array_equal(values, before):
            return values


def sizing_field(
    wall: Wall, options: VolumeOptions, sizing: Sizing | None = None, body: Wall | None = None
) -> SizingField | None:
    """Edge lengths in a wall, where they are not the same everywhere; outside of the body they grow.

    Parameters
    ----------
    wall : Wall
        Closed and tagged.
    options : VolumeOptions
        ``elements_through_wall``, ``edge_length`` (the largest edge where both are given), ``sizing`` (a file) and
        ``gradation`` matter here.
    sizing : callable or pair of arrays, optional
        Edge lengths as a function of points ``(n, 3)``, or at points ``(k, 3)`` of which the nearest counts, mm.
    body : Wall, optional
        What is filled; the wall alone if not given.

    Returns
    -------
    SizingField or None
        None where one edge length holds for the whole wall.

    Raises
    ------
    InputError
        The field gives lengths that are not finite and positive, or not one for each point.
    FileError
        The file cannot be read or holds no edge lengths.
    """
    if sizing is None and options.sizing is None and options.elements_through_wall is None:
        return None
    grid = _Grid(wall)
    inside, near, foot = grid.onto(wall)
    asked = _asked(foot, lambda: thickness_at(wall, foot), options, sizing)
    values = graded(grid.points, grid.tets, asked, options.gradation)
    return SizingField(
        grid.points,
        grid.tets,
        grown(values, grid.beyond(body or wall)),
        float(values[near].min()),
        float(values[near].max()),
        float((1.0 / values[inside if inside.any() else near] ** 3).mean() * wall.volume),
    )


def lengths_at(points: FloatArray, thickness: float, options: VolumeOptions, volume: float) -> SizingField:
    """Edge lengths asked for at points spread evenly over a wall not yet made, of a mean thickness, mm; no elements.

    Raises
    ------
    InputError, FileError
        As :func:`sizing_field`.
    """
    values = _asked(points, lambda: thickness, options, None)
    elements = float((1.0 / values**3).mean()) * volume
    none = np.empty((0, 4), dtype=np.int64)
    return SizingField(points, none, values, float(values.min()), float(values.max()), elements)


def _asked(
    points: FloatArray, thickness: Callable[[], FloatArray | float], options: VolumeOptions, sizing: Sizing | None
) -> FloatArray:
    """The smallest of all edge lengths asked for at points where the wall is so thick."""
    if sizing is None and options.sizing is not None:
        sizing = read_sizing(Path(options.sizing))
    values = np.full(len(points), np.inf) if sizing is None else _lengths(sizing, points)
    if options.elements_through_wall is not None:
        values = np.minimum(values, THROUGH * thickness() / options.elements_through_wall)
    return values if options.largest_edge is None else np.minimum(values, options.largest_edge)


def thickness_at(wall: Wall, points: FloatArray) -> FloatArray:
    """Thickness of the wall at points inside it, ``(n,)`` mm: the distances from the two nearest of its sheets, added.

    Sheets are the facets of one tag whose name begins with ``endo`` or ``epi``; in a septum both are endocardia.

    Raises
    ------
    InputError
        The wall has fewer than two sheets.
    """
    tags = [int(t) for t in np.unique(wall.facet_tag) if tag_name(int(t)).startswith(("endo", "epi"))]
    if len(tags) < 2:
        raise InputError(
            "elements through the wall are asked for, but the wall has no two sheets tagged endo... and epi; "
            "give an edge_length instead"
        )
    apart = [ClosestFinder(wall.points, wall.triangles[wall.facet_tag == tag])(points).distance for tag in tags]
    return np.asarray(np.sort(apart, axis=0)[:2].sum(axis=0))


def read_sizing(path: Path) -> tuple[FloatArray, FloatArray]:
    """Points and edge lengths of a VTK file with the point data ``edge_length``, mm.

    Raises
    ------
    FileError
        The file cannot be read, or has no such data.
    """
    import pyvista

    if not path.is_file():
        raise FileError(f"sizing field {str(path)!r} is not there; name a .vti, .vtu, .vtp or .vtk file")
    if path.suffix.lower() not in _SIZING_FILES:  # other files that pyvista reads may hold more than data
        raise FileError(f"sizing field {str(path)!r} is of an unknown format; name a .vti, .vtu, .vtp or .vtk file")
    try:
        data: Any = pyvista.wrap(load(path))
        points, table = np.asarray(data.points, dtype=np.float64), data.point_data
    except Exception as error:
        reason = str(error).strip().splitlines() or [type(error).__name__]
        raise FileError(f"sizing field {str(path)!r} cannot be read: {reason[0]}") from None
    if FIELD_NAME not in table:
        found = ", ".join(table.keys()) or "none"
        raise FileError(f"sizing field {str(path)!r} has no point data {FIELD_NAME!r} (found: {found}); add it, in mm")
    return points, np.asarray(table[FIELD_NAME], dtype=np.float64)


def _lengths(sizing: Sizing, where: FloatArray) -> FloatArray:
    """The user's field at points, checked."""
    if callable(sizing):
        values = np.asarray(sizing(where.copy()), dtype=np.float64)
        expected = (len(where),)
    else:
        points, given = (np.asarray(part, dtype=np.float64) for part in sizing)
        if points.ndim != 2 or points.shape[1:] != (3,) or len(points) == 0 or not np.isfinite(points).all():
            raise InputError(f"points of the sizing field have shape {points.shape}, expected (k, 3), all finite")
        if given.shape != (len(points),):
            raise InputError(f"lengths of the sizing field have shape {given.shape}, expected ({len(points)},)")
        values, expected = given[cKDTree(points).query(where)[1]], (len(where),)
    if values.shape != expected:
        raise InputError(f"the sizing field gives an array of shape {values.shape}, expected {expected}")
    wrong = ~(np.isfinite(values) & (values > 0))
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InputError(
            f"the sizing field gives the edge length {values[row]:g} at {np.round(where[row], 1).tolist()}; "
            "it must be finite and positive, mm"
        )
    return values


class _Grid:
    """A grid of cubes about the wall, each split into six tetrahedra."""

    def __init__(self, wall: Wall) -> None:
        corners = wall.points[np.unique(wall.triangles)]
        low, size = corners.min(axis=0), np.ptp(corners, axis=0)
        step = max(_LEAST_STEP, float(np.cbrt(np.prod(size + 4.0 * _MARGIN) / _MOST_NODES)))
        shape = np.ceil((size + 2.0 * _MARGIN) / step).astype(int) + 1
        start = low + 0.5 * size - 0.5 * step * (shape - 1)
        number = np.arange(int(np.prod(shape))).reshape(shape)
        axes = [start[k] + step * np.arange(shape[k]) for k in range(3)]
        self.points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        cubes = np.stack(
            [
                number[i : shape[0] - 1 + i, j : shape[1] - 1 + j, k : shape[2] - 1 + k].ravel()
                for k, j, i in itertools.product((0, 1), repeat=3)
            ],
            axis=1,
        )
        tets = []
        # Six paths along the edges from corner 0 to corner 7; those of odd order are mirrored.
        for path in itertools.permutations((1, 2, 4)):
            nodes = [0, path[0], path[0] + path[1], 7]
            odd = path in ((1, 4, 2), (2, 1, 4), (4, 2, 1))
            tets.append(cubes[:, [nodes[0], nodes[2], nodes[1], nodes[3]] if odd else nodes])
        self.tets = np.concatenate(tets)
        self._diagonal = np.sqrt(3.0) * step

    def onto(self, wall: Wall) -> tuple[BoolArray, BoolArray, FloatArray]:
        """Which nodes lie in the wall; which in it or within a cube of it; each node, or its closest point of the wall.

        Nodes outside stand for the point of the wall closest to them.
        """
        signed, closest = ClosestFinder(wall.points, wall.triangles).sided(self.points)
        inside = signed < 0.0
        near = inside | (closest.distance <= self._diagonal)
        return inside, near, np.where(inside[:, None], self.points, closest.points)

    def beyond(self, body: Wall) -> FloatArray:
        """How far each node lies outside of a body and of the cubes that it reaches into, mm; 0 in these."""
        signed = ClosestFinder(body.points, body.triangles).signed(self.points)
        return np.asarray(np.maximum(signed - self._diagonal, 0.0))
