"""Basins of a heart's space in, where they meet out: openings between chambers, into vessels and to the outside."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.ndimage import label

from femprep.annotation.hollows import hollows
from femprep.annotation.reading import CavityOpening, NoReading
from femprep.annotation.shell import Shell
from femprep.annotation.space import Space
from femprep.model import FloatArray, IntArray

#: Openings by what they lie between; None is the outside.
OPENINGS: Final = {
    ("lv", "la"): "mitral",
    ("rv", "ra"): "tricuspid",
    ("lv", None): "aortic",
    ("rv", None): "pulmonary",
    ("lv", "aorta_wall"): "aortic",
    ("rv", "pulmonary_artery_wall"): "pulmonary",
    ("la", None): "veins",
    ("ra", None): "veins",
}
#: Walls of vessels, by the opening they begin at.
VESSELS: Final = {"aortic": "aorta_wall", "pulmonary": "pulmonary_artery_wall"}
#: An opening has this area at least, mm2.
_AREA: Final = 20.0


@dataclass(frozen=True, eq=False)
class Patch:
    """Where two seeds of the flood meet: centre, normal from the first to the second, area (mm2), voxels (mm), and
    whether the second is a vessel's."""

    centre: FloatArray
    normal: FloatArray
    area: float
    points: FloatArray
    led: bool = False


def openings_of(space: Space, basin: IntArray, parts: list[str | None]) -> list[tuple[CavityOpening, Patch]]:
    """Where parts of the space meet; normals out of the ventricle, or out of the atrium to the outside."""
    found = []
    for (inner, beyond), name in OPENINGS.items():
        if inner not in parts or (beyond is not None and beyond not in parts):
            continue
        one, other = parts.index(inner) + 1, parts.index(beyond) + 1
        patches = [replace(each, led=beyond in VESSELS.values()) for each in _patches(space, basin, one, other)]
        found += [(CavityOpening(name, inner, each.centre, each.normal, each.area), each) for each in patches]
    return found


def without_atria(
    shell: Shell, openings: list[tuple[CavityOpening, Patch]], count: int, vessels: int
) -> list[tuple[CavityOpening, Patch]]:
    """Openings of ventricles without atria: the larger one led to the atrium, the smaller one into the artery.

    Raises
    ------
    NoReading
        A cavity has another number of openings, or another one is too wide to keep a ball out.
    """
    held = hollows(shell)[2]
    if held > count + vessels:
        raise NoReading(f"{count} of the {held} cavities that the convex hull holds keep a ball out")
    found = []
    for name, upper in (("lv", "mitral"), ("rv", "tricuspid"))[:count]:
        own = sorted((one for one in openings if one[0].cavity == name), key=lambda one: -one[1].area)
        if len(own) != 2:
            raise NoReading(f"{len(own)} openings; a ventricle without an atrium has 2, or is open all round")
        led = next((k for k, (_, patch) in enumerate(own) if patch.led), 1)
        found += [(replace(own[1 - led][0], name=upper), own[1 - led][1]), own[led]]
    return found


def _patches(space: Space, basin: IntArray, one: int, other: int) -> list[Patch]:
    """Where two basins meet in open space, as patches of voxel faces."""
    wide = space.width > 1.0 * space.step
    at, way = [], []
    for axis in range(3):
        low, high = [slice(None)] * 3, [slice(None)] * 3
        low[axis], high[axis] = slice(None, -1), slice(1, None)
        a, b = basin[tuple(low)], basin[tuple(high)]
        clear = wide[tuple(low)] & wide[tuple(high)]
        for sign, first, second in ((1.0, one, other), (-1.0, other, one)):
            here = np.argwhere((a == first) & (b == second) & clear)
            step = np.zeros(3)
            step[axis] = 0.5
            at.append(here + step)
            way.append(np.tile(2.0 * sign * step, (len(here), 1)))
    index, normal = np.concatenate(at), np.concatenate(way)
    if not len(index):
        return []
    mask = np.zeros(np.array(basin.shape) + 1, dtype=bool)
    cell = np.floor(index).astype(np.int64)
    mask[tuple(cell.T)] = True
    number = label(mask, np.ones((3, 3, 3)))[0][tuple(cell.T)]
    found = []
    for k in np.unique(number):
        own = number == k
        flow = normal[own].sum(axis=0) * space.step**2
        area = float(np.linalg.norm(flow))
        if area >= _AREA:
            points = space.world(index[own])
            found.append(Patch(points.mean(axis=0), flow / area, area, points))
    return sorted(found, key=lambda patch: -patch.area)
