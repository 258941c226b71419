"""A boundary in, what its convex hull holds beside tissue out: cavities, however wide they open."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from femprep.annotation.hull import hull_of
from femprep.annotation.parting import part_cavities
from femprep.annotation.shell import Shell
from femprep.annotation.space import Space, filled, space_of
from femprep.mesh.measures.triangles import area_vectors
from femprep.model import IntArray

#: A cavity holds this share of the largest one at least; grooves between ventricles hold less.
_SHARE: Final = 0.1


def hollows(shell: Shell) -> tuple[Space, IntArray, int]:
    """The space within a boundary's convex hull, the number from 1 of the core each voxel belongs to, and how many are
    cavities: those are the first, the rest are grooves."""
    space = _within_hull(shell, space_of(shell))
    seeds = part_cavities(space)
    size = np.bincount(seeds.ravel())[1:]
    return space, seeds, int(np.count_nonzero(size >= _SHARE * size.max(initial=0)))


def _within_hull(shell: Shell, space: Space) -> Space:
    """The same space, outside being what lies beyond the convex hull."""
    hull = hull_of(shell.points[np.unique(shell.triangles)])
    corners, points = hull.simplices.astype(np.int64), (hull.points - space.origin) / space.step
    inward = np.einsum("ij,ij->i", area_vectors(hull.points, corners), hull.equations[:, :3]) < 0.0
    corners[inward] = corners[inward, ::-1]
    return replace(space, outside=~filled(points, corners, np.array(space.tissue.shape)) & ~space.tissue)
