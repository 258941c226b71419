"""Planes in, a first motion of each out: what two planes show along the line where they cross has to agree."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import Final

import numpy as np

from femprep.image.resample import slice_distance
from femprep.model import BoolArray, FloatArray
from femprep.surface.alignment.planes import ImagePlane

#: Signed distances count up to this, mm.
_REACH: Final = 8.0
#: Samples along a line, mm apart, and length of a line to either side, mm; every so many pixels between slices.
_STEP, _LENGTH, _EVERY = 1.0, 200.0, 3
#: Rounds at most; fewer once no motion changes by more than this, mm.
_ROUNDS: Final = 10
_ENOUGH: Final = 0.3
#: Standard deviation of the difference of two planes' distances, mm, and of a slice's from the mean of its neighbours'.
_ALONG, _BETWEEN = 2.0, 8.0
#: Samples count within this of an outline, mm: along a line, and between slices; and an outline's least slope there.
_EDGE, _NEAR, _FLAT = 4.0, 6.0, 0.4
#: Planes whose normals differ by less than this (sine) do not cross.
_PARALLEL: Final = 0.2
#: Greatest change of a motion in one round, mm.
_MOST: Final = 6.0


class _Fields:
    """Signed distances of the pixels of a plane's objects from their outlines, and the slopes of these."""

    def __init__(self, plane: ImagePlane, names: list[str]) -> None:
        self.known = np.array([name in plane.masks for name in names])
        self.seen = np.array([name in plane.masks and bool(plane.masks[name].any()) for name in names])
        shape = next(iter(plane.masks.values())).shape
        self._shape = np.array(shape)
        self._values = np.zeros((len(names), 3, *shape))
        self._values[:, 0] = -_REACH
        for k in np.flatnonzero(self.seen).tolist():
            distance = _REACH * np.tanh(slice_distance(plane.masks[names[k]], plane.spacing) / _REACH)
            self._values[k] = distance, *(np.gradient(distance, h, axis=a) for a, h in enumerate(plane.spacing))

    def inside(self, index: FloatArray) -> BoolArray:
        """Whether fractional pixels lie within the plane."""
        return np.asarray(((index >= 0.0) & (index <= self._shape - 1.0)).all(axis=1), dtype=bool)

    def at(self, index: FloatArray) -> FloatArray:
        """Distance and slopes ``(objects, 3, n)`` at fractional pixels."""
        low = np.clip(np.floor(index).astype(np.int64), 0, self._shape - 2)
        (s, t), (i, j) = np.clip(index - low, 0.0, 1.0).T, low.T
        v = self._values
        near = (1.0 - t) * v[:, :, i, j] + t * v[:, :, i, j + 1]
        far = (1.0 - t) * v[:, :, i + 1, j] + t * v[:, :, i + 1, j + 1]
        return np.asarray((1.0 - s) * near + s * far)


class _Equations:
    """Normal equations of all motions, with their priors."""

    def __init__(self, planes: list[ImagePlane], fields: list[_Fields]) -> None:
        self._planes, self._fields = planes, fields
        self._start = np.cumsum([0, *(len(plane.motion) for plane in planes)])
        prior = np.concatenate([plane.prior**-2.0 for plane in planes])
        self._matrix = np.diag(prior)
        self._right = -prior * np.concatenate([plane.motion - plane.guess for plane in planes])

    def crossing(self, one: int, other: int) -> None:
        """Two planes agree along the line where they cross.

        Only places along the line are compared, and motions along it: outlines that one of the planes cuts aslant
        differ beside it though the planes lie right.
        """
        line = _line(self._planes[one], self._planes[other])
        if line is None:
            return
        along = (line[-1] - line[0]) / np.linalg.norm(line[-1] - line[0])
        points, found = self._found(line, (one, other))
        if len(points) == 0:
            return
        level, slope = {}, {}
        for k, (distance, gradient) in found.items():
            run = gradient @ along
            steep = np.maximum(np.abs(run), _FLAT)
            level[k], slope[k] = distance / steep, (run / steep)[..., None] * along
        near = np.minimum(*(np.abs(distance) for distance, _ in found.values())) < _EDGE
        near &= (self._fields[one].known & self._fields[other].known)[:, None]
        near &= (self._fields[one].seen | self._fields[other].seen)[:, None]
        self._add({one: 1.0, other: -1.0}, points, level, slope, near, _ALONG)

    def between(self, slice_: int, points: FloatArray) -> None:
        """What a slice shows lies in the middle between what both slices next to it show."""
        points, found = self._found(points, (slice_ - 1, slice_, slice_ + 1))
        if len(points) == 0:
            return
        near = np.min([np.abs(distance) for distance, _ in found.values()], axis=0) < _NEAR
        near &= np.all([self._fields[k].seen for k in found], axis=0)[:, None]
        level, slope = ({k: pair[n] for k, pair in found.items()} for n in range(2))
        self._add({slice_ - 1: -0.5, slice_: 1.0, slice_ + 1: -0.5}, points, level, slope, near, _BETWEEN)

    def solve(self) -> tuple[list[ImagePlane], float]:
        """Planes with their new motions, and the greatest change."""
        motion = np.linalg.solve(self._matrix, self._right)
        most = float(np.abs(motion).max())
        motion *= min(1.0, _MOST / max(most, _MOST))
        rows = zip(self._planes, self._start, self._start[1:])
        return [replace(plane, motion=plane.motion + motion[a:b]) for plane, a, b in rows], most

    def _found(
        self, points: FloatArray, planes: tuple[int, ...]
    ) -> tuple[FloatArray, dict[int, tuple[FloatArray, FloatArray]]]:
        """Those points that lie within all of some planes; distances and gradients in space of each plane there."""
        index = {k: self._planes[k].stored(points) for k in planes}
        inside = np.all([self._fields[k].inside(at) for k, at in index.items()], axis=0)
        found = {}
        for k, at in index.items():
            values = self._fields[k].at(at[inside])
            axes = self._planes[k].rotation @ self._planes[k].axes
            found[k] = values[:, 0], np.einsum("ia,oan->oni", axes, values[:, 1:])
        return points[inside], found

    def _add(
        self,
        parts: dict[int, float],
        points: FloatArray,
        level: dict[int, FloatArray],
        slope: dict[int, FloatArray],
        near: BoolArray,
        sigma: float,
    ) -> None:
        """Add that weighted sums of planes' distances at points vanish; large ones count less (Cauchy)."""
        value = np.sum([share * level[k] for k, share in parts.items()], axis=0)
        weight = np.where(near, 1.0 / (sigma**2 + 0.25 * value**2), 0.0).ravel()
        rows = []
        for k, share in parts.items():
            at = np.broadcast_to(points, slope[k].shape).reshape(-1, 3)
            rows.append(-share * self._planes[k].jacobian(at, slope[k].reshape(-1, 3)))
        jacobian = np.concatenate(rows, axis=1)
        own = np.concatenate([np.arange(self._start[k], self._start[k + 1]) for k in parts])
        self._matrix[np.ix_(own, own)] += jacobian.T @ (weight[:, None] * jacobian)
        self._right[own] -= jacobian.T @ (weight * value.ravel())


def first_motions(planes: list[ImagePlane]) -> list[ImagePlane]:
    """Motions with which planes agree where they cross, and slices with their neighbours, by Gauss and Newton.

    Parameters
    ----------
    planes : list of ImagePlane
        Slices in their order, then views.

    Returns
    -------
    list of ImagePlane
    """
    names = list(dict.fromkeys(name for plane in planes for name in plane.masks))
    fields = [_Fields(plane, names) for plane in planes]
    count = sum(not plane.view for plane in planes)
    pairs = [(a, b) for a, b in combinations(range(len(planes)), 2) if b >= count]
    inner = {k: _pixels(planes[k]) for k in range(1, count - 1)}
    for _ in range(_ROUNDS):
        equations = _Equations(planes, fields)
        for one, other in pairs:
            equations.crossing(one, other)
        for k, points in inner.items():
            equations.between(k, planes[k].moved(points))
        planes, most = equations.solve()
        if most < _ENOUGH:
            break
    return planes


def _pixels(plane: ImagePlane) -> FloatArray:
    """Some pixels of a plane, as stored."""
    shape = next(iter(plane.masks.values())).shape
    index = np.stack(np.meshgrid(*(np.arange(0, n, _EVERY) for n in shape), indexing="ij"), axis=-1).reshape(-1, 2)
    return np.asarray(plane.origin + (index * plane.spacing) @ plane.axes.T)


def _line(one: ImagePlane, two: ImagePlane) -> FloatArray | None:
    """Points along the line where two planes cross; None where they are nearly parallel."""
    first, second = one.rotation @ one.frame[:, 2], two.rotation @ two.frame[:, 2]
    along = np.cross(first, second)
    length = float(np.linalg.norm(along))
    if length < _PARALLEL:
        return None
    along /= length
    place, other = (p.moved(p.origin[None])[0] for p in (one, two))
    middle = two.middle + two.way if two.view else place
    point = np.linalg.solve(np.stack([first, second, along]), [first @ place, second @ other, along @ middle])
    return np.asarray(point + np.arange(-_LENGTH, _LENGTH, _STEP)[:, None] * along)
