"""Planes with first motions and rough surfaces in, the motions and surfaces that agree best with all of them out.

Heights of outline points over the surfaces are linear in small moves of vertices and in small motions of planes. Both
are found together by Gauss and Newton: vertices are eliminated from the normal equations of each surface, what is left
of all surfaces are some fifty equations for the motions. So a plane is moved by what a smooth surface through all
*other* planes leaves open, not by the surface that follows the plane itself; moving planes and fitting surfaces in turn
would stay where it began.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np

from femprep.mesh.banded import Banded
from femprep.mesh.curvature import Curvature
from femprep.mesh.operations.tangential_smoothing import smooth_tangentially
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import FloatArray, IntArray
from femprep.model.products import unit_vectors
from femprep.surface.alignment.bend import HeartBend
from femprep.surface.alignment.planes import ImagePlane
from femprep.surface.estimate.estimate import held_back

#: Weight of the change of curvature against outlines, mm^4, round by round; the last ones spare edges.
_STIFF: Final = (3000.0, 1000.0, 1000.0, 1000.0, 1000.0, 1000.0)
_SPARING: Final = 3
#: Neighbouring outline points err alike: so many of them tell as much as one.
_ALIKE: Final = 3.0
#: Standard deviation of outlines beside their pixels, mm, and of what a plane is off across itself where it cuts a
#: surface aslant, mm.
_NOISE, _ASLANT = 0.4, 1.0
#: Standard deviations from which on points count less.
_FAR: Final = 3.0
#: Weight of the end of a stack, a slice's distance wide.
_END: Final = 0.1
#: Steps in which a slice that is left out is moved onto the surfaces: from which distance outlines count less, mm.
_PLACED: Final = (16.0, 16.0, 16.0, 8.0, 8.0, 4.0, 4.0, 2.0, 2.0, 1.0, 1.0, 1.0)
#: Greatest change of a motion in one round: mm, and radians.
_MOST: Final = 4.0
#: Motions of usual size that are counted with those found, and how many times larger than usual motions may be.
_BELIEF: Final = 3.0
_LARGER: Final = 1.5
#: As in the estimate of a surface: principal curvatures, edges, squared cosines, spreading of vertices.
_SHARPEST: Final = 0.2
_USUAL, _LEAST, _OBLIQUE, _SPREAD = 0.005, 0.005, 0.02, 5


class RoughSurface(NamedTuple):
    """One object's surface while it is bent.

    Attributes
    ----------
    name : str
        As in the planes' masks.
    points, triangles : (n, 3) arrays
        A closed mesh in the coordinates of the planes, mm, wound outward.
    ends : (k, 3) array
        Faces of voxels where the stack ends and no view shows that the object goes on.
    axis : int
        Axis across the slices.
    step : float
        Distance of slices, mm.
    """

    name: str
    points: FloatArray
    triangles: IntArray
    ends: FloatArray
    axis: int
    step: float


class Agreement(NamedTuple):
    """Planes with their motions, their covariance, each plane's median distance of outlines, mm, and the surfaces."""

    planes: list[ImagePlane]
    covariance: FloatArray
    misfit: FloatArray
    bodies: list[RoughSurface]

    def off(self, slice_: ImagePlane) -> float:
        """Median distance of a further slice's outlines from the surfaces, mm, wherever it is moved in its plane."""
        place = slice_.motion
        finders = [ClosestFinder(body.points, body.triangles) for body in self.bodies]
        for reach in _PLACED:
            here = [_Evidence.of([replace(slice_, motion=place)], body.name).points for body in self.bodies]
            away = np.concatenate([p - finder(p).points for finder, p in zip(finders, here)])
            square = np.einsum("qk,qk->q", away, away)
            along = away @ slice_.axes / np.sqrt(square + 1e-9)[:, None]
            weight = 1.0 / (reach * reach + square)
            matrix = (along * weight[:, None]).T @ along + 1e-6 * np.eye(2)
            place = place - np.linalg.solve(matrix, (weight[:, None] * away).sum(axis=0) @ slice_.axes)
        return float(np.sqrt(np.median(square)))


class _Evidence(NamedTuple):
    """Outline points of one object in all planes, where they are now, and how their motions move them."""

    plane: IntArray
    points: FloatArray
    across: FloatArray
    normal: FloatArray
    spacing: FloatArray

    @classmethod
    def of(cls, planes: list[ImagePlane], name: str) -> _Evidence:
        own = [k for k, plane in enumerate(planes) if name in plane.masks]
        edges = [planes[k].edges(name) for k in own]
        size = [len(each.points) for each in edges]
        return cls(
            np.repeat(own, size),
            np.concatenate([planes[k].moved(each.points) for k, each in zip(own, edges)]),
            np.concatenate([each.across @ planes[k].rotation.T for k, each in zip(own, edges)]),
            np.repeat([planes[k].rotation @ planes[k].frame[:, 2] for k in own], size, axis=0),
            np.concatenate([each.spacing for each in edges]),
        )


def agree(planes: list[ImagePlane], bodies: list[RoughSurface]) -> Agreement:
    """Bend surfaces and move planes until both agree.

    Parameters
    ----------
    planes : list of ImagePlane
        Near to where they belong.
    bodies : list of RoughSurface
        Rough surfaces.

    Returns
    -------
    Agreement
    """
    start = np.cumsum([0, *(len(plane.motion) for plane in planes)])
    scale = np.ones(len(planes))
    bend = HeartBend.of(planes)
    for number, stiffness in enumerate(_STIFF):
        precision = np.concatenate([(one * plane.prior) ** -2.0 for one, plane in zip(scale, planes)])
        # Both ends of the stack in each object: they lie somewhere between two slices.
        ends = [12.0 / body.step**2 for body in bodies for _ in range(2)]
        matrix = np.diag([*precision, *ends, *bend.precision])
        right = np.zeros(len(matrix))
        right[: start[-1]] = -precision * np.concatenate([plane.motion - plane.guess for plane in planes])
        bent = [
            _Bent.of(body, planes, start, (2 * k, len(ends)), bend, stiffness, number >= _SPARING)
            for k, body in enumerate(bodies)
        ]
        for one in bent:
            matrix += one.matrix / _ALIKE
            right += one.right / _ALIKE
        motion: FloatArray = np.asarray(np.linalg.solve(matrix, right))
        motion = motion * min(1.0, _MOST / max(float(np.abs(motion).max()), _MOST))
        bodies = [one.moved(motion) for one in bent]
        planes = [replace(p, motion=p.motion + motion[a:b]) for p, a, b in zip(planes, start, start[1:])]
        covariance = np.linalg.inv(matrix)[: start[-1], : start[-1]]
        scale = _scales(planes, np.split(np.diag(covariance), start[1:-1]))
    return Agreement(planes, covariance, _misfits(planes, bodies), bodies)


def _scales(planes: list[ImagePlane], variance: list[FloatArray]) -> FloatArray:
    """How much larger motions are than their priors, for all slices and for all views (empirical Bayes).

    Planes that are hardly displaced are then hardly moved.
    """
    square = [((p.motion - p.guess) ** 2 + v) / p.prior**2 for p, v in zip(planes, variance)]
    scale = np.empty(len(planes))
    for own in ([not p.view for p in planes], [p.view for p in planes]):
        if any(own):
            found = np.concatenate([each for each, one in zip(square, own) if one])
            scale[own] = np.sqrt((_BELIEF + found.sum()) / (_BELIEF + len(found)))
    return np.clip(scale, 0.0, _LARGER)


class _Bent(NamedTuple):
    """Normal equations of the motions with one surface's vertices eliminated, and how these follow."""

    body: RoughSurface
    normals: FloatArray
    matrix: FloatArray
    right: FloatArray
    alone: FloatArray
    followed: FloatArray
    bend: HeartBend

    @classmethod
    def of(
        cls,
        body: RoughSurface,
        planes: list[ImagePlane],
        start: IntArray,
        ends: tuple[int, int],
        bend: HeartBend,
        stiffness: float,
        sparing: bool,
    ) -> _Bent:
        from scipy.sparse import vstack

        points = smooth_tangentially(body.points, body.triangles, _SPREAD)
        shape = Curvature.of(points, body.triangles, _SHARPEST)
        finder = ClosestFinder(points, body.triangles)
        seen = _Evidence.of(planes, body.name)
        pick, normal, height = _feet(finder, shape, seen.points)
        facing = np.einsum("qk,qk->q", seen.across, normal)
        aslant = np.einsum("qk,qk->q", seen.normal, normal) ** 2
        variance = seen.spacing**2 * (facing**2 + _OBLIQUE) / 12.0 + _ASLANT**2 * aslant + _NOISE**2
        # Points far away, and outlines that face the other way, belong to something else.
        weight = np.where(facing > 0.0, 1.0, 1e-3) / (variance + (height / _FAR) ** 2)
        count, (first, more) = int(start[-1]), ends
        jacobian = np.zeros((len(height), count + more))
        for k, plane in enumerate(planes):
            own = seen.plane == k
            jacobian[own, start[k] : start[k + 1]] = plane.jacobian(seen.points[own], normal[own])
        jacobian = np.concatenate([jacobian, bend.heights(seen.points, normal)], axis=1)
        if len(body.ends):
            there, upward, rise = _feet(finder, shape, body.ends)
            pick, height = vstack([pick, there]).tocsr(), np.append(height, rise)
            along = upward[:, body.axis]
            weight = np.append(weight, _END * 12.0 / (body.step**2 * (along**2 + _OBLIQUE)))
            upper = body.ends[:, body.axis] > points[:, body.axis].mean()
            moved = np.zeros((len(rise), count + more))
            moved[np.arange(len(rise)), count + first + upper] = along
            moved = np.concatenate([moved, bend.heights(body.ends, upward)], axis=1)
            jacobian = np.concatenate([jacobian, moved])
        weighted = pick.multiply(weight[:, None]).tocsr()
        labels, pull = weighted.T @ pick, weighted.T @ height
        stiff = shape.lenient(_USUAL, _LEAST) if sparing else shape.stiffness
        solver = Banded((labels + stiffness * (shape.change.T @ stiff @ shape.change)).tocsr())
        coupling = -(weighted.T @ jacobian)
        solved = solver.solve(np.column_stack([coupling, pull - stiffness * (shape.change.T @ (stiff @ shape.mean))]))
        followed, alone = solved[:, :-1], solved[:, -1]
        matrix = jacobian.T @ (weight[:, None] * jacobian) - coupling.T @ followed
        right = -jacobian.T @ (weight * height) - coupling.T @ alone
        return cls(body._replace(points=points), shape.normals, matrix, right, alone, followed, bend)

    def moved(self, motion: FloatArray) -> RoughSurface:
        """The surface as the planes' motions leave it."""
        move = self.alone - self.followed @ motion
        move = move * held_back(move, self.body.triangles)
        points = self.bend.moved(self.body.points, motion[len(motion) - len(self.bend.precision) :])
        return self.body._replace(points=points + move[:, None] * self.normals)


def _feet(finder: ClosestFinder, shape: Curvature, points: FloatArray) -> tuple[Any, FloatArray, FloatArray]:
    """Interpolation from vertices to the closest places of a mesh, unit normals there, heights over them."""
    from scipy.sparse import csr_array

    found = finder(points)
    normal = unit_vectors(found.at(shape.normals))
    rows = np.arange(len(points) + 1) * 3
    pick = csr_array((found.weights.ravel(), found.nodes.ravel(), rows), shape=(len(points), len(finder.points)))
    return pick, normal, np.einsum("qk,qk->q", points - found.points, normal)


def _misfits(planes: list[ImagePlane], bodies: list[RoughSurface]) -> FloatArray:
    """Median distance ``(planes,)`` of outlines from the surfaces, mm."""
    found: list[list[FloatArray]] = [[np.zeros(0)] for _ in planes]
    for body in bodies:
        seen = _Evidence.of(planes, body.name)
        distance = ClosestFinder(body.points, body.triangles)(seen.points).distance
        for k in np.unique(seen.plane):
            found[k].append(distance[seen.plane == k])
    every = [np.concatenate(each) for each in found]
    return np.array([np.median(each) if len(each) else 0.0 for each in every])
