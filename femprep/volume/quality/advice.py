"""A mesh that leaves its labels, or a stage that fails, in; what helps out: how far slices lie beside their neighbours,
and what moving them back would reach."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Final

import numpy as np

from femprep.errors import FemprepError, InputError, StageError
from femprep.image import Segmentation, leave_out_slices
from femprep.model.shared_records.label_fidelity import FidelityRecord
from femprep.model.stages import Stages
from femprep.options import Options
from femprep.surface.alignment import align_slices, estimate_shifts
from femprep.volume.quality.fidelity import Fidelity, judge_fidelity, surface_fidelity
from femprep.volume.quality.limits import SHAPES
from femprep.volume.quality.report import QualityReport
from femprep.wall.anatomies import ANATOMIES, WallSurfaces, lay_out

#: A slice is said to lie beside its neighbours from this many pixels.
_BESIDE: Final = 1.0
#: A stage that fails is put down to shifts from this many pixels on.
_DISPLACED: Final = 2.0


def what_helps(seg: Segmentation, found: Fidelity, fitted: WallSurfaces, options: Options) -> list[str]:
    """Advice where surfaces of a finished mesh lie too far from the outlines of their labels; nothing where none does.

    Parameters
    ----------
    seg : Segmentation
        The label map as it was meshed.
    found : Fidelity
    fitted : WallSurfaces
        The surfaces the mesh was made from.
    options : Options
        Of the run.

    Returns
    -------
    list of str
        How far the slices concerned lie beside where their neighbours put them, and whether ``--correct-shifts`` helps:
        with the figure that the surfaces fitted to the slices moved back reach; else whether ``--leave-out`` does.
        Where neither suffices, whether it is the surfaces or the mesh between them that leave the labels.
    """
    failed = [record for record in found.records if judge_fidelity([record], options.limits).failures]
    if not failed:
        return []
    # A surface too far in the mean is so over all of its slices.
    limit = min(_allowed(options), max(record.greatest_pixels for record in failed))
    off = {one.slice for record in failed for one in record.slices if one.greatest_pixels >= limit}
    pixel = min(record.pixel_mm for record in failed)
    beside = {k: away for k, away in _beside(seg).items() if k in off and away > _BESIDE * pixel}
    shifted, enough = _shifted(seg, beside, options) if beside else ([], False)
    if enough:
        return shifted
    names = {(record.surface, record.labels) for record in failed}
    own = _greatest(one for one in _of_surfaces(fitted, seg).records if (one.surface, one.labels) in names)
    if own > _allowed(options):
        line = f"the surfaces that the wall is built from are {own:.1f} pixels off themselves"
        return [*shifted, f"{line}: more --vertices follow a narrow end more closely; else look at the labels"]
    finer = "--mesher tetwild or fewer --layers" if options.volume.mesher == "sweep" else "a smaller --edge-length"
    return [
        *shifted,
        f"the surfaces that the wall is built from lie within {own:.1f} pixels; what leaves them is the mesh between "
        f"them, which {finer} may bring nearer",
    ]


def with_shape_help(report: QualityReport, options: Options) -> QualityReport:
    """The report of a swept mesh whose elements miss a limit on their shapes with the mesher that does not layer them.

    Parameters
    ----------
    report : QualityReport
        Of the mesh.
    options : Options
        Of the run.
    """
    if options.volume.mesher != "sweep" or all(one.passed for one in report.limits if one.name in SHAPES):
        return report
    line = "layers follow the surfaces, however they bend; --mesher tetwild fills the wall with even tetrahedra"
    return report.model_copy(update={"failures": (*report.failures, line)})


@contextmanager
def advised(seg: Segmentation, options: Options) -> Iterator[None]:
    """Add to an error of the block, where slices lie displaced, that shifts can be corrected and what that reaches.

    Parameters
    ----------
    seg : Segmentation
        The label map as it is meshed.
    options : Options
        Of the run.
    """
    try:
        yield
    except (StageError, InputError) as error:
        if options.image.correct_shifts:
            raise
        shifts = estimate_shifts(seg)
        pixel = float(np.delete(seg.grid.spacing, seg.stack_axis).max())
        if shifts.largest < _DISPLACED * pixel:
            raise
        at = int(shifts.index[np.argmax(np.linalg.norm(shifts.shift, axis=1))])
        before, after = shifts.zigzag
        line = (
            f"{error}; slices lie up to {shifts.largest:.1f} mm beside the others (slice {at}): --correct-shifts moves "
            f"them back, by which centroids zig-zag by {after:.1f} mm instead of {before:.1f}"
        )
        reached = _reached(align_slices(seg, shifts), options)
        what = (
            "no surfaces can be fitted then either" if reached is None else f"surfaces lie within {reached:.1f} pixels"
        )
        error.args = (f"{line}, and {what}",)  # the same error, with the records that it may hold
        raise


def _shifted(seg: Segmentation, beside: Mapping[int, float], options: Options) -> tuple[list[str], bool]:
    """What there is to say of slices that lie beside their neighbours by so many mm; whether it suffices to do that."""
    told = ", ".join(f"slice {k} by {away:.1f} mm" for k, away in beside.items())
    line = f"slices lie beside where their neighbours put them: {told}"
    if options.image.correct_shifts:
        line += ", although shifts were corrected"
    elif (shifts := estimate_shifts(seg)).largest:
        line += f"; --correct-shifts moves slices back by up to {shifts.largest:.1f} mm"
        reached = _reached(align_slices(seg, shifts), options)
        line += "" if reached is None else f", and surfaces fitted to them then lie within {reached:.1f} pixels"
        if reached is not None and reached <= _allowed(options):
            return [line], True
    else:
        line += "; no shift that all structures share explains it"
    try:
        reached = _reached(leave_out_slices(seg, beside), options)
    except InputError:  # too few would be left
        reached = None
    if reached is None or reached > _allowed(options):
        return [f"{line}; mend their labels"], False
    out = " ".join(f"--leave-out {k}" for k in sorted({*options.image.leave_out, *beside}))
    return [f"{line}; mend their labels, or {out}: without them surfaces lie within {reached:.1f} pixels"], True


def _allowed(options: Options) -> float:
    """Greatest distance from the labels that is allowed, pixels."""
    return options.limits.maximum_label_distance or np.inf


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
    stages = Stages(None)
    try:
        fitted = ANATOMIES[options.anatomy](seg, lay_out(seg, options, stages), options, stages)
    except FemprepError:
        return None
    return _greatest(_of_surfaces(fitted, seg).records)


def _of_surfaces(fitted: WallSurfaces, seg: Segmentation) -> Fidelity:
    """How far the surfaces that a wall is built from lie from what its facets ought to follow, within its planes."""
    planes = [plane for plane in (fitted.base, fitted.apex) if plane is not None]
    return surface_fidelity(fitted.by_facets, fitted.outlines, seg.grid, planes)


def _greatest(records: Iterable[FidelityRecord]) -> float:
    """Greatest distance of some surfaces from their outlines, pixels."""
    return max((record.greatest_pixels for record in records), default=0.0)
