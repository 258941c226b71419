"""A smooth surface and a template on it in, the template moved along the surface to even triangles out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from femprep.mesh.measures.triangles import areas, triangle_quality
from femprep.mesh.operations.step_back import hold_back
from femprep.mesh.operations.stretch_subdivision import Resolved
from femprep.mesh.patches import PatchSurface
from femprep.mesh.topology import volume
from femprep.model import BoolArray, FloatArray, IntArray, split_quads
from femprep.model.products import product, unit_vectors
from femprep.surface.fitting.chart import Chart
from femprep.surface.fitting.slide import Connectivity, Goal, slide_evenly
from femprep.surface.fitting.ways import ACCEPTANCE
from femprep.surface.harmonic.shape import HarmonicShape
from femprep.surface.harmonic.soundness import Faults, find_faults

#: Rounds, each on a mesh of the surface as fine as the last one's vertices let see.
_ROUNDS: Final = 4
#: All end when the map from the sphere brings vertices to where they should be, by Q, or when Q gains less.
_GAIN: Final = 0.01
#: Longest edge of the mesh vertices slide on, in edge lengths.
_LONGEST: Final = 1.0
#: How often vertices are led back where moves folded triangles.
_RETREATS: Final = 3


@dataclass(frozen=True, eq=False)
class Evened:
    """A template on the surface.

    Attributes
    ----------
    directions : (V, 3) array
        Its vertices, moved, unit vectors.
    points : (V, 3) array
        ``shape(directions)``, mm LPS.
    cells : (m, 3) or (m, 4) array
        Its cells, or others on the same vertices.
    least_quality : float
        Least Q of the triangles.
    info : dict
        ``rounds``; ``q_mean`` and ``q_min`` of the triangles before and after; ``flipped``, whether edges were.
    """

    directions: FloatArray
    points: FloatArray
    cells: IntArray
    least_quality: float
    info: dict[str, Any]


@dataclass(frozen=True, eq=False)
class _State:
    """A template on the surface, and how good it is."""

    directions: FloatArray
    points: FloatArray
    cells: IntArray
    triangles: IntArray
    quality: FloatArray
    bad: BoolArray
    faults: Faults
    volume: float

    def cut(self, whole: float) -> float:
        """Share by which the volume differs from the whole one's, beyond what is allowed."""
        return max(0.0, abs(self.volume / whole - 1.0) - ACCEPTANCE.cut)

    def rank(self, whole: float) -> tuple[float, ...]:
        """Fewer faulty triangles first, then the right volume, a better worst triangle, and better ones."""
        bad = float(len(self.faults.triangles))
        return -bad, -self.cut(whole), float(self.quality.min()), float(self.quality.mean())


def even_out(
    shape: HarmonicShape,
    directions: FloatArray,
    cells: IntArray,
    axes: FloatArray,
    connectivity: Connectivity = "template",
    curvature: float = 0.0,
) -> Evened:
    """Move a template's vertices along the surface until its cells are even.

    The smooth surface is meshed as finely as its map from the sphere asks for, and the template is placed on that mesh
    anew; its vertices' new places on the sphere go through the map, so that they lie on the surface exactly. On a mesh
    of the surface made from those they slide once more, until triangles gain no more. Rounds that would fold
    triangles are led back there, and the best round is kept.

    Parameters
    ----------
    shape : HarmonicShape
        The surface.
    directions : (V, 3) array
        The template's vertices, unit vectors.
    cells : (m, 3) or (m, 4) array
        Its triangles or quadrilaterals.
    axes : (3, 3) array
        Orthogonal columns along which coordinates are taken, so that a turned image gives the same surface, turned.
    connectivity, curvature
        As for :func:`~femprep.surface.fitting.place.place_evenly`.
    """
    cells = np.ascontiguousarray(cells)
    begin = best = current = _state(shape, directions, cells)
    rounds = 0
    if begin.faults.lost:
        return Evened(directions, begin.points, cells, 0.0, {"rounds": 0, "q_mean": [0.0, 0.0], "q_min": [0.0, 0.0]})
    for _ in range(_ROUNDS):
        mesh = _resolve(shape, current)
        whole = volume(mesh.points, mesh.cells)
        surface = PatchSurface(product(mesh.points, axes), mesh.cells)
        goal = Goal(surface, len(cells), curvature)
        start = product(current.points, axes)
        if rounds == 0:
            start = Chart.of(goal, product(directions, axes), start).points_at(product(directions, axes))
        slid = slide_evenly(start, current.cells, goal, connectivity)
        following = _follow(shape, current, mesh.directions_of(product(slid.points, axes.T)), slid.cells)
        if following.faults and rounds == 0:
            # Patches on a mesh that the field's map stretches much are rough: a better mesh comes before sliding.
            unslid = _follow(shape, current, mesh.directions_of(product(start, axes.T)), cells)
            following = min(following, unslid, key=lambda state: len(state.faults.triangles))
        rounds += 1
        if following.faults.lost:
            break
        wanted = triangle_quality(slid.points, split_quads(slid.cells))
        near = abs(following.quality.mean() - wanted.mean()) < _GAIN and following.quality.min() > max(
            0.95 * wanted.min(), ACCEPTANCE.least
        )
        gain = max(following.quality.mean() - current.quality.mean(), following.quality.min() - current.quality.min())
        current = following
        best = max(best, current, key=lambda state: state.rank(whole))
        if near or (gain < _GAIN and rounds > 1):
            break
    info = {
        "rounds": rounds,
        "q_mean": [float(state.quality.mean()) for state in (begin, best)],
        "q_min": [float(state.quality.min()) for state in (begin, best)],
        "flipped": not np.array_equal(best.cells, cells),
    }
    return Evened(best.directions, best.points, best.cells, float(best.quality.min()), info)


def _state(shape: HarmonicShape, directions: FloatArray, cells: IntArray) -> _State:
    points, triangles = shape(directions), split_quads(cells)
    faults = find_faults(points, triangles, shape.field)
    bad = np.zeros(len(triangles), dtype=bool)
    bad[faults.triangles] = True
    a, b, c = (directions[triangles[:, k]] for k in range(3))
    bad |= np.einsum("ij,ij->i", a, np.cross(b, c)) <= 0.0
    quality = np.zeros(len(triangles)) if faults.lost else triangle_quality(points, triangles)
    return _State(directions, points, cells, triangles, quality, bad, faults, volume(points, triangles))


def _resolve(shape: HarmonicShape, state: _State) -> Resolved:
    """A mesh of the surface for the vertices to slide on, which come first in it."""
    mean = float(areas(state.points, state.triangles).mean())
    return Resolved.of(shape, state.directions, state.points, state.triangles, _LONGEST * _edge(mean))


def _follow(shape: HarmonicShape, state: _State, wanted: FloatArray, cells: IntArray) -> _State:
    """Go to the directions wanted, less far around triangles which that would make faulty."""
    following = _state(shape, wanted, cells)
    if not np.array_equal(cells, state.cells):
        return following
    share = np.ones(len(wanted))
    for _attempt in range(_RETREATS):
        worse = following.bad & ~state.bad
        if not worse.any():
            break
        share[state.triangles[worse]] = 0.0
        hold_back(share, state.triangles, 1.0 / 3.0)
        there = (1.0 - share)[:, None] * state.directions + share[:, None] * wanted
        following = _state(shape, unit_vectors(there), cells)
    return following


def _edge(area: float) -> float:
    """Side of an equilateral triangle."""
    return float(np.sqrt(4.0 * area / np.sqrt(3.0)))
