"""A cavity and planes in, coordinates about its long axis out: share of the way from apex to base, and angle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femprep.errors import InputError
from femprep.mesh.level_segments import level_segments
from femprep.mesh.tangents import tangents
from femprep.model import FloatArray, IntArray, Plane, Surface
from femprep.model.functions import arctan2
from femprep.model.products import inner, length, product, solve_definite, weighted
from femprep.options.advice import GIVE_BASE, MOVE_BASE
from femprep.sweeping.cup.cup import HOLE

#: Heights at which the cavity is cut for its axis.
_CUTS = 12
#: Vertices nearer to a plane than this give way to the rim's own points, mm.
_CLEAR = 0.3
#: How far the fringe lies beyond the rim, on the disk.
_FRINGE = 0.15


@dataclass(frozen=True)
class Axial:
    """Rays from the long axis: level with the base above the centre of the apex, spreading from that centre below it.

    Attributes
    ----------
    frame : (3, 3) array
        Rows: the first column's direction, the one a quarter turn on, and the way down from base to apex.
    origin : (3,) array
        A point of the base plane, mm.
    bend : (3, 2) array
        The axis at depth z lies at (1, z, z^2) @ bend in the plane across, mm.
    depth : float
        Depth of the centre of the apex, mm; infinite where the apex is clipped.
    reach : float
        Distance from that centre to the apex of the cavity, mm; where it is clipped, length between the planes.
    apex : Plane or None
    base : Plane
    """

    frame: FloatArray
    origin: FloatArray
    bend: FloatArray
    depth: float
    reach: float
    base: Plane
    apex: Plane | None

    @classmethod
    def of(cls, endo: Surface, base: Plane, apex: Plane | None, toward: FloatArray) -> Axial:
        """Axis of a cavity.

        Parameters
        ----------
        endo : Surface
            Closed surface of the cavity.
        base, apex : Plane
            Where the wall ends.
        toward : (3,) array
            Direction of the first column.

        Raises
        ------
        InputError
            A plane does not cut the cavity, or nothing of it lies below the base.
        """
        down = -base.normal
        across = toward - inner(toward, down) * down
        if length(across) < 1e-3 * max(length(toward), 1e-300):
            # Along the axis: any other will do.
            across = tangents(down[None])[0, 0]
        first = across / length(across)
        frame = np.stack([first, np.cross(down, first), down])
        centre, _ = section(endo, base)
        below = -base.signed_distance(endo.points)
        bottom = float(below.max())
        if apex is not None:
            section(endo, apex)
            bottom = min(bottom, float(-base.signed_distance(section(endo, apex)[0][None])[0]))
        if bottom <= 0.0:
            raise InputError("nothing of the cavity lies between base and apex plane; check their normals")
        heights = bottom * np.linspace(0.0, 0.9 if apex is None else 1.0, _CUTS)
        cuts = [section(endo, Plane(base.point + h * down, base.normal)) for h in heights]
        local = np.array([product(c - centre, frame[:2].T) for c, _ in cuts])
        radii = np.array([r for _, r in cuts])
        if apex is None:
            # The centre of the apex is as far from the bottom as from the sides.
            short = radii - (bottom - heights)
            k = int(np.argmax(short > 0.0)) if np.any(short > 0.0) else _CUTS - 1
            depth = 0.0
            if k > 0:
                a, b = short[k - 1], short[k]
                depth = float(heights[k - 1] - a * (heights[k] - heights[k - 1]) / (b - a)) if b > a else heights[k]
            depth = float(np.clip(depth, 0.0, 0.85 * bottom))
            reach = bottom - depth
        else:
            depth, reach = np.inf, bottom
        used = heights <= max(min(depth, bottom), heights[2])
        # Shares of the depth, so that their powers are of a size; a line where there are too few cuts for a parabola.
        powers = _powers(heights[used] / bottom)[:, : 3 if used.sum() >= 5 else 2]
        bend = np.zeros((3, 2))
        bend[: powers.shape[1]] = solve_definite(weighted(powers, powers), weighted(powers, local[used]))
        bend /= _powers(np.array([bottom])).T
        return cls(frame, centre, bend, depth, reach, base, apex)

    def coordinates(self, points: FloatArray) -> FloatArray:
        """Places ``(n, 2)`` on the disk of a cup (see Cup) for points ``(n, 3)`` mm."""
        q = product(points - self.origin, self.frame.T)
        z = q[:, 2]
        level = np.minimum(z, self.depth if np.isfinite(self.depth) else z)
        # Above the base the axis goes on straight up, a parabola might swing out.
        height = np.maximum(level, 0.0)
        across = q[:, :2] - _bent(height, self.bend)
        radius = np.linalg.norm(across, axis=1)
        if self.apex is None:
            fall = np.maximum(z - self.depth, 0.0)
            arc = np.where(
                z > self.depth, self.reach * arctan2(radius, fall), 0.5 * np.pi * self.reach + self.depth - z
            )
            share = arc / self.length
        else:
            above, below = -self.base.signed_distance(points), -self.apex.signed_distance(points)
            share = HOLE + (1.0 - HOLE) * below / np.maximum(above + below, 1e-9)
        return np.asarray(share[:, None] * across / np.maximum(radius, 1e-300)[:, None])

    def cloud(self, points: FloatArray, triangles: IntArray) -> tuple[FloatArray, FloatArray]:
        """Places on the disk and points of a surface between its planes: its vertices, the rims, a fringe beyond.

        The surface's own vertices beyond a plane are of no use: there it rounds off into a cap whose points all lie
        at the same height.
        """
        planes = [(self.base, 1.0)] + ([(self.apex, HOLE)] if self.apex is not None else [])
        heights = [plane.signed_distance(points) for plane, _ in planes]
        inside = np.all([h < -_CLEAR for h in heights], axis=0)
        disks, places = [self.coordinates(points[inside])], [points[inside]]
        for (plane, share), height in zip(planes, heights):
            rim = level_segments(points, triangles, height)[0]
            disk = self.coordinates(rim)
            disk *= share / np.maximum(np.linalg.norm(disk, axis=1, keepdims=True), 1e-300)
            other = HOLE if share == 1.0 and self.apex is not None else 1.0 if self.apex is not None else 0.0
            rise = _FRINGE * self.length / abs(share - other)
            for factor in (0.0, 1.0):
                disks.append(disk * (1.0 + factor * np.sign(share - other) * _FRINGE / share))
                places.append(rim + factor * rise * plane.normal)
        return np.concatenate(disks), np.concatenate(places)

    @property
    def length(self) -> float:
        """Length of the cavity from apex to base along its side, mm."""
        return self.reach if self.apex is not None else 0.5 * np.pi * self.reach + self.depth

    def size(self, endo: FloatArray, epi: FloatArray) -> tuple[float, float, float]:
        """Girth and length from apex to base half-way through the wall, and mean thickness, mm."""
        radii, lengths = [], []
        for points in (endo, epi):
            disk = self.coordinates(points)
            share = np.linalg.norm(disk, axis=1)
            q = product(points - self.origin, self.frame.T)
            used = (share < 1.0) & (q[:, 2] < min(self.depth, 1e9))
            if not used.any():
                used = share < 1.0
            height = np.clip(q[used, 2], 0.0, self.depth)
            across = np.linalg.norm(q[used, :2] - _bent(height, self.bend), axis=1)
            radii.append(float(np.median(across)))
            if self.apex is None:
                bottom = float(q[:, 2].max()) - self.depth
                lengths.append(self.depth + 0.25 * np.pi * (bottom + radii[-1]))
            else:
                lengths.append(self.reach)
        return np.pi * (radii[0] + radii[1]), 0.5 * (lengths[0] + lengths[1]), max(radii[1] - radii[0], 0.1)


def section(surface: Surface, plane: Plane) -> tuple[FloatArray, float]:
    """Centroid of the curve in which a plane cuts a surface, and its mean distance from it, mm.

    Raises
    ------
    InputError
        The plane does not cut the surface.
    """
    height = plane.signed_distance(surface.points)
    triangles: IntArray = surface.triangles
    side = height[triangles] > 0.0
    cut = triangles[side.any(axis=1) & ~side.all(axis=1)]
    if not len(cut):
        raise InputError(
            f"the plane through {np.round(plane.point, 1).tolist()} with normal {np.round(plane.normal, 3).tolist()} "
            f"does not cut surface {surface.name!r}, which lies {height.min():.1f} to {height.max():.1f} mm from it",
            advice=[MOVE_BASE, GIVE_BASE],
        )
    ends = []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        a, b = cut[:, i], cut[:, j]
        crossing = (height[a] > 0.0) != (height[b] > 0.0)
        share = np.divide(height[a], height[a] - height[b], out=np.zeros(len(cut)), where=crossing)
        point = surface.points[a] + share[:, None] * (surface.points[b] - surface.points[a])
        ends.append(np.where(crossing[:, None], point, np.nan))
    both = np.stack(ends, axis=1)
    # Each cut triangle has two ends of its segment among the three.
    middle = np.nanmean(both, axis=1)
    span = np.nanmax(both, axis=1) - np.nanmin(both, axis=1)
    weight = np.linalg.norm(span, axis=1)
    centre = weighted(weight, middle) / weight.sum()
    radius = inner(weight, np.linalg.norm(middle - centre, axis=1)) / float(weight.sum())
    return np.asarray(centre), float(radius)


def _powers(height: FloatArray) -> FloatArray:
    return np.stack([np.ones_like(height), height, height * height], axis=1)


def _bent(height: FloatArray, bend: FloatArray) -> FloatArray:
    """Where the axis lies at depths ``(n,)``, across."""
    return product(_powers(height), bend)
