"""A boundary in, names by what lies within its convex hull out: ventricles open at a base without a rim.

A heart cut at its base and rounded there has no crease that parts endocardium from epicardium, and its mouths are too
wide for a ball to be kept out. Its convex hull closes them. What of the hull is neither tissue nor groove is cavity,
each facet takes the name of what it looks at, and the base is the strip of them that lies across a mouth's rim.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from femprep.annotation.cavities import looks_at, smoothed
from femprep.annotation.chambers import name_cavities, wall_thickness
from femprep.annotation.flat import spread
from femprep.annotation.hull import hull_of
from femprep.annotation.parting import part_cavities
from femprep.annotation.reading import Name, NoReading, Reading
from femprep.annotation.shell import Shell
from femprep.annotation.space import Space, filled, flood, space_of
from femprep.mesh.measures.triangles import area_vectors
from femprep.model import FACET_TAGS, BoolArray

#: A base leans less than this against the mouth's plane, degrees, as creases of a base do.
_LEVEL: Final = 45.0
#: A cavity holds this share of the largest one at least; grooves between ventricles hold less.
_SHARE: Final = 0.1


def by_hull(shell: Shell) -> Reading:
    """One ventricle or two, open at a base that is rounded.

    Raises
    ------
    NoReading
        The hull holds no cavity, or more than two, or one without a mouth.
    """
    space = _within_hull(shell, space_of(shell))
    seeds = part_cavities(space)
    size = np.bincount(seeds.ravel())[1:]
    count = int(np.count_nonzero(size >= _SHARE * size.max(initial=0)))
    if count not in (1, 2):
        raise NoReading(f"the convex hull holds {count} cavities; ventricles have 1 or 2")
    outside = count + 1
    seeds = np.where(seeds > count, outside, seeds)
    basin = flood(space, np.where(space.outside, outside, seeds))
    looks = looks_at(shell, space, basin)
    endo = [looks == k + 1 for k in range(count)]
    base = np.zeros(len(shell), dtype=bool)
    for own in endo:
        base |= _rim(shell, own, looks == outside, 2.0 * max(space.step, shell.edge))
    # A mouth's rim stands out of the hull's voxels in places: what the base parts from the epicardium is none.
    outer = shell.pieces((looks == outside) & ~base) == 0
    names, sure, questions = name_cavities(shell, [own & ~base for own in endo], outer)
    tag = np.where(outer, FACET_TAGS["epi"], 0).astype(np.int32)
    given = {"epi": Name(0.9, "looks out of the convex hull"), "base": Name(0.8, "lies across the rim of a mouth")}
    for name, own in zip(names, endo):
        called = "endo" if count == 1 else f"endo_{name}"
        tag[own] = FACET_TAGS[called]
        given[called] = sure[name]
    tag = spread(shell, tag)
    tag[base] = FACET_TAGS["base"]
    return Reading("convex hull", smoothed(shell, tag.astype(np.int64)).astype(np.int32), given, tuple(questions))


def _within_hull(shell: Shell, space: Space) -> Space:
    """The same space, outside being what lies beyond the convex hull."""
    hull = hull_of(shell.points[np.unique(shell.triangles)])
    corners, points = hull.simplices.astype(np.int64), (hull.points - space.origin) / space.step
    inward = np.einsum("ij,ij->i", area_vectors(hull.points, corners), hull.equations[:, :3]) < 0.0
    corners[inward] = corners[inward, ::-1]
    return replace(space, outside=~filled(points, corners, np.array(space.tissue.shape)) & ~space.tissue)


def _rim(shell: Shell, endo: BoolArray, outer: BoolArray, doubt: float) -> BoolArray:
    """The strip across a mouth's rim: what looks out of the mouth, no farther from the rim than the wall is thick."""
    mouth = shell.vector[endo].sum(axis=0)  # that of any cap, as cap and endocardium close
    level = shell.normal @ (mouth / np.linalg.norm(mouth)) > np.cos(np.radians(_LEVEL))
    apart = shell.pairs[(endo[shell.pairs].sum(axis=1) == 1) & (outer[shell.pairs].sum(axis=1) == 1)].ravel()
    if not len(apart):
        raise NoReading("a cavity of the convex hull has no mouth")
    # Where the sides meet is known to two voxels or edges.
    beside = shell.along(apart, doubt) < np.inf
    reach = doubt + wall_thickness(shell, endo, outer)
    return np.asarray((shell.along(apart, reach, level | beside) < np.inf) & level)
