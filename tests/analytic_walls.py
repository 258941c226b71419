"""Ellipsoidal left-ventricular walls with exact flat bases, as Wall objects whose volume has a closed form."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from femprep.model import FACET_TAGS, Plane, Wall


def disc_rings(rings: int) -> np.ndarray:
    """Triangles of a disc of concentric rings, ring k of 6 k points, counter-clockwise: well-shaped everywhere."""
    start = [0] + [1 + 3 * k * (k - 1) for k in range(1, rings + 1)]
    cells = []
    for k in range(1, rings + 1):
        for side in range(6):
            for step in range(k):
                outer = side * k + step
                inner = side * (k - 1) + step

                def at(ring: int, index: int) -> int:
                    return 0 if ring == 0 else start[ring] + index % (6 * ring)

                cells.append((at(k, outer), at(k, outer + 1), at(k - 1, inner)))
                if step < k - 1:
                    cells.append((at(k, outer + 1), at(k - 1, inner + 1), at(k - 1, inner)))
    return np.array(cells, dtype=np.int64)


def bowl(axes: tuple[float, float, float], height: float, rings: int) -> np.ndarray:
    """Points of the lower part of an ellipsoid about the origin, up to z = height, in the order of disc_rings."""
    end = np.arccos(-height / axes[2])
    points = [(0.0, 0.0, -axes[2])]
    for k in range(1, rings + 1):
        polar = end * k / rings
        for j in range(6 * k):
            azimuth = 2.0 * np.pi * j / (6 * k)
            z = height if k == rings else -axes[2] * np.cos(polar)
            points.append((axes[0] * np.sin(polar) * np.cos(azimuth), axes[1] * np.sin(polar) * np.sin(azimuth), z))
    return np.array(points)


def ellipsoid_wall(
    endo: tuple[float, float, float] = (22.0, 22.0, 42.0),
    epi: tuple[float, float, float] = (31.0, 31.0, 51.0),
    height: float = 10.0,
    rings: int = 14,
    layers: int = 3,
) -> Wall:
    """A thick ellipsoid cut flat at z = height, apex closed, tags endo, epi and base."""
    cells = disc_rings(rings)
    inner, outer = bowl(endo, height, rings), bowl(epi, height, rings)
    n, ring = len(inner), 6 * rings
    first = n - ring
    rim_inner, rim_outer = inner[first:], outer[first:]
    between = [rim_inner + (rim_outer - rim_inner) * i / layers for i in range(1, layers)]
    points = np.concatenate([inner, outer, *between])
    loops = [
        np.arange(first, n),
        *(2 * n + ring * i + np.arange(ring) for i in range(layers - 1)),
        n + np.arange(first, n),
    ]
    base = []
    for a, b in pairwise(loops):
        a_next, b_next = np.roll(a, -1), np.roll(b, -1)
        base += [np.column_stack([a, b, b_next]), np.column_stack([a, b_next, a_next])]
    caps = np.concatenate(base)
    # disc_rings turns counter-clockwise seen from +z: on the endocardium towards the cavity, out of the tissue.
    triangles = np.concatenate([cells, cells[:, ::-1] + n, caps])
    tags = np.repeat([FACET_TAGS["endo"], FACET_TAGS["epi"], FACET_TAGS["base"]], [len(cells), len(cells), len(caps)])
    template = np.full(len(points), -1)
    template[: 2 * n] = np.tile(np.arange(n), 2)
    plane = Plane(point=np.array([0.0, 0.0, height]), normal=np.array([0.0, 0.0, 1.0]))
    return Wall(points, triangles, tags, template, planes={"base": plane})


def cut_ellipsoid_volume(axes: tuple[float, float, float], height: float) -> float:
    """Volume of an ellipsoid below z = height, mm3."""
    a, b, c = axes
    t = height / c
    return float(np.pi * a * b * c * (2.0 / 3.0 + t - t**3 / 3.0))
