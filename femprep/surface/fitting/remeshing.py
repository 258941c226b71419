"""A smooth surface in, even triangles drawn on it anew out, their vertices numbered as a template's."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.operations.collapse import collapsed
from femprep.mesh.operations.midpoint_subdivision import midpoint_subdivision
from femprep.mesh.patches import PatchSurface
from femprep.mesh.search.intersection import self_intersections
from femprep.model import FloatArray, IntArray
from femprep.model.products import product
from femprep.surface.fitting.chart import sphere_turned
from femprep.surface.fitting.place import Placed
from femprep.surface.fitting.slide import Goal, Slid, slide_evenly

#: A mesh is drawn from one that has at least so many times as many vertices.
_FINER: Final = 1.5
#: Vertices are matched to the template's by lists of at most this many.
_MATCHED: Final = 600


def remesh(directions: FloatArray, surface: PatchSurface, curvature: float = 0.0) -> Placed | None:
    """Cover a smooth surface with as many even triangles as a template has, without carrying the template there.

    A body with long horns or lobes on thin stems is so far from a ball that no map from the sphere covers it evenly;
    but its own mesh does. Vertices get the numbers of the template's that lie nearest on the sphere, all in all.

    Parameters
    ----------
    directions : (V, 3) array
        The template's vertices, unit vectors.
    surface : PatchSurface
        The smooth surface, closed, of a ball's topology, wound outward.
    curvature : float
        As for :func:`~femprep.surface.fitting.place.place_evenly`.

    Returns
    -------
    Placed
        None where the surface's mesh could not be thinned to so few vertices.
    """
    drawn = even_mesh(surface.points, surface.triangles, surface, len(directions), curvature)
    if drawn is None:
        return None
    sphere = sphere_turned(drawn.points, drawn.cells, directions)
    number = _numbers(directions, sphere)
    cells = np.empty(len(number), dtype=np.int64)
    cells[number] = np.arange(len(number))
    return Placed(
        drawn.points[number],
        drawn.normals[number],
        cells[drawn.cells],
        drawn.steps,
        drawn.flips,
        drawn.folded,
        sphere[number],
    )


def even_mesh(
    points: FloatArray, cells: IntArray, surface: PatchSurface, count: int, curvature: float = 0.0
) -> Slid | None:
    """Even triangles on a smooth surface, drawn from a mesh of it: its short edges are collapsed, the rest slid.

    Parameters
    ----------
    points : (n, 3) array
        Vertices of the mesh, on or near the surface, mm.
    cells : (m, 3) array
        Its triangles.
    surface : PatchSurface
    count : int
        Number of vertices asked for.
    curvature : float
        As for :func:`~femprep.surface.fitting.place.place_evenly`.

    Returns
    -------
    Slid
        None where the mesh could not be thinned to so few vertices.
    """
    while len(points) < _FINER * count:
        _, points, cells = midpoint_subdivision(points, cells)
    found = collapsed(points, cells, surface, count)
    if found is None:
        return None
    points, normals, near, cells = found
    slid = slide_evenly(points, cells, Goal(surface, len(cells), curvature), "free", near)
    if slid.folded or _least(slid.points, slid.cells) < _least(points, cells):
        return Slid(points, normals, cells, 0, 0, 0)
    return slid


def _least(points: FloatArray, cells: IntArray) -> float:
    """Least Q, 0 where triangles cross."""
    if len(self_intersections(points, cells)):
        return 0.0
    return float(triangle_quality(points, cells).min())


def _numbers(directions: FloatArray, sphere: FloatArray) -> IntArray:
    """For each of the template's vertices that of the same number of others on the sphere which stands for it.

    Both are halved across the same axis again and again; the vertices of small parts are matched at the least sum of
    squared distances.
    """
    from scipy.optimize import linear_sum_assignment

    number = np.empty(len(directions), dtype=np.int64)
    parts = [(np.arange(len(directions)), np.arange(len(directions)))]
    while parts:
        mine, theirs = parts.pop()
        if len(mine) <= _MATCHED:
            row, column = linear_sum_assignment(-product(directions[mine], sphere[theirs].T))
            number[mine[row]] = theirs[column]
            continue
        axis = np.argmax(np.ptp(directions[mine], axis=0))
        one = mine[np.argsort(directions[mine, axis], kind="stable")]
        other = theirs[np.argsort(sphere[theirs, axis], kind="stable")]
        half = len(mine) // 2
        parts += [(one[:half], other[:half]), (one[half:], other[half:])]
    return number
