"""Planes in, a first motion of each out: what two planes show along the line where they cross has to agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import Final

import numpy as np

from femprep.image.resample import slice_distance
from femprep.model import FloatArray
from femprep.surface.alignment.planes import ImagePlane

#: Signed distances count up to this, mm.
_REACH: Final = 8.0
#: Samples along a line, mm apart, and length of a line to either side.
_STEP, _LENGTH = 1.0, 200.0
_ROUNDS: Final = 10
#: Standard deviation of the difference of two planes' distances, mm, and of a slice's from the mean of its neighbours'.
_ALONG, _BETWEEN = 2.0, 8.0
_NEAR, _EDGE, _FLAT = 6.0, 4.0, 0.4
#: Greatest change of a motion in one round.
_MOST: Final = 6.0


class _Fields:
    """Signed distances of the pixels of a plane's objects from their outlines, and the slopes of these."""

    def __init__(self, plane: ImagePlane, names: Sequence[str]) -> None:
        self.known = np.array([name in plane.masks for name in names])
        self.seen = np.array([name in plane.masks and bool(plane.masks[name].any()) for name in names])
        shape = next(iter(plane.masks.values())).shape
        self.shape = np.array(shape)
        self._values = np.zeros((len(names), 3, *shape))
        self._values[:, 0] = -_REACH
        for k in np.flatnonzero(self.seen):
            distance = _REACH * np.tanh(slice_distance(plane.masks[names[k]], plane.spacing) / _REACH)
            self._values[k] = distance, *(np.gradient(distance, h, axis=a) for a, h in enumerate(plane.spacing))

    def inside(self, index: FloatArray) -> FloatArray:
        return ((index >= 0.0) & (index <= self.shape - 1.0)).all(axis=1)

    def at(self, index: FloatArray) -> FloatArray:
        """Distance and slopes ``(objects, 3, n)`` at fractional pixels."""
        low = np.clip(np.floor(index).astype(np.int64), 0, self.shape - 2)
        (s, t), (i, j) = np.clip(index - low, 0.0, 1.0).T, low.T
        v = self._values
        left = (1.0 - t) * v[:, :, i, j] + t * v[:, :, i, j + 1]
        return np.asarray((1.0 - s) * left + s * ((1.0 - t) * v[:, :, i + 1, j] + t * v[:, :, i + 1, j + 1]))


class _Normal:
    """Normal equations of all motions."""

    def __init__(self, planes: list[ImagePlane]) -> None:
        self.start = np.cumsum([0, *(len(p.motion) for p in planes)])
        prior = np.concatenate([p.prior**-2.0 for p in planes])
        self.matrix, self.right = np.diag(prior), -prior * np.concatenate([p.motion for p in planes])

    def add(
        self, planes: list[ImagePlane], fields: list[_Fields], parts: dict[int, float], points: FloatArray, sigma: float,
        along: FloatArray | None = None,
    ) -> None:
        """Weighted sums of planes' distances at points, which ought to vanish."""
        index = {k: planes[k].stored(points) for k in parts}
        inside = np.all([fields[k].inside(i) for k, i in index.items()], axis=0)
        if not inside.any():
            return
        points = points[inside]
        found = {k: fields[k].at(i[inside]) for k, i in index.items()}
        known = np.all([fields[k].known for k in parts], axis=0) & np.any([fields[k].seen for k in parts], axis=0)
        if any(not planes[k].view for k in parts) and len(parts) > 2:
            known &= np.all([fields[k].seen for k in parts], axis=0)
        slope = {k: np.einsum("ia,oan->oni", planes[k].rotation @ planes[k].axes, f[:, 1:]) for k, f in found.items()}
        level = {k: f[:, 0] for k, f in found.items()}
        reach = _NEAR if along is None else _EDGE
        if along is not None:
            # Only places along the line are compared: outlines that two planes cut aslant differ beside it.
            for k in parts:
                run = slope[k] @ along
                steep = np.maximum(np.abs(run), _FLAT)
                slope[k] = (run / steep)[..., None] * along
                level[k] = level[k] / steep
        value = sum(c * level[k] for k, c in parts.items())
        near = np.min([np.abs(f[:, 0]) for f in found.values()], axis=0) < reach
        weight = np.where(near & known[:, None], 1.0 / (sigma**2 + 0.25 * value**2), 0.0)
        rows = []
        for k, c in parts.items():
            at = np.broadcast_to(points, slope[k].shape).reshape(-1, 3)
            rows.append(-c * planes[k].jacobian(at, slope[k].reshape(-1, 3)))
        jacobian, weight, value = np.concatenate(rows, axis=1), weight.ravel(), value.ravel()
        own = np.concatenate([np.arange(self.start[k], self.start[k + 1]) for k in parts])
        self.matrix[np.ix_(own, own)] += jacobian.T @ (weight[:, None] * jacobian)
        self.right[own] -= jacobian.T @ (weight * value)


def first_motions(planes: list[ImagePlane]) -> list[ImagePlane]:
    """Motions with which planes agree where they cross, by Gauss and Newton with the planes' priors."""
    names = list(dict.fromkeys(name for p in planes for name in p.masks))
    fields = [_Fields(p, names) for p in planes]
    pairs = [(a, b) for a, b in combinations(range(len(planes)), 2) if planes[a].view or planes[b].view]
    flat = [k for k, p in enumerate(planes) if not p.view]
    grids = {}
    for k in flat[1:-1]:
        body = np.argwhere(np.any(list(planes[k].masks.values()), axis=0))
        low, high = np.maximum(body.min(axis=0) - 3, 0), body.max(axis=0) + 4
        at = np.stack(np.meshgrid(*(np.arange(a, b, 3) for a, b in zip(low, high)), indexing="ij"), axis=-1)
        grids[k] = planes[k].origin + (at.reshape(-1, 2) * planes[k].spacing) @ planes[k].axes.T
    for _ in range(_ROUNDS):
        normal = _Normal(planes)
        for a, b in pairs:
            line = _line(planes[a], planes[b])
            if line is not None:
                normal.add(planes, fields, {a: 1.0, b: -1.0}, line, _ALONG, (line[-1] - line[0]) / np.linalg.norm(line[-1] - line[0]))
        for k, points in grids.items():
            normal.add(planes, fields, {k: 1.0, k - 1: -0.5, k + 1: -0.5}, planes[k].moved(points), _BETWEEN)
        move = np.linalg.solve(normal.matrix, normal.right)
        move *= min(1.0, _MOST / max(float(np.abs(move).max()), 1e-9))
        planes = [
            replace(p, motion=p.motion + move[a:b]) for p, a, b in zip(planes, normal.start, normal.start[1:])
        ]
        if np.abs(move).max() < 0.3:
            break
    return planes


def _line(one: ImagePlane, two: ImagePlane) -> FloatArray | None:
    """Points along the line where two planes cross; None where they are nearly parallel."""
    first, second = one.rotation @ one.frame[:, 2], two.rotation @ two.frame[:, 2]
    along = np.cross(first, second)
    length = float(np.linalg.norm(along))
    if length < 0.2:
        return None
    along /= length
    place, other = (p.moved(p.origin[None])[0] for p in (one, two))
    middle = two.middle + two.way if two.view else place
    point = np.linalg.solve(np.stack([first, second, along]), [first @ place, second @ other, along @ middle])
    return np.asarray(point + np.arange(-_LENGTH, _LENGTH, _STEP)[:, None] * along)
