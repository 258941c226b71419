"""A smooth surface and a template on it in, the template moved along the surface to even triangles out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.geometry.patches import PatchSurface
from femprep.geometry.topology import volume
from femprep.geometry.triangles import area_vectors, triangle_quality
from femprep.model import FloatArray, IntArray
from femprep.surface.evening import sweep
from femprep.surface.resolved import Resolved
from femprep.surface.shape import HarmonicShape
from femprep.surface.soundness import Faults, find_faults

#: Rounds, each with a mesh of the surface as fine as the last one's vertices let see; sweeps in each.
_ROUNDS: Final = 5
_SWEEPS: Final = 40
#: A round ends when no vertex moves farther than this, in edge lengths; all end when Q gains less.
_STILL: Final = 0.02
_GAIN: Final = 0.01
#: What a triangle's area counts beside its shape; more, by this factor, where large triangles would cut corners.
_SIZE: Final = 0.2
_MORE: Final = 4.0
#: Volume that large triangles may cut off, as a share.
_CUT: Final = 0.01
#: Longest edge of the mesh vertices slide on, in edge lengths.
_LONGEST: Final = 1.5
#: Folded by less than this, in mean areas, a triangle is unfolded as one that is.
_FLAT: Final = 1e-3
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
    shape: HarmonicShape, directions: FloatArray, cells: IntArray, axes: FloatArray
) -> tuple[FloatArray, FloatArray, dict[str, Any]]:
    """Move a template's vertices along the surface until its triangles are even.

    The smooth surface is meshed as finely as its map from the sphere asks for; on that the vertices slide, which is
    cheap, to a minimum of a measure of their triangles; their new places on the sphere go through the map, so that
    they lie on the surface exactly. Rounds that would fold triangles are led back there, and the best round is kept,
    so that neither the number of faulty triangles nor the worst triangle gets worse.

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
    begin = best = current = _state(shape, directions, cells)
    rounds = 0
    if begin.faults.lost:
        return begin.directions, begin.points, {"rounds": 0, "q_mean": [0.0, 0.0], "q_min": [0.0, 0.0]}
    size, whole = _SIZE, 0.0
    for _ in range(_ROUNDS):
        rounds += 1
        mesh = _resolve(shape, current, cells)
        whole = whole or volume(mesh.points, mesh.cells)
        following = _follow(shape, current, _slide(mesh, cells, axes, len(directions), size), cells)
        if following.faults.lost:
            break
        if following.cut(whole) > max(current.cut(whole), 0.0):
            size *= _MORE
            continue
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


def _slide(mesh: Resolved, cells: IntArray, axes: FloatArray, count: int, size: float) -> FloatArray:
    """Directions the vertices should have, after sweeps on a mesh of the surface."""
    area = float(np.linalg.norm(area_vectors(mesh.points, mesh.cells), axis=1).sum() / len(cells))
    mesh = replace(mesh, points=np.ascontiguousarray(mesh.points @ axes))
    surface = PatchSurface(mesh.points, mesh.cells)
    points, normal, near = surface.settle(mesh.points[:count], np.arange(count))
    order = np.argsort(cells.ravel(), kind="stable")
    starts = np.searchsorted(cells.ravel()[order], np.arange(count + 1)).astype(np.int64)
    incident = (order // 3).astype(np.int64)
    planes, moved = np.zeros((0, 4)), np.empty(count)
    for _ in range(_SWEEPS):
        up = normal[cells].sum(axis=1)
        up /= np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-300)
        worst = float(np.einsum("ij,ij->i", area_vectors(points, cells), up).min()) / area
        # As far from the barrier as the worst triangle asks for (Escobar et al.).
        delta = 0.0 if worst > _FLAT else float(np.sqrt(_FLAT * (_FLAT - worst))) + 0.02
        sweep(
            points,
            normal,
            near,
            surface.arrays,
            cells,
            starts,
            incident,
            planes,
            area,
            _SIZE,
            delta,
            _edge(area),
            moved,
        )
        if moved.max() < _STILL * _edge(area):
            break
    return mesh.directions_of(points)


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
