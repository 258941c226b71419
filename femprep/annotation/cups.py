"""A boundary in, names by what lies within its convex hull out: ventricles open at a base without a rim.

A heart cut at its base and rounded there has no crease that parts endocardium from epicardium, and its mouths are too
wide for a ball to be kept out. Its convex hull closes them. What of the hull is neither tissue nor groove is cavity,
each facet takes the name of what it looks at, and the base is the strip of them that lies across a mouth's rim.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from femprep.annotation.cavities import looks_at, smoothed
from femprep.annotation.chambers import name_cavities, wall_thickness
from femprep.annotation.flat import spread
from femprep.annotation.hollows import hollows
from femprep.annotation.reading import Name, NoReading, Reading
from femprep.annotation.shell import Shell
from femprep.annotation.space import flood
from femprep.mesh.topology import components
from femprep.model import FACET_TAGS, BoolArray, FloatArray, endocardium
from femprep.model.products import product, unit_vectors

#: A base leans less than this against the mouth's plane, degrees, as creases of a base do.
_LEVEL: Final = 45.0
#: Mouths of a ventricle at most, and how wide one is at least, mm; left atria have four or more.
_MOUTHS, _LEAST = 3, 5.0
#: Ways out of a ventricle differ by less than this, degrees; those of an atrium from vein to vein by more.
_APART: Final = 120.0


def by_hull(shell: Shell) -> Reading:
    """One ventricle or two, open at a base that is rounded.

    Raises
    ------
    NoReading
        The hull holds no cavity, or more than two, or one without a mouth.
    """
    space, seeds, count = hollows(shell)
    if count not in (1, 2):
        raise NoReading(f"the convex hull holds {count} cavities; ventricles have 1 or 2")
    outside = count + 1
    seeds = np.where(seeds > count, outside, seeds)
    basin = flood(space, np.where(space.outside, outside, seeds))
    looks = looks_at(shell, space, basin)
    endo = [looks == k + 1 for k in range(count)]
    base = np.zeros(len(shell), dtype=bool)
    doubt = 2.0 * max(space.step, shell.edge)
    for own in endo:
        mouths = _mouths(shell, own, looks == outside, doubt)
        # A ventricle with a hole in its apex has two that look apart.
        if len(mouths) > _MOUTHS or (len(mouths) > 2 and _look_apart(mouths - shell.centre[own].mean(axis=0))):
            where = " on opposite sides" if len(mouths) <= _MOUTHS else ""
            raise NoReading(f"a cavity of the convex hull has {len(mouths)} mouths{where}: an atrium, and no ventricle")
        base |= _rim(shell, own, looks == outside, doubt)
    # A mouth's rim stands out of the hull's voxels in places: what the base parts from the epicardium is none.
    outer = shell.pieces((looks == outside) & ~base) == 0
    names, sure, questions = name_cavities(shell, [own & ~base for own in endo], outer)
    tag = np.where(outer, FACET_TAGS["epi"], 0).astype(np.int32)
    given = {"epi": Name(0.9, "looks out of the convex hull"), "base": Name(0.8, "lies across the rim of a mouth")}
    for name, own in zip(names, endo):
        called = endocardium(name, alone=count == 1)
        tag[own] = FACET_TAGS[called]
        given[called] = sure[name]
    tag = spread(shell, tag)
    tag[base] = FACET_TAGS["base"]
    return Reading("convex hull", smoothed(shell, tag.astype(np.int64)).astype(np.int32), given, tuple(questions))


def _look_apart(ways: FloatArray) -> bool:
    """Whether two of the ways ``(n, 3)`` out of a cavity differ by more than ways out of a ventricle do."""
    unit = unit_vectors(ways)
    return bool((product(unit, unit.T) < np.cos(np.radians(_APART))).any())


def _mouths(shell: Shell, endo: BoolArray, outer: BoolArray, doubt: float) -> FloatArray:
    """Middles of the lines, wider than a mouth is at least, that part a cavity from the outside."""
    apart = shell.pairs[(endo[shell.pairs].sum(axis=1) == 1) & (outer[shell.pairs].sum(axis=1) == 1)]
    at = shell.centre[apart].mean(axis=1)
    if not len(at):
        return np.empty((0, 3))
    near = cKDTree(at).query_pairs(doubt, output_type="ndarray")
    line = components(near[:, 0], near[:, 1], len(at))
    mouths = [at[line == k] for k in np.unique(line)]
    return np.array([own.mean(axis=0) for own in mouths if np.ptp(own, axis=0).max() > _LEAST]).reshape(-1, 3)


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
