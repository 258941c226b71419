"""Planes in, a first motion of each out: what two planes show along the line where they cross has to agree."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import Final

import numpy as np

from femprep.image.resample import slice_distance
from femprep.model import FloatArray
from femprep.surface.alignment.planes import ImagePlane

#: Signed distances count up to this, mm.
_REACH: Final = 8.0
#: Samples along a line, mm apart.
_STEP: Final = 1.0
_ROUNDS: Final = 12


class _Distances:
    """Signed distances of the pixels of a plane's objects, and their slopes, interpolated linearly."""

    def __init__(self, plane: ImagePlane) -> None:
        self.fields = {}
        for name, mask in plane.masks.items():
            if mask.any():
                d = _REACH * np.tanh(slice_distance(mask, plane.spacing) / _REACH)
            else:
                d = np.full(mask.shape, -_REACH)
            self.fields[name] = (d, *(np.gradient(d, h, axis=a) for a, h in enumerate(plane.spacing)))

    def at(self, name: str, index: FloatArray) -> FloatArray:
        from scipy.ndimage import map_coordinates

        return np.stack([map_coordinates(f, index.T, order=1, mode="nearest") for f in self.fields[name]])


def first_motions(planes: list[ImagePlane]) -> list[ImagePlane]:
    """Motions with which planes agree where they cross, by Gauss and Newton with the planes' priors."""
    from scipy.optimize import lsq_linear  # noqa: F401

    fields = [_Distances(p) for p in planes]
    start = np.cumsum([0, *(len(p.motion) for p in planes)])
    pairs = [(a, b) for a, b in combinations(range(len(planes)), 2) if planes[a].view or planes[b].view]
    steps = [(a, a + 1) for a in range(len(planes) - 1) if not planes[a + 1].view]
    damping = 1.0
    for _ in range(_ROUNDS):
        prior = np.concatenate([1.0 / p.prior**2 for p in planes])
        matrix = np.diag(prior)
        right = -prior * np.concatenate([p.motion for p in planes])
        for a, b in pairs:
            _along_line(planes, fields, a, b, start, matrix, right)
        for a, b in steps:
            _neighbours(planes, fields, a, b, start, matrix, right)
        move = np.linalg.solve(matrix, right)
        move *= min(1.0, 6.0 / max(np.abs(move).max(), 1e-9))
        planes = [replace(p, motion=p.motion + damping * move[s : s + len(p.motion)]) for p, s in zip(planes, start)]
    return planes


def _stored(plane: ImagePlane, points: FloatArray) -> FloatArray:
    """Pixel indices in a plane as stored of points of the heart, projected onto it."""
    way = plane.frame[:, : min(3, len(plane.motion))] @ plane.motion[:3]
    local = (points - plane.middle - way) @ plane.rotation + plane.middle
    return (local - plane.origin) @ plane.axes / plane.spacing


def _add(planes, a, b, start, matrix, right, points, fa, fb, sigma, ia, ib) -> None:
    """Add residuals fa - fb to the normal equations."""
    value = fa[0] - fb[0]
    rows = []
    for p, f, s in ((planes[a], fa, 1.0), (planes[b], fb, -1.0)):
        slope = (p.rotation @ p.axes @ f[1:]).T  # gradient in space
        rows.append(-s * p.jacobian(points, slope))
    jac = np.concatenate(rows, axis=1)
    weight = 1.0 / (sigma**2 * (1.0 + (value / (2.0 * sigma)) ** 2))
    index = np.concatenate([np.arange(start[a], start[a + 1]), np.arange(start[b], start[b + 1])])
    matrix[np.ix_(index, index)] += jac.T @ (weight[:, None] * jac)
    right[index] -= jac.T @ (weight * value)


def _along_line(planes, fields, a, b, start, matrix, right) -> None:
    one, two = planes[a], planes[b]
    n1, n2 = one.rotation @ one.frame[:, 2], two.rotation @ two.frame[:, 2]
    along = np.cross(n1, n2)
    if np.linalg.norm(along) < 0.2:
        return
    along /= np.linalg.norm(along)
    o1, o2 = one.moved(one.origin[None])[0], two.moved(two.origin[None])[0]
    point = np.linalg.solve(np.stack([n1, n2, along]), [n1 @ o1, n2 @ o2, along @ o1])
    t = np.arange(-250.0, 250.0, _STEP)
    points = point + t[:, None] * along
    ia, ib = _stored(one, points), _stored(two, points)
    inside = np.ones(len(points), dtype=bool)
    for p, i in ((one, ia), (two, ib)):
        shape = next(iter(p.masks.values())).shape
        inside &= ((i >= 0) & (i <= np.array(shape) - 1)).all(axis=1)
    if not inside.any():
        return
    points, ia, ib = points[inside], ia[inside], ib[inside]
    for name in set(fields[a].fields) & set(fields[b].fields):
        fa, fb = fields[a].at(name, ia), fields[b].at(name, ib)
        near = np.minimum(np.abs(fa[0]), np.abs(fb[0])) < 0.75 * _REACH
        if near.any():
            _add(planes, a, b, start, matrix, right, points[near], fa[:, near], fb[:, near], 2.0, ia, ib)


def _neighbours(planes, fields, a, b, start, matrix, right) -> None:
    one, two = planes[a], planes[b]
    shape = np.array(next(iter(one.masks.values())).shape)
    grid = np.stack(np.meshgrid(*(np.arange(0, n, 3) for n in shape), indexing="ij"), axis=-1).reshape(-1, 2)
    points = one.origin + (grid * one.spacing) @ one.axes.T
    points = one.moved(points)
    ia, ib = _stored(one, points), _stored(two, points)
    for name in one.masks:
        if not (one.masks[name].any() and two.masks[name].any()):
            continue
        fa, fb = fields[a].at(name, ia), fields[b].at(name, ib)
        near = np.minimum(np.abs(fa[0]), np.abs(fb[0])) < 0.4 * _REACH
        if near.any():
            _add(planes, a, b, start, matrix, right, points[near], fa[:, near], fb[:, near], 25.0, ia, ib)
