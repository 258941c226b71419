"""A LabelObject and a rough mesh of it in, the smooth surface its labels most likely come from out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from femprep.geometry.closest import ClosestFinder
from femprep.geometry.patches import PatchSurface
from femprep.geometry.triangles import areas, vertex_normals
from femprep.model import FloatArray, IntArray
from femprep.surface.estimate.curvature import Curvature
from femprep.surface.estimate.evidence import Evidence

#: Weight of the change of curvature against the labels, mm^4, in each round: a stiff surface first.
_STIFFNESS: Final = (30000.0, 10000.0, 3000.0, 1000.0, 1000.0, 1000.0, 1000.0, 1000.0)
#: Curvature may change by this, 1/mm2, before an edge is taken for one; in rounds from this one on, and least weight.
_USUAL: Final = 0.005
_EDGES: Final = 3
_LEAST: Final = 0.05
#: A vertex moves no farther than this in one round, mm.
_STEP: Final = 2.0
#: Rings of vertices that are held back with one that would, each by this power of the share of the one before.
_RINGS: Final = 8
_SOFT: Final = 0.8
#: A voxel centre on the wrong side of the surface counts by its distance over this, mm.
_WRONG: Final = 0.4
#: Share of the weight of faces between slices and at the ends: neighbouring ones err by the same.
_BETWEEN: Final = (0.3, 0.1)
#: Least squared cosine between a face's axis and the surface's normal: what the surface bends within half a voxel is
#: not known.
_OBLIQUE: Final = 0.02
#: Principal curvatures are not followed beyond this, 1/mm.
_SHARPEST: Final = 0.2
#: Passes of spreading vertices along the surface after each round.
_SPREAD: Final = 5


def estimate_surface(points: FloatArray, triangles: IntArray, evidence: Evidence) -> PatchSurface:
    """Bend a rough mesh to the surface the labels most likely come from.

    Sought is the surface whose mean curvature varies least (the integral of its squared gradient) and that passes the
    voxel faces at the boundary within what they leave open; where curvature changes sharply, as at the rim of a valve,
    change counts less. A face tells the surface's place along its own axis only,
    to half a voxel; across the surface that is less the more oblique it is, so that a step in a slice's outline is
    known much better than a straight run along the pixels, and a face between slices tells little. Voxel centres
    must lie on their own side. The surface bends to a minimum by Gauss and Newton: in each round the vertices
    move along their normals by what solves a sparse linear system.

    Parameters
    ----------
    points : (n, 3) array
        Vertices of a closed mesh near the object's surface, in the coordinates of the evidence, mm.
    triangles : (m, 3) array
        Wound outward.
    evidence : Evidence
        What the labels say.

    Returns
    -------
    PatchSurface
        The surface, in the coordinates of the evidence.
    """
    points = np.array(points, dtype=np.float64)
    for number, stiffness in enumerate(_STIFFNESS):
        if number:
            points = spread(points, triangles, _SPREAD)
        points += _bend(points, triangles, evidence, stiffness, number >= _EDGES)
    return PatchSurface(points, triangles)


def _bend(points: FloatArray, triangles: IntArray, evidence: Evidence, stiffness: float, edges: bool) -> FloatArray:
    """One round: moves ``(n, 3)`` of the vertices along their normals, mm; sharp edges spared or not."""
    from scipy.sparse.linalg import splu

    shape = Curvature.of(points, triangles, _SHARPEST)
    finder = ClosestFinder(points, triangles)
    faces = _Feet.of(evidence.faces, finder, shape.normals)
    along = faces.normal[np.arange(len(faces.normal)), evidence.axis] ** 2
    share = np.where(evidence.end, _BETWEEN[1], np.where(evidence.between, _BETWEEN[0], 1.0))
    # Even over the voxel: variance of a twelfth.
    weight = share * 12.0 / (evidence.spacing**2 * (along + _OBLIQUE))
    centres = _Feet.of(evidence.centres, finder, shape.normals)
    wrong = np.where((centres.height < 0.0) == evidence.outside, 1.0 / _WRONG**2, 0.0)
    matrix, right = faces.normal_equations(weight, len(points))
    more, also = centres.normal_equations(wrong, len(points))
    bent = shape.lenient(_USUAL, _LEAST) if edges else shape.stiffness
    energy = shape.change.T @ bent @ shape.change
    slope = shape.change.T @ (bent @ shape.mean)
    whole = (matrix + more + stiffness * energy).tocsc()
    solver = splu(whole, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    move = solver.solve(right + also - stiffness * slope)
    return np.asarray((move * _held_back(move, triangles))[:, None] * shape.normals)


def _held_back(move: FloatArray, triangles: IntArray) -> FloatArray:
    """Share ``(n,)`` of their moves that vertices make so that none goes too far; it changes little between neighbours.

    Moves cut off one by one would dent the surface.
    """
    share = np.minimum(1.0, _STEP / np.maximum(np.abs(move), _STEP))
    for _ in range(_RINGS):
        least = share[triangles].min(axis=1)
        np.minimum.at(share, triangles, np.broadcast_to(least[:, None] ** _SOFT, triangles.shape))
    return share


@dataclass(frozen=True, eq=False)
class _Feet:
    """Points and the closest ones of a mesh: corners and weights of these, unit normals, heights over the mesh."""

    corners: IntArray
    weights: FloatArray
    normal: FloatArray
    height: FloatArray

    @classmethod
    def of(cls, queries: FloatArray, finder: ClosestFinder, normals: FloatArray) -> _Feet:
        found = finder(queries)
        corners = finder.triangles[found.triangle]
        normal = np.einsum("qi,qik->qk", found.weights, normals[corners])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return cls(corners, found.weights, normal, np.einsum("qk,qk->q", queries - found.points, normal))

    def normal_equations(self, weight: FloatArray, count: int) -> tuple[Any, FloatArray]:
        """Matrix and right side of the weighted least squares fit of vertex moves to the heights."""
        from scipy.sparse import coo_matrix

        value = weight[:, None, None] * self.weights[:, :, None] * self.weights[:, None, :]
        row, column = (
            np.broadcast_to(c, value.shape).ravel() for c in (self.corners[:, :, None], self.corners[:, None])
        )
        matrix = coo_matrix((value.ravel(), (row, column)), shape=(count, count)).tocsr()
        pull = (weight * self.height)[:, None] * self.weights
        right = np.bincount(self.corners.ravel(), weights=pull.ravel(), minlength=count)
        return matrix, np.asarray(right, dtype=np.float64)


def spread(points: FloatArray, triangles: IntArray, passes: int) -> FloatArray:
    """Move vertices ``(n, 3)`` along the surface to the middle of their neighbours, larger triangles drawing more."""
    from scipy.sparse import coo_matrix

    count = len(points)
    ends = np.concatenate([triangles, np.roll(triangles, -1, axis=1)]).T.reshape(-1)
    other = np.concatenate([np.roll(triangles, -1, axis=1), triangles]).T.reshape(-1)
    around = coo_matrix((np.full(len(ends), 0.5), (ends, other)), shape=(count, count)).tocsr()
    for _ in range(passes):
        size = np.bincount(triangles.ravel(), weights=np.repeat(areas(points, triangles), 3), minlength=count)
        middle = (around @ (points * size[:, None])) / (around @ size)[:, None]
        normal = vertex_normals(points, triangles)
        off = middle - points
        points = points + 0.7 * (off - np.einsum("ij,ij->i", off, normal)[:, None] * normal)
    return points
