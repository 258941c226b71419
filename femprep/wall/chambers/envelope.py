"""Closed surfaces, each with a thickness, in; the smooth surface of the body that encloses them all out.

Where labels give no wall of a chamber (the right ventricle of short-axis maps), the epicardium is that of the left
ventricle joined to the chamber grown by a wall thickness. Distances are exact, from the fitted surfaces and not from
voxels, so that thick slices make no thick wall; the join only ever adds tissue, so that no wall is thinner than asked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femprep.errors import StageError
from femprep.image.grid import Grid
from femprep.image.object import LabelObject, make_object
from femprep.image.solid import PADDING
from femprep.mesh.measures.triangles import normals, vertex_normals
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.search.intersection import self_intersections
from femprep.mesh.topology import edge_table, neighbour_mean
from femprep.model import BoolArray, FloatArray, Surface
from femprep.model.notice import spot
from femprep.model.products import product, unit_vectors
from femprep.options.advice import MORE_VERTICES

#: Voxels of the grid the body is sampled on, along its longest side; their least size, mm.
_ALONG, _FINEST = 56, 1.5
#: Voxels along the side of a block that is measured at its middle first.
_BLOCK = 4
#: Newton steps to the surface, and the least slope they trust.
_STEPS, _FLAT = 8, 0.3
#: Where those steps have not come within this of the surface, it is looked for along the normal: so far, by such steps,
#: then by so many halvings; mm.
_NEAR, _SEARCH, _SEARCH_STEP, _HALVINGS = 1e-3, 6.0, 0.25, 20
#: Width over which the edge of what fills a groove is rounded, mm.
_FILLET = 2.0
#: A groove is where two chambers lie this near to the outline that bridges it, and what is so far around, mm: elsewhere
#: the outline, which is no better than the voxels it was made on, fills nothing.
_BESIDE, _AROUND = 5.0, 6.0
#: Least cosine between the normal of a triangle and that of the body.
_UPRIGHT = 0.2
#: Rounds in which vertices are spread evenly along the surface, and share of the way each goes.
_ROUNDS, _RELAX = 10, 0.5


@dataclass(frozen=True)
class Part:
    """A closed surface to be enclosed.

    Attributes
    ----------
    surface : Surface
    thickness : float
        Least distance of the enclosing surface from it, mm; negative: it may come as far within.
    blend : float
        Width over which the join with the parts before it is rounded, mm: it adds up to a quarter of that.
    """

    surface: Surface
    thickness: float
    blend: float

    @property
    def chamber(self) -> str:
        """The chamber it bounds, by its name: ``lv`` of ``lv`` and of ``lv_epi``."""
        return self.surface.name.split("_")[0]


class Envelope:
    """The body that encloses closed surfaces, each grown by a thickness, with rounded joins.

    It is where the field f is negative: the signed distances of the parts less their thickness, joined one after the
    other by the smooth minimum ``min(a, b) - max(k - |a - b|, 0)^2 / 4k`` with k the blend [1]_, which never exceeds
    the minimum: every point within the thickness of a part lies inside.

    Parameters
    ----------
    parts : sequence of Part
        The blend of the first is not used.
    fill : Part, optional
        What fills the grooves of the body, and nothing else of it.

    References
    ----------
    .. [1] Quilez, Smooth minimum, https://iquilezles.org/articles/smin (the quadratic polynomial one).

    Examples
    --------
    >>> from femprep.wall.chambers.envelope import Part
    >>> body = fp.Envelope([Part(endo, 3.0, 1.0)])
    >>> bool(body.values(endo.points).max() < 0.0)
    True
    """

    def __init__(self, parts: Sequence[Part], fill: Part | None = None) -> None:
        self.parts = tuple(parts)
        self.fill = fill
        every = [part.surface for part in (*self.parts, *([] if fill is None else [fill]))]
        self._finders = [ClosestFinder(surface.points, surface.triangles) for surface in every]
        self._normals = [vertex_normals(surface.points, surface.triangles) for surface in every]
        self._grooves = None if fill is None else self._between(fill.surface.points)

    def values(self, points: FloatArray) -> FloatArray:
        """The field at points ``(n, 3)``, mm: negative inside; it changes by no more than the way between points.

        Examples
        --------
        >>> from femprep.wall.chambers.envelope import Part
        >>> body = fp.Envelope([Part(endo, 3.0, 1.0)])
        >>> bool(body.values(endo.points).max() < 0.0)
        True
        """
        return self.with_gradients(points)[0]

    def with_gradients(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The field ``(n,)`` and its gradient ``(n, 3)``.

        Examples
        --------
        >>> from femprep.wall.chambers.envelope import Part
        >>> body = fp.Envelope([Part(endo, 3.0, 1.0)])
        >>> value, gradient = body.with_gradients(epi.points)
        >>> gradient.shape == epi.points.shape
        True
        """
        value, gradient = self._part(0, self.parts[0], points)
        for number, part in enumerate(self.parts[1:], 1):
            found = self._part(number, part, points, value + part.blend)
            value, gradient = _joined((value, gradient), found, part.blend)
        if self.fill is None or self._grooves is None:
            return value, gradient
        outline, slope = self._part(len(self.parts), self.fill, points, value + self.fill.blend)
        away, nearest = self._grooves.query(points)
        beyond = (away - _AROUND > outline)[:, None]
        outward = (points - self._grooves.data[nearest]) / np.maximum(away, 1e-9)[:, None]
        filling = np.maximum(outline, away - _AROUND), np.where(beyond, outward, slope)
        return _joined((value, gradient), filling, self.fill.blend)

    def _between(self, outline: FloatArray) -> Any:
        """Tree of the points of an outline that lie over grooves between two chambers, None where there are none."""
        from scipy.spatial import cKDTree

        nearest: dict[str, FloatArray] = {}
        for number, part in enumerate(self.parts):
            value = self._part(number, part, outline)[0]
            nearest[part.chamber] = np.minimum(value, nearest.get(part.chamber, np.inf))
        over = outline[(np.stack(list(nearest.values())) < _BESIDE).sum(axis=0) > 1]
        return cKDTree(over) if len(over) else None

    def _part(
        self, number: int, part: Part, points: FloatArray, most: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Field of a part and its gradient; infinity and 0 where it is more than ``most``, which changes no join."""
        finder = self._finders[number]
        within = None
        if most is not None:
            low, high = finder.points.min(axis=0), finder.points.max(axis=0)
            outside = ((points < low) | (points > high)).any(axis=1)
            within = np.where(outside, np.maximum(most + part.thickness + _NEAR, 0.0), np.inf)
        signed, near = finder.sided(points, within)
        away = points - near.points
        normal = unit_vectors(near.at(self._normals[number]))
        # On the surface itself the way to the nearest point has no direction: the normal there serves.
        far = near.distance > 1e-6
        gradient = np.where(far[:, None], away / np.where(far, signed, 1.0)[:, None], normal)
        return signed - part.thickness, gradient

    def object(self, like: Grid, name: str) -> LabelObject:
        """The body as voxels of a fine isotropic grid along the axes of another one.

        Examples
        --------
        >>> from femprep.wall.chambers.envelope import Part
        >>> body = fp.Envelope([Part(endo, 3.0, 1.0)])
        >>> body.object(seg.grid, "grown").volume > cavity.volume
        True
        """
        axes = like.direction / np.linalg.norm(like.direction, axis=0)
        corners = product(np.concatenate([part.surface.points for part in self.parts]), axes)
        room = max(part.thickness for part in self.parts) + max(part.blend for part in self.parts)
        low, high = corners.min(axis=0) - room, corners.max(axis=0) + room
        voxel = max(_FINEST, float((high - low).max()) / _ALONG)
        # As far from one end as from the other, so that it does not matter along which axes the image is stored.
        count = np.ceil((high - low) / voxel - 1e-9).astype(int) + 2 * PADDING
        i, j, k = (int(n) for n in count)
        first = 0.5 * (low + high - (count - 1) * voxel)
        grid = Grid((i, j, k), np.full(3, voxel), product(first, axes.T), axes)
        return make_object(self._inside(grid), grid, name)

    def _inside(self, grid: Grid) -> BoolArray:
        """Which voxels of a grid lie inside; only those near the surface are measured themselves."""
        index = np.stack(np.meshgrid(*(np.arange(n) for n in grid.shape), indexing="ij"), axis=-1).reshape(-1, 3)
        block = np.stack(np.meshgrid(*(np.arange(0, n, _BLOCK) for n in grid.shape), indexing="ij"), axis=-1)
        middle = block + 0.5 * (_BLOCK - 1)
        coarse = self.values(grid.to_world(middle.reshape(-1, 3))).reshape(block.shape[:3])
        value = coarse[tuple((index // _BLOCK).T)]
        # The field changes by no more than the way from the middle of a block to its corner.
        near = np.abs(value) <= 0.5 * (_BLOCK - 1) * np.sqrt(3.0) * grid.spacing.max() + 1e-9
        value[near] = self.values(grid.to_world(index[near]))
        return np.asarray(value.reshape(grid.shape) < 0.0)

    def project(self, points: FloatArray, steps: int = _STEPS) -> FloatArray:
        """Points near the surface moved onto it along the gradient, ``(n, 3)``.

        Examples
        --------
        >>> from femprep.wall.chambers.envelope import Part
        >>> body = fp.Envelope([Part(endo, 3.0, 1.0)])
        >>> bool(abs(body.values(body.project(endo.points))).max() < 0.1)
        True
        """
        points = points.copy()
        for _ in range(steps):
            value, gradient = self.with_gradients(points)
            square = np.maximum((gradient**2).sum(axis=1), _FLAT**2)
            points -= (value / square)[:, None] * gradient
        return points

    def _along_normals(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Points that the gradient has not led onto the surface, as in narrow grooves, moved there along normals."""
        off = np.flatnonzero(np.abs(self.values(points)) > _NEAR)
        if not len(off):
            return points
        start, way = points[off], normals[off]
        steps = np.linspace(-_SEARCH, _SEARCH, 2 * int(_SEARCH / _SEARCH_STEP) + 1)
        values = self.values((start[:, None] + steps[:, None] * way[:, None]).reshape(-1, 3)).reshape(len(off), -1)
        crossing = (values[:, :-1] < 0.0) & (values[:, 1:] >= 0.0)  # from inside to outside
        nearest = np.where(crossing, np.abs(steps[:-1]), np.inf).argmin(axis=1)
        found = crossing[np.arange(len(off)), nearest]
        low, high = steps[nearest], steps[nearest + 1]
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            inside = self.values(start + middle[:, None] * way) < 0.0
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        points = points.copy()
        points[off[found]] = (start + (0.5 * (low + high))[:, None] * way)[found]
        return points

    def folds(self, surface: Surface) -> int:
        """Number of triangles of a settled surface that cross others, or whose normal is far from the body's.

        Examples
        --------
        >>> from femprep.wall.chambers.envelope import Part
        >>> body = fp.Envelope([Part(endo, 3.0, 1.0)])
        >>> body.folds(body.settle(endo))
        0
        """
        points, triangles = surface.points, surface.triangles
        way = unit_vectors(self.with_gradients(points[triangles].mean(axis=1))[1])
        turned = np.flatnonzero(np.einsum("ij,ij->i", normals(points, triangles), way) < _UPRIGHT)
        return len(np.union1d(turned, self_intersections(points, triangles).ravel()))

    def filled(self, outline: Surface, below: float) -> Envelope:
        """The same body, its tunnels and narrow grooves filled up to a depth below an outline that bridges them, mm.

        Examples
        --------
        >>> from femprep.wall.chambers.envelope import Part
        >>> body = fp.Envelope([Part(endo, 3.0, 1.0)])
        >>> len(body.filled(epi, below=2.0).parts)
        1
        """
        return Envelope(self.parts, Part(outline, -below, _FILLET))

    def settle(self, surface: Surface) -> Surface:
        """A surface fitted to the body, its vertices moved exactly onto it and spread evenly along it.

        Raises
        ------
        StageError
            A vertex does not reach the surface.

        Examples
        --------
        >>> from femprep.wall.chambers.envelope import Part
        >>> body = fp.Envelope([Part(endo, 3.0, 1.0)])
        >>> grown = body.settle(endo)
        >>> bool(grown.volume > endo.volume)
        True
        """
        triangles = surface.triangles
        edges = edge_table(triangles).nodes
        points = self.project(surface.points, 3)
        for _ in range(_ROUNDS):
            normal = vertex_normals(points, triangles)
            step = neighbour_mean(points, edges) - points
            step -= np.einsum("ij,ij->i", step, normal)[:, None] * normal
            points = self.project(points + _RELAX * step, 1)
        points = self._along_normals(self.project(points), vertex_normals(points, triangles))
        off = np.abs(self.values(points))
        if off.max() > 0.1:
            worst = points[int(off.argmax())]
            raise StageError(
                f"the surface of {surface.name!r} does not follow the body it encloses near {spot(worst)}: "
                f"{off.max():.1f} mm off",
                advice=[MORE_VERTICES],
            )
        moved = np.linalg.norm(points - surface.points, axis=1)
        info = {**surface.info, "settled": {"mean_mm": float(moved.mean()), "farthest_mm": float(moved.max())}}
        return replace(surface, points=points, shape=None, info=info)


def _joined(
    one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray], blend: float
) -> tuple[FloatArray, FloatArray]:
    """The smooth minimum of two fields, and its gradient."""
    overlap = np.maximum(blend - np.abs(one[0] - other[0]), 0.0) / blend
    share = np.where(other[0] < one[0], 1.0 - 0.5 * overlap, 0.5 * overlap)[:, None]
    value = np.minimum(one[0], other[0]) - 0.25 * blend * overlap**2
    return value, (1.0 - share) * one[1] + share * other[1]
