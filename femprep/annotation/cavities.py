"""A boundary in, names by the space between its walls out: chambers, valves, vessels, whatever is open.

Every facet looks into a chamber, or outside. Where two chambers, or a chamber and the outside, meet in open space there
is an opening; the ring of tissue around it is named after it. A wall that has the outside, or a vessel's inside, on
both of its faces is that of a vessel.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.ndimage import label
from scipy.spatial import cKDTree

from femprep.annotation.chambers import name_cavities
from femprep.annotation.flat import spread
from femprep.annotation.openings import VESSELS, Patch, openings_of, without_atria
from femprep.annotation.parting import part_cavities
from femprep.annotation.reading import CavityOpening, Name, NoReading, Reading
from femprep.annotation.shell import Shell
from femprep.annotation.space import Space, flood, reached_far, space_of
from femprep.annotation.vein_ends import vein_rim
from femprep.model import FACET_TAGS, BoolArray, IntArray, endocardium

#: Walls of vessels are thinner than this, mm; their insides narrower than a ball of this radius, mm.
_THIN, VESSEL_BALL = 5.0, 40.0
#: The core of a vessel is as wide as this share of its opening.
_LUMEN: Final = 0.5
#: Rounds in which a facet takes the name that most of its neighbours have.
_ROUNDS: Final = 3
#: How far the ring around an opening reaches along the surface from where the space is parted, into the cavity and
#: beyond, mm. The ring of an atrioventricular valve lies on the ventricle's side of the narrowest place; the rim of
#: a vein is told otherwise.
RINGS: Final = {
    "mitral": (4.0, 0.0),
    "tricuspid": (4.0, 0.0),
    "aortic": (2.0, 2.0),
    "pulmonary": (2.0, 2.0),
}
#: Where the space is parted this near to an opening belongs to it, mm.
_BESIDE: Final = 8.0


def by_cavities(shell: Shell) -> Reading:
    """Chambers by the space between the walls, valves and vessels by where it opens.

    Raises
    ------
    NoReading
        There is no cavity, or another number of chambers than a heart has.
    """
    space = space_of(shell)
    seeds = part_cavities(space)
    count = int(seeds.max(initial=0))
    if count not in (1, 2, 4):
        raise NoReading(f"the space between the walls holds {count} cavities; a heart has 1, 2 or 4")
    outside = count + 1
    basin = flood(space, np.where(space.outside, outside, seeds))
    looks = looks_at(shell, space, basin)
    names, sure, questions = name_cavities(shell, [looks == k + 1 for k in range(count)], looks == outside)
    parts: list[str | None] = [*names, None]
    openings = openings_of(space, basin, parts)
    far = reached_far(space, VESSEL_BALL)
    vessels = _lumens(space, (basin == outside) & ~far, openings)
    alone = basin, looks, parts, openings
    while vessels:
        # Vessels take part in the flood, so that their valves lie where the way through is narrowest.
        found = np.where(space.outside, np.where(far, outside, 0), seeds)
        for k, own in enumerate(vessels.values(), outside + 1):
            found[own] = k
        parts = [*alone[2], *vessels]
        basin = flood(space, found)
        looks = looks_at(shell, space, basin)
        openings = openings_of(space, basin, parts)
        thin = {name: _is_thin(shell, space, basin, looks == k) for k, name in enumerate(vessels, outside + 1)}
        if all(thin.values()):
            break
        # A hole through the wall of a chamber, or a chamber that the ball reached, is the inside of no vessel.
        vessels = {name: own for name, own in vessels.items() if thin[name]}
        basin, looks, parts, openings = alone
    if count < 4:
        openings = without_atria(shell, openings, count, len(vessels))
    tag = np.full(len(shell), FACET_TAGS["epi"], dtype=np.int32)
    given = {"epi": Name(0.95, "looks outside")}
    for k, name in enumerate(names):
        endo = endocardium(name, alone=count == 1)
        tag[looks == k + 1] = FACET_TAGS[endo]
        given[endo] = sure[name]
    behind = _behind(shell, space, basin, looks == outside)
    for k, part in enumerate(parts[outside:], outside + 1):
        assert part is not None
        tag[(looks == k) | (behind == k)] = FACET_TAGS[part]
        given[part] = Name(0.9, "the inside of the vessel that begins at its valve is on one of its faces")
    _ends(shell, tag, (behind == outside) & (looks == outside), [FACET_TAGS[part] for part in vessels])
    _rings(shell, tag, looks, parts, openings, given)
    return Reading("cavities", spread(shell, tag), given, tuple(questions), tuple(one for one, _ in openings))


def looks_at(shell: Shell, space: Space, basin: IntArray) -> IntArray:
    """What each facet looks at: the number of the basin in front of it."""
    normal = shell.normal
    looks = np.zeros(len(shell), dtype=np.int64)
    for far in (0.7, 1.0, 1.4, 0.4, 1.8):
        empty = looks == 0
        if not empty.any():
            break
        looks[empty] = space.at(basin, shell.centre[empty] + far * space.step * normal[empty])
    looks = spread(shell, looks)
    return smoothed(shell, looks)


def smoothed(shell: Shell, looks: IntArray) -> IntArray:
    """Single facets that look elsewhere than all around them take their neighbours' side."""
    count = int(looks.max()) + 1
    for _ in range(_ROUNDS):
        beside = np.zeros((len(looks), count))
        np.add.at(beside, (shell.pairs[:, 0], looks[shell.pairs[:, 1]]), 1.0)
        np.add.at(beside, (shell.pairs[:, 1], looks[shell.pairs[:, 0]]), 1.0)
        most = beside.argmax(axis=1)
        turn = (most != looks) & (beside[np.arange(len(looks)), most] >= 2.0)
        if not turn.any():
            break
        looks = np.where(turn, most, looks)
    return looks


def _lumens(space: Space, sheltered: BoolArray, openings: list[tuple[CavityOpening, Patch]]) -> dict[str, BoolArray]:
    """Where the inside of a vessel begins, beyond a ventricle's opening to the outside."""
    found: dict[str, BoolArray] = {}
    for opening, patch in openings:
        if opening.name not in VESSELS:
            continue
        radius = float(np.sqrt(patch.area / np.pi))
        # Narrower places beside it are grooves between vessels.
        wide = sheltered & (space.width >= _LUMEN * radius)
        piece = label(wide)[0]
        near = np.argwhere(wide)
        at = space.world(near) - patch.centre
        own = near[(np.linalg.norm(at - radius * patch.normal, axis=1) < 1.2 * radius) & (at @ patch.normal > 0.0)]
        if len(own):
            beyond = np.bincount(piece[tuple(own.T)]).argmax()
            mask = found.setdefault(VESSELS[opening.name], np.zeros(sheltered.shape, dtype=bool))
            mask |= piece == beyond
    return found


def _behind(shell: Shell, space: Space, basin: IntArray, outer: BoolArray) -> IntArray:
    """What lies on the other face of the wall behind outer facets; 0 where the wall is thick."""
    normal, behind = shell.normal, np.zeros(len(shell), dtype=np.int64)
    for depth in np.arange(0.75 * space.step, _THIN + space.step, 0.5 * space.step):
        rows = np.flatnonzero(outer & (behind == 0))
        behind[rows] = space.at(basin, shell.centre[rows] - depth * normal[rows])
    return behind


def _is_thin(shell: Shell, space: Space, basin: IntArray, inner: BoolArray) -> bool:
    """Whether the wall of what some facets look into is that of a vessel: open on its other face, nearly everywhere."""
    area = shell.area[inner]
    return bool(area[_behind(shell, space, basin, inner)[inner] > 0].sum() > 0.5 * area.sum())


def _ends(shell: Shell, tag: np.ndarray, bare: BoolArray, vessels: list[int]) -> None:
    """Walls with the outside on both of their faces, as where a vessel is cut off, join the vessel beside them."""
    pairs = shell.pairs[bare[shell.pairs].any(axis=1)]
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    while True:
        own = pairs[np.isin(tag[pairs[:, 0]], vessels) & bare[pairs[:, 1]] & (tag[pairs[:, 1]] == FACET_TAGS["epi"])]
        if not len(own):
            return
        tag[own[:, 1]] = tag[own[:, 0]]


def _rings(
    shell: Shell,
    tag: np.ndarray,
    looks: IntArray,
    parts: list[str | None],
    openings: list[tuple[CavityOpening, Patch]],
    given: dict[str, Name],
) -> None:
    """Name the ring of tissue around each opening."""
    for opening, patch in openings:
        near = cKDTree(patch.points)
        inside = looks == parts.index(opening.cavity) + 1
        apart = shell.pairs[inside[shell.pairs].sum(axis=1) == 1].ravel()
        apart = apart[near.query(shell.centre[apart], distance_upper_bound=_BESIDE)[0] < _BESIDE]
        if opening.name == "veins":
            own = vein_rim(shell, inside, apart, patch.normal)
        else:
            within, beyond = RINGS[opening.name]
            own = shell.along(apart, max(within, beyond)) < np.where(inside, within, beyond)
        tag[own] = FACET_TAGS[opening.name]
        given[opening.name] = Name(0.85, "the tissue around an opening between chambers, or of one to the outside")
