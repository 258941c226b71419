"""Planes with first motions and rough surfaces in, motions and surfaces that agree best with all of them out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np

from femprep.mesh.banded import Banded
from femprep.mesh.curvature import Curvature
from femprep.mesh.operations.tangential_smoothing import smooth_tangentially
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.measures.triangles import vertex_sums
from femprep.model import FloatArray, IntArray
from femprep.model.products import unit_vectors
from femprep.surface.alignment.planes import ImagePlane
from femprep.surface.estimate.estimate import _held_back

_SHARPEST: Final = 0.2
_USUAL, _LEAST = 0.005, 0.005


class Body(NamedTuple):
    """One object's surface while it is bent, and what the planes show of it."""

    name: str
    points: FloatArray
    triangles: IntArray
    caps: FloatArray = np.zeros((0, 3))
    axis: int = 2
    step: float = 8.0


class Evidence(NamedTuple):
    points: FloatArray
    across: FloatArray
    spacing: FloatArray
    plane: IntArray


def evidence(planes: list[ImagePlane], name: str, step: int = 1) -> Evidence:
    found: list = []
    number = []
    for k, p in enumerate(planes):
        if name not in p.masks:
            continue
        e = p.edges(name)
        found.append(e)
        number.append(np.full(len(e.points), k))
    return Evidence(*(np.concatenate(x) for x in zip(*found)), np.concatenate(number))


class Settings(NamedTuple):
    stiff: tuple[float, ...] = (3000.0, 1000.0, 1000.0, 1000.0, 1000.0, 1000.0)
    soft: float = 3.0          # student scale
    noise: float = 0.4
    across: float = 1.0
    edges: int = 3
    alike: float = 3.0
    cap: float = 0.1   # information per observation divided by this


class Agreement(NamedTuple):
    planes: list[ImagePlane]
    bodies: list[Body]
    covariance: FloatArray
    misfit: FloatArray


def agree(planes, bodies):
    planes, bodies, covariance = joint(planes, bodies)
    return Agreement(planes, bodies, covariance, misfits(planes, bodies))


def misfits(planes, bodies):
    found = [[np.zeros(0)] for _ in planes]
    for body in bodies:
        finder = ClosestFinder(body.points, body.triangles)
        for k, plane in enumerate(planes):
            if body.name in plane.masks:
                found[k].append(finder(plane.moved(plane.edges(body.name).points)).distance)
    return np.array([np.median(np.concatenate(f)) if any(len(x) for x in f) else 0.0 for f in found])


def joint(planes: list[ImagePlane], bodies: list[Body], s: Settings = Settings(), trace=None):
    start = np.cumsum([0, *(len(p.motion) for p in planes)])
    count = int(start[-1])
    seen = {b.name: evidence(planes, b.name) for b in bodies}
    for round_, stiff in enumerate(s.stiff):
        prior = np.concatenate([1.0 / p.prior**2 for p in planes])
        matrix = np.diag(prior)
        right = -prior * np.concatenate([p.motion for p in planes])
        solved = []
        for body in bodies:
            points = smooth_tangentially(body.points, body.triangles, 5)
            ev = seen[body.name]
            solved.append(_system(points, body, ev, planes, start, count, stiff, s, round_ >= s.edges))
            app, bp, aup, bu, solver = solved[-1][1:]
            back = solver.solve(np.column_stack([aup, bu]))
            solved[-1] = (*solved[-1][:1], back)
            matrix += (app - aup.T @ back[:, :-1]) / s.alike
            right += (bp - aup.T @ back[:, -1]) / s.alike
        move = np.linalg.solve(matrix, right)
        move *= min(1.0, 4.0 / max(np.abs(move).max(), 1e-9))
        new = []
        for body, ((points, normals), back) in zip(bodies, solved):
            u = back[:, -1] - back[:, :-1] @ move
            new.append(body._replace(points=points + (u * _held_back(u, body.triangles))[:, None] * normals))
        bodies = new
        planes = [replace(p, motion=p.motion + move[a : a + len(p.motion)]) for p, a in zip(planes, start)]
        if trace:
            trace(round_, planes, bodies, matrix)
    return planes, bodies, np.linalg.inv(matrix)


def _system(points, body, ev, planes, start, count, stiff, s, edges):
    from scipy.sparse import coo_matrix

    shape = Curvature.of(points, body.triangles, _SHARPEST)
    finder = ClosestFinder(points, body.triangles)
    moved, across = np.empty_like(ev.points), np.empty_like(ev.points)
    out_of = np.empty_like(ev.points)
    for k, p in enumerate(planes):
        own = ev.plane == k
        if own.any():
            moved[own] = p.moved(ev.points[own])
            across[own] = ev.across[own] @ p.rotation.T
            out_of[own] = p.rotation @ p.frame[:, 2]
    found = finder(moved)
    normal = unit_vectors(found.at(shape.normals))
    height = np.einsum("qk,qk->q", moved - found.points, normal)
    facing = np.einsum("qk,qk->q", across, normal)
    oblique = np.einsum("qk,qk->q", out_of, normal) ** 2
    variance = ev.spacing**2 * (facing**2 + 0.02) / 12.0 + s.across**2 * oblique + s.noise**2
    weight = 1.0 / (variance * (1.0 + height**2 / (s.soft**2 * variance)))
    weight = np.where(facing > 0.0, weight, 1e-3 * weight)
    jac = np.zeros((len(height), count))
    for k, p in enumerate(planes):
        own = np.flatnonzero(ev.plane == k)
        if len(own):
            jac[own[:, None], np.arange(start[k], start[k + 1])] = p.jacobian(moved[own], normal[own])
    n = len(points)
    rows = np.repeat(np.arange(len(height)), 3)
    w_u = coo_matrix((found.weights.ravel(), (rows, found.nodes.ravel())), shape=(len(height), n)).tocsr()
    scaled = w_u.multiply(weight[:, None]).tocsr()
    auu = (scaled.T @ w_u).tocsr()
    aup = -(scaled.T @ jac)
    app = jac.T @ (weight[:, None] * jac)
    bp = -jac.T @ (weight * height)
    bent = shape.lenient(_USUAL, _LEAST) if edges else shape.stiffness
    energy = shape.change.T @ bent @ shape.change
    slope = shape.change.T @ (bent @ shape.mean)
    bu = scaled.T @ height - stiff * slope
    if len(body.caps) and s.cap:
        at = finder(body.caps)
        up = unit_vectors(at.at(shape.normals))
        rise = np.einsum("qk,qk->q", body.caps - at.points, up)
        w = s.cap * 12.0 / (body.step**2 * (up[:, body.axis] ** 2 + 0.02))
        pick = coo_matrix((at.weights.ravel(), (np.repeat(np.arange(len(rise)), 3), at.nodes.ravel())), shape=(len(rise), n)).tocsr()
        scaled = pick.multiply(w[:, None]).tocsr()
        auu = auu + scaled.T @ pick
        bu = bu + scaled.T @ rise
    solver = Banded((auu + stiff * energy).tocsr())
    return (points, shape.normals), app, bp, aup, bu, solver
