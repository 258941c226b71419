"""Surfaces and label objects with known answers, for the tests of the surface stage."""

from __future__ import annotations

import numpy as np
import trimesh

from femprep.image import Grid, LabelObject, make_object
from femprep.model import FloatArray, Surface
from femprep.template import charge_template

#: Directions of the vertices of random bodies, and their triangles.
BALL = charge_template(2500)


def sphere(radius: float = 20.0, centre=(0.0, 0.0, 0.0), subdivisions: int = 4, name: str = "sphere") -> Surface:
    """A sphere of triangles with its vertices on the radius."""
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return Surface(np.asarray(mesh.vertices) + np.asarray(centre), mesh.faces, name=name)


def box(extents=(2.0, 2.0, 2.0)) -> Surface:
    """A box of twelve triangles about the origin."""
    mesh = trimesh.creation.box(extents=extents)
    return Surface(mesh.vertices, mesh.faces, name="box")


def cube_of_quads() -> Surface:
    """The cube from 0 to 1 as six quadrilaterals."""
    points = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)[
        [0, 1, 3, 2, 4, 5, 7, 6]
    ]
    quads = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    return Surface(points, np.array(quads), name="cube")


def rotation(seed: int, mirrored: bool = False) -> np.ndarray:
    """A random orthonormal matrix, of determinant 1 or (mirrored) -1."""
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    turn[:, 0] *= np.sign(np.linalg.det(turn)) * (-1.0 if mirrored else 1.0)
    return turn


def moved(surface: Surface, seed: int) -> Surface:
    """The surface turned and shifted."""
    turn = rotation(seed)
    shift = np.random.default_rng(seed + 1).normal(scale=50.0, size=3)
    return Surface(surface.points @ turn.T + shift, surface.cells, name=surface.name)


def ball_object(
    radius: float = 20.0, spacing=(1.4, 1.4, 8.0), seed: int | None = None, mirrored: bool = False
) -> tuple[LabelObject, np.ndarray]:
    """A ball as labels, on an oblique grid where a seed is given, and its centre in the world."""
    spacing = np.array(spacing)
    half = np.ceil(radius / spacing).astype(int) + 2
    index = np.indices(2 * half + 1).reshape(3, -1).T - half
    mask = (np.linalg.norm(index * spacing, axis=1) < radius).reshape(2 * half + 1)
    direction = np.eye(3) if seed is None else rotation(seed, mirrored)
    grid = Grid(mask.shape, spacing, np.array([30.0, -40.0, 12.0]), direction)
    return make_object(mask, grid, "ball"), grid.to_world(half[None, :].astype(float))[0]


def body(lengths: tuple[float, ...], waves: list[float], bend: float) -> FloatArray:
    """An ellipsoid with waves of up to a fifth of its radius, its long axis bent to a part of a circle; mm."""
    x, y, z = BALL.directions.T
    basis = np.stack([x * y, y * z, x * z, x * x - y * y, 3.0 * z * z - 1.0, x * (5.0 * z * z - 1.0)])
    share = 1.0 + 0.2 * np.tanh(np.asarray(waves) @ basis)
    x, y, z = (BALL.directions * share[:, None] * lengths).T
    if bend < 0.05:
        return np.column_stack([x, y, z])
    half = max(lengths[2], 1.5 * lengths[0] * bend)
    radius = half / bend
    angle = z / radius
    return np.column_stack([radius - (radius - x) * np.cos(angle), y, (radius - x) * np.sin(angle)])
