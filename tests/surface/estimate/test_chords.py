"""The outset surface: triangles with their corners on it hold the volume; where it is a saddle it stays."""

from __future__ import annotations

import numpy as np
import trimesh

from femprep.mesh.measures.triangles import areas
from femprep.mesh.patches import PatchSurface
from femprep.mesh.topology import volume
from femprep.phantoms import rv_bent
from femprep.surface.estimate.chords import outset


def test_ball_keeps_its_volume() -> None:
    fine, coarse = (trimesh.creation.icosphere(subdivisions=n, radius=20.0) for n in (4, 2))
    surface = PatchSurface(np.asarray(fine.vertices), np.asarray(fine.faces, dtype=np.int64))
    cells = np.asarray(coarse.faces, dtype=np.int64)
    area = float(areas(np.asarray(coarse.vertices), cells).mean())
    moved = outset(surface, np.full(len(surface.points), area))
    true = 4.0 / 3.0 * np.pi * 20.0**3
    plain, ours = (volume(s.project(np.asarray(coarse.vertices))[0], cells) for s in (surface, moved))
    assert plain < 0.97 * true
    assert abs(ours / true - 1.0) < 0.005


def test_moves_with_the_curvature_and_saddles_stay() -> None:
    ball = trimesh.creation.icosphere(subdivisions=5)
    directions, cells = np.asarray(ball.vertices), np.asarray(ball.faces, dtype=np.int64)
    points = rv_bent().exact_surface("rv", directions)
    surface = PatchSurface(points, cells if volume(points, cells) > 0.0 else cells[:, ::-1])
    moved = outset(surface, np.full(len(points), 8.0))
    off = np.linalg.norm(moved.points - surface.points, axis=1)
    bend = np.trace(surface.bend(), axis1=1, axis2=2)
    assert off[np.abs(bend) < 0.005].max() < 0.02
    assert np.median(off) > 0.02
    assert off.max() <= 8.0 * 0.4 / (4.0 * np.sqrt(3.0)) * 1.001
