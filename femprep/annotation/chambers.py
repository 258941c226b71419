"""Cavities of a boundary in, their names out: which is the left ventricle, the right one, which atrium is which."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np
from scipy.spatial import cKDTree

from femprep.annotation.hull import hull_of
from femprep.annotation.reading import SURE, Name, NoReading, Question
from femprep.annotation.shell import Shell
from femprep.model import BoolArray, FloatArray, IntArray
from femprep.model.notice import spot

#: Facets that stand for a surface in searches.
_SAMPLE = 4000


@dataclass(frozen=True)
class Cavity:
    """What tells a cavity: wall thickness (mm), share of its convex hull, volume (mL), distances to the others (mm)."""

    thickness: float
    convex: float
    volume: float
    middle: FloatArray


def name_cavities(
    shell: Shell, cavities: list[BoolArray], epi: BoolArray
) -> tuple[list[str], dict[str, Name], list[Question]]:
    """Names of two or four cavities, how sure each is, and what has to be asked.

    The left ventricle has the thicker wall and the rounder cavity; of the others the right ventricle shares most of
    the left one's wall, the left atrium lies nearer to the left ventricle than the right atrium does.
    """
    found = [_measure(shell, own, epi) for own in cavities]
    if len(cavities) == 1:
        return ["lv"], {"lv": Name(1.0, "the one surface that looks into a cavity")}, []
    if len(cavities) == 2:
        return _ventricles(found)
    if len(cavities) == 4:
        return _four(shell, cavities, found)
    raise NoReading(f"{len(cavities)} cavities; a heart has 1, 2 or 4")


def wall_thickness(shell: Shell, own: BoolArray, epi: BoolArray) -> float:
    """Thickness of a cavity's free wall, mm."""
    rows = _sample(own)
    # The free wall tells: towards the septum the epicardium is far away.
    return float(np.percentile(cKDTree(shell.centre[epi]).query(shell.centre[rows])[0], 30))


def _sample(own: BoolArray) -> IntArray:
    rows = np.flatnonzero(own)
    return rows[:: max(1, len(rows) // _SAMPLE)]


def _measure(shell: Shell, own: BoolArray, epi: BoolArray) -> Cavity:
    rows, thickness = _sample(own), wall_thickness(shell, own, epi)
    enclosed = abs(shell.enclosed(own))
    hull = hull_of(shell.centre[rows]).volume
    return Cavity(thickness, enclosed / max(hull, 1e-9), enclosed / 1e3, shell.centre[rows].mean(axis=0))


def _ventricles(found: list[Cavity]) -> tuple[list[str], dict[str, Name], list[Question]]:
    thick = found[0].thickness / max(found[1].thickness, 1e-9)
    round_ = found[0].convex / max(found[1].convex, 1e-9)
    # Each tells by its logarithm: twice as thick a wall is as good as certain, so is a cavity a third fuller.
    score = np.log(thick) / np.log(2.0) + np.log(round_) / np.log(1.33)
    left = 0 if score > 0 else 1
    sure = float(1.0 - 0.5 * np.exp(-2.5 * abs(score)))
    names = ["lv", "rv"] if left == 0 else ["rv", "lv"]
    lv, rv = found[left], found[1 - left]
    because = (
        f"wall {lv.thickness:.1f} mm against {rv.thickness:.1f} mm, "
        f"{100 * lv.convex:.0f} % of its convex hull against {100 * rv.convex:.0f} %"
    )
    questions = []
    if sure < SURE:
        questions.append(
            Question(
                f"the cavities near {spot(lv.middle)} and {spot(rv.middle)} look alike ({because}): which is the left "
                "ventricle?",
                f"at = {{ endo_lv = [{', '.join(f'{x:.1f}' for x in lv.middle)}] }}",
            )
        )
    return names, {"lv": Name(sure, because), "rv": Name(sure, because)}, questions


def _four(
    shell: Shell, cavities: list[BoolArray], found: list[Cavity]
) -> tuple[list[str], dict[str, Name], list[Question]]:
    trees = [cKDTree(shell.centre[own]) for own in cavities]
    order = np.argsort([-each.thickness for each in found], kind="stable")
    left = int(order[0])
    rows = np.flatnonzero(cavities[left])
    near = np.stack([tree.query(shell.centre[rows])[0] for tree in trees], axis=1)
    near[:, left] = np.inf
    shared = np.bincount(near.argmin(axis=1), weights=shell.area[rows] * (near.min(axis=1) < 25.0), minlength=4)
    gap = np.array([[float(np.min(trees[j].query(shell.centre[own])[0])) for j in range(4)] for own in cavities])
    best, second, chosen = -np.inf, -np.inf, (0, 0, 0)
    for right, la, ra in permutations([k for k in range(4) if k != left]):
        # Millimetres of gaps between chambers that ought to touch, less those of chambers that do not; and the septum.
        score = gap[left, ra] + gap[right, la] - gap[left, la] - gap[right, ra] - gap[la, ra]
        score += 20.0 * (shared[right] - max(shared[la], shared[ra])) / max(shared.sum(), 1e-9)
        if score > best:
            best, second, chosen = score, best, (right, la, ra)
        else:
            second = max(second, score)
    names = [""] * 4
    for name, k in zip(("lv", "rv", "la", "ra"), (left, *chosen)):
        names[k] = name
    runner = found[int(order[1])].thickness
    thick = float(1.0 - 0.5 * np.exp(-4.0 * np.log(max(found[left].thickness / max(runner, 1e-9), 1.0))))
    rest = float(1.0 - 0.5 * np.exp(-(best - second) / 4.0))
    sure = {"lv": thick, **dict.fromkeys(("rv", "la", "ra"), min(thick, rest))}
    because = {
        "lv": f"the thickest wall, {found[left].thickness:.1f} mm against {runner:.1f} mm",
        "rv": f"shares {100 * shared[chosen[0]] / max(shared.sum(), 1e-9):.0f} % of the left ventricle's inner walls",
        "la": f"{gap[left, chosen[1]]:.1f} mm from the left ventricle, {gap[chosen[0], chosen[1]]:.1f} from the right",
        "ra": f"{gap[chosen[0], chosen[2]]:.1f} mm from the right ventricle, {gap[left, chosen[2]]:.1f} from the left",
    }
    questions = [
        Question(
            f"the cavity near {spot(found[names.index(name)].middle)} may be {name} or another one ({because[name]})",
            f"at = {{ endo_{name} = [{', '.join(f'{x:.1f}' for x in found[names.index(name)].middle)}] }}",
        )
        for name in names
        if sure[name] < SURE
    ]
    return names, {name: Name(sure[name], because[name]) for name in names}, questions
