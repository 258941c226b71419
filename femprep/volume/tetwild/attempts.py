"""How the runs of fTetWild for one mesh follow each other: the parameters of each, by what came of the one before."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from femprep.options import VolumeOptions

#: How the outcome of a run is told whose mesh is sound but poorer than asked.
MISSED: Final = "below what was asked"
#: Lowest stop energy of a run: with 5 fTetWild may not come to an end.
_LOWEST_ENERGY: Final = 6.0
#: An edge that is longer than this share of the wall's mean thickness, and the mean of the mean ratio that then needs
#: the lowest stop energy (edges of 6 mm, wall of 9 mm: 0.855 with an energy of 10 or 8, 0.873 with 6).
_COARSE: Final = 0.5
_BOUND: Final = 0.85
#: Of a mesh that is refined: its envelope in edge lengths and its stop energy, which optimisation makes good.
_COARSE_ENVELOPE: Final = 0.1
_COARSE_ENERGY: Final = 50.0


@dataclass(frozen=True)
class Attempt:
    """Parameters of one run: envelope in mm, stop energy, and how often its mesh is refined."""

    envelope: float
    stop_energy: float
    levels: int = 0


def attempts(
    options: VolumeOptions,
    outcome: Callable[[], str],
    edge_length: float | None = None,
    thickness: float = np.inf,
    levels: int = 0,
) -> Iterator[Attempt]:
    """Parameters of the runs: those asked for, then others, by the outcome of the run before.

    Where a coarser mesh is to be refined ``levels`` times, its envelope is wide and its stop energy high; if that
    fails, both are as for a mesh of its edge length; and then the mesher makes the mesh itself. So many runs in all as
    there would be without it, or one more.

    After a time limit everything is looser. Where the quality was missed the stop energy is the lowest: a little less
    gains little, and a tighter envelope would only keep more of the wall's small triangles; what it misses no run
    reaches. After a crash or a wrong mesh both are tighter. Where an edge takes more than half of the wall's mean
    ``thickness``, most elements are bound by its surfaces and a good mean ratio needs the lowest stop energy from the
    first run on.
    """
    targets = options.targets
    edge = edge_length or options.edge_length
    envelope = options.envelope or targets.envelope * edge
    energy = targets.stop_energy
    if options.stop_energy is None and edge > _COARSE * thickness and targets.mean_ratio >= _BOUND:
        energy = min(energy, _LOWEST_ENERGY)
    retries = targets.retries
    if levels:
        coarse = edge * 2.0**levels
        wide = options.envelope or _COARSE_ENVELOPE * coarse
        yield Attempt(wide, options.stop_energy or max(targets.stop_energy, _COARSE_ENERGY), levels)
        if retries > 1:
            yield Attempt(min(wide, targets.envelope * coarse), targets.stop_energy, levels)
        retries = max(retries - 2, 0)
    yield Attempt(envelope, energy)
    for _ in range(retries):
        if "time_limit" in outcome():
            envelope, energy = 1.5 * envelope, 2.0 * energy
        elif MISSED in outcome():
            if energy <= _LOWEST_ENERGY:
                return
            energy = _LOWEST_ENERGY
        else:
            energy, envelope = min(energy, max(_LOWEST_ENERGY, energy - 2.0)), envelope / 1.5
        yield Attempt(envelope, energy)
