"""A smooth surface and a template on it in, the template moved along the surface to even triangles out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.geometry.patches import PatchSurface
from femprep.geometry.topology import volume
from femprep.geometry.triangles import area_vectors, triangle_quality
from femprep.model import FloatArray, IntArray
from femprep.surface.place import Goal, place_evenly, slide_evenly
from femprep.surface.resolved import Resolved
from femprep.surface.shape import HarmonicShape
from femprep.surface.soundness import Faults, find_faults

#: Rounds, each on a mesh of the surface as fine as the last one's vertices let see.
_ROUNDS: Final = 4
#: All end when Q gains less.
_GAIN: Final = 0.01
#: Volume that large triangles may cut off, as a share, before the best round is chosen by it.
_CUT: Final = 0.02
#: Longest edge of the mesh vertices slide on, in edge lengths.
_LONGEST: Final = 1.0
#: How often vertices are led back where moves folded triangles.
_RETREATS: Final = 3


@dataclass(frozen=True, eq=False)
class _State:
    """A template on the surface, and how good it is."""

    directions: FloatArray
    points: FloatArray
    quality: FloatArray
    bad: npt.NDArray[np.bool_]
    faults: Faults
    volume: float

    def cut(self, whole: float) -> float:
        """Share by which the volume differs from the whole one's, beyond what is allowed."""
        return max(0.0, abs(self.volume / whole - 1.0) - _CUT)

    def rank(self, whole: float) -> tuple[float, ...]:
        """Fewer faulty triangles first, then the right volume, a better worst triangle, and better ones."""
        bad = float(np.count_nonzero(self.bad))
        return -bad, -self.cut(whole), float(self.quality.min()), float(self.quality.mean())


def even_out(
    shape: HarmonicShape, directions: FloatArray, cells: IntArray, axes: FloatArray, elements: IntArray | None = None
) -> tuple[FloatArray, FloatArray, dict[str, Any]]:
    """Move a template's vertices along the surface until its triangles are even.

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
    cells : (T, 3) array
        Its triangles.
    axes : (3, 3) array
        Orthogonal columns along which coordinates are taken, so that a turned image gives the same surface, turned.
    elements : (m, 4) array, optional
        Quadrilaterals to be made even in place of the triangles, which they are split into.

    Returns
    -------
    directions : (V, 3) array
        Moved, unit vectors.
    points : (V, 3) array
        ``shape(directions)``, mm LPS.
    info : dict
        ``rounds``; ``q_mean`` and ``q_min`` before and after.
    """
    cells = np.ascontiguousarray(cells)
    elements = cells if elements is None else elements
    begin = best = current = _state(shape, directions, cells)
    rounds = 0
    if begin.faults.lost:
        return begin.directions, begin.points, {"rounds": 0, "q_mean": [0.0, 0.0], "q_min": [0.0, 0.0]}
    whole = 0.0
    for _ in range(_ROUNDS):
        mesh = _resolve(shape, current, cells)
        whole = volume(mesh.points, mesh.cells)
        surface = PatchSurface(mesh.points @ axes, mesh.cells)
        if rounds == 0:
            placed = place_evenly(directions @ axes, elements, surface, current.points @ axes, connectivity="template")
        else:
            placed = slide_evenly(current.points @ axes, elements, Goal(surface, len(elements)), "template")
        rounds += 1
        following = _follow(shape, current, mesh.directions_of(placed.points @ axes.T), cells)
        if following.faults.lost:
            break
        gain = max(following.quality.mean() - current.quality.mean(), following.quality.min() - current.quality.min())
        current = following
        best = max(best, current, key=lambda state: state.rank(whole))
        if gain < _GAIN:
            break
    info = {
        "rounds": rounds,
        "q_mean": [float(state.quality.mean()) for state in (begin, best)],
        "q_min": [float(state.quality.min()) for state in (begin, best)],
    }
    return best.directions, best.points, info


def _state(shape: HarmonicShape, directions: FloatArray, cells: IntArray) -> _State:
    points = shape(directions)
    faults = find_faults(points, cells, shape.field)
    bad = np.zeros(len(cells), dtype=bool)
    bad[faults.triangles] = True
    a, b, c = (directions[cells[:, k]] for k in range(3))
    bad |= np.einsum("ij,ij->i", a, np.cross(b, c)) <= 0.0
    quality = np.zeros(len(cells)) if faults.lost else triangle_quality(points, cells)
    return _State(directions, points, quality, bad, faults, volume(points, cells))


def _resolve(shape: HarmonicShape, state: _State, cells: IntArray) -> Resolved:
    """A mesh of the surface for the vertices to slide on, which come first in it."""
    mean = float(np.linalg.norm(area_vectors(state.points, cells), axis=1).mean())
    return Resolved.of(shape, state.directions, state.points, cells, _LONGEST * _edge(mean))


def _follow(shape: HarmonicShape, state: _State, wanted: FloatArray, cells: IntArray) -> _State:
    """Go to the directions wanted, less far around triangles which that would make faulty."""
    share = np.ones(len(wanted))
    following = _state(shape, wanted, cells)
    for _attempt in range(_RETREATS):
        worse = following.bad & ~state.bad
        if not worse.any():
            break
        share[cells[worse]] = 0.0
        # Softly, over three rings.
        for _ in range(3):
            least = np.minimum(share[cells].min(axis=1) + 1.0 / 3.0, 1.0)
            np.minimum.at(share, cells, np.broadcast_to(least[:, None], cells.shape))
        there = (1.0 - share)[:, None] * state.directions + share[:, None] * wanted
        there /= np.linalg.norm(there, axis=1, keepdims=True)
        following = _state(shape, there, cells)
    return following


def _edge(area: float) -> float:
    """Side of an equilateral triangle."""
    return float(np.sqrt(4.0 * area / np.sqrt(3.0)))
