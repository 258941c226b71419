"""A wall with tissue in it in, the share of the wall's thickness that the tissue takes out, by AHA segment.

Lines through the wall run at one height and angle of the coordinates from the endocardium outward, through the septum
to the other endocardium. Each stands for the area of its patch of the mid-wall.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from femprep.anatomy.tissue.field import TissueField
from femprep.anatomy.tissue.levels import classes_of
from femprep.anatomy.wall_parts import WallPart, depth_chart
from femprep.mesh.search.locate import Located, Locator
from femprep.model import FloatArray

#: Points of a line through a wall.
_DEPTHS: Final = 32
#: Distance of lines, mm, roughly.
_STEP: Final = 2.5
#: Tissue counts on lines where it takes this share or more: less is the rim of its corners.
_LEAST: Final = 0.1


class Through(NamedTuple):
    """Mean transmurality of one tissue, %: of all its lines, and of those in each of the 17 segments."""

    whole: float | None
    segments: list[float | None]


def transmurality(field: TissueField, levels: FloatArray) -> list[Through]:
    """Share of the thickness that each tissue takes on the lines that it lies on."""
    found = {part.number: k for k, part in enumerate(field.parts)}
    if 0 not in found:
        return [Through(None, [None] * 17)] * len(levels)
    part = field.parts[found[0]]
    heights, angles = _lines(part)
    taken, inside, area, element = _taken(field, found[0], heights, angles, levels)
    if 2 in found:
        other, there, _, _ = _taken(field, found[2], heights, angles, levels)
        taken = np.where(there[:, None], 0.5 * (taken + other), taken)
    aha = field.mesh.cell_data.get("aha")
    segment = np.zeros(len(area), dtype=int) if aha is None else np.asarray(aha)[part.cells[element]]
    out = []
    for share in taken.T:
        on = inside & (share >= _LEAST)
        out.append(Through(_mean(share, area, on), [_mean(share, area, on & (segment == k)) for k in range(1, 18)]))
    return out


def _lines(part: WallPart) -> tuple[FloatArray, FloatArray]:
    """Heights and angles (radians) of the lines, on a grid ``(rows, columns)``."""
    _, length, radius = part.sizes
    rows = int(np.clip(round(length / _STEP), 12, 60))
    columns = int(np.clip(round(2 * math.pi * radius / _STEP), 24, 120))
    heights, angles = (np.arange(rows) + 0.5) / rows, 2 * math.pi * (np.arange(columns) + 0.5) / columns
    return np.meshgrid(heights, angles, indexing="ij")


def _taken(
    field: TissueField, number: int, heights: FloatArray, angles: FloatArray, levels: FloatArray
) -> tuple[FloatArray, np.ndarray, FloatArray, np.ndarray]:
    """Per line: share of each tissue ``(lines, tissues)``, whether it lies in the part, its area, its element."""
    part = field.parts[number]
    thickness, length, _ = part.sizes
    depths = (np.arange(_DEPTHS) + 0.5) / _DEPTHS
    shape = (*heights.shape, _DEPTHS)
    out = np.broadcast_to((heights * length)[..., None], shape)
    turn = np.broadcast_to(angles[..., None], shape)
    deep = np.broadcast_to(depths * thickness, shape)
    query = np.stack([out * np.cos(turn), out * np.sin(turn), deep], axis=-1).reshape(-1, 3)
    at: Located = Locator(part.tets[0], depth_chart(part, part.sizes))(query)
    chosen = classes_of(field.scores(field.feet(number, at.nodes, at.weights)), levels).reshape(-1, _DEPTHS)
    taken = np.stack([(chosen == k).mean(axis=1) for k in range(len(levels))], axis=1)
    middle = _DEPTHS // 2
    inside = at.distance.reshape(-1, _DEPTHS)[:, middle] < 1.0
    place = at.at(part.mesh.points).reshape(*shape, 3)[:, :, middle]
    up = np.gradient(place, axis=0)
    around = 0.5 * (np.roll(place, -1, axis=1) - np.roll(place, 1, axis=1))
    area = np.linalg.norm(np.cross(up, around), axis=2).ravel()
    return taken, inside, area, part.tets[1][at.tet].reshape(-1, _DEPTHS)[:, middle]


def _mean(share: FloatArray, area: FloatArray, on: np.ndarray) -> float | None:
    weight = area[on]
    return round(100.0 * float(np.average(share[on], weights=weight)), 3) if weight.sum() > 0.0 else None
