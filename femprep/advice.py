"""A mesh that leaves its labels in, what helps out: how far slices lie beside their neighbours, and what moving them
back would reach."""

from __future__ import annotations

from contextlib import nullcontext
from typing import Final

import numpy as np

from femprep.anatomies import ANATOMIES, Progress, lay_out
from femprep.errors import FemprepError
from femprep.fidelity import Fidelity, judge_fidelity, surface_fidelity
from femprep.image import Segmentation, align_slices, estimate_shifts
from femprep.options import Options

#: A slice is said to lie beside its neighbours from this many pixels.
_BESIDE: Final = 1.0


def what_helps(seg: Segmentation, found: Fidelity, options: Options) -> list[str]:
    """Advice where surfaces of a finished mesh lie too far from the outlines of their labels; nothing where none does.

    Parameters
    ----------
    seg : Segmentation
        The label map as it was meshed.
    found : Fidelity
    options : Options
        Of the run.

    Returns
    -------
    list of str
        How far the slices concerned lie beside where their neighbours put them, and whether ``--correct-shifts`` helps:
        with the figure that the surfaces fitted to the slices moved back reach.
    """
    if not judge_fidelity(found.records, options.limits)[1]:
        return []
    limit = options.limits.maximum_label_distance or np.inf
    off = sorted({s.slice for record in found.records for s in record.slices if s.greatest_pixels > limit})
    pixel = min(record.pixel_mm for record in found.records)
    beside = {k: away for k, away in _beside(seg).items() if k in off and away > _BESIDE * pixel}
    if not beside:
        return []
    told = ", ".join(f"slice {k} by {away:.1f} mm" for k, away in beside.items())
    line = f"slices lie beside where their neighbours put them: {told}"
    if options.image.correct_shifts:
        return [f"{line}, although shifts were corrected; mend their labels or leave them out"]
    shifts = estimate_shifts(seg)
    if not shifts.largest:
        return [f"{line}; no shift that all structures share explains it: mend their labels or leave them out"]
    line = f"{line}; --correct-shifts moves slices back by up to {shifts.largest:.1f} mm"
    reached = _reached(align_slices(seg, shifts), options)
    return [line if reached is None else f"{line}, and surfaces fitted to them then lie within {reached:.1f} pixels"]


def _beside(seg: Segmentation) -> dict[int, float]:
    """By slice, how far the ventricle's centroid lies from the line through its neighbours', mm."""
    table = seg.slices("lv", "myo")
    at = {int(k): centroid for k, centroid in zip(table.index, table.centroid)}
    found = {}
    for k, centroid in at.items():
        if k - 1 in at and k + 1 in at:
            found[k] = float(np.linalg.norm(centroid - 0.5 * (at[k - 1] + at[k + 1])))
            continue
        inward = 1 if k + 1 in at else -1
        if k + inward in at and k + 2 * inward in at:
            found[k] = float(np.linalg.norm(centroid - (2.0 * at[k + inward] - at[k + 2 * inward])))
    return found


def _reached(seg: Segmentation, options: Options) -> float | None:
    """Greatest distance from the outlines, in pixels, of surfaces fitted to another label map; None where none fit."""

    def untold(_: str) -> nullcontext[Progress]:
        return nullcontext(lambda stage, fraction: None)

    try:
        parts = ANATOMIES[options.anatomy](seg, lay_out(seg, options, untold), options, untold)
    except FemprepError:
        return None
    surfaces = {name: surface for name, surface in parts.surfaces.items() if name in parts.objects}
    return max(record.greatest_pixels for record in surface_fidelity(surfaces, parts.objects, seg.grid).records)
