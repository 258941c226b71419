"""A mesh that leaves its labels, or a stage that fails, in; advice that was tried on the labels out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Final

import numpy as np

from femprep.errors import Advice, FemprepError, InputError, OptionError, StageError, alternatives
from femprep.image import Segmentation
from femprep.model.shared_records.label_fidelity import FidelityRecord
from femprep.model.stages import Stages
from femprep.options import Options
from femprep.options.advice import SHIFTS, SHORTER_EDGES, Fixed, changed, followable
from femprep.options.run import TETWILD
from femprep.surface.alignment import estimate_shifts
from femprep.volume.quality.fidelity import Fidelity, judge_fidelity, surface_fidelity
from femprep.volume.quality.limits import SHAPES
from femprep.volume.quality.report import QualityReport
from femprep.wall.anatomies import ANATOMIES, WallSurfaces, lay_out

#: A slice is said to lie beside its neighbours from this many pixels.
_BESIDE: Final = 1.0
#: A stage that fails is put down to shifts from this many pixels on.
_DISPLACED: Final = 2.0
_FEWER_LAYERS: Final = Advice("choose fewer --layers", "sweep.layers")
#: Of options: how near surfaces then come to the labels, pixels, 0 where that is not measured; None where none fit.
Reached = Callable[[Options], float | None]


def what_helps(
    seg: Segmentation, found: Fidelity, fitted: WallSurfaces, options: Options, fixed: Fixed, reached: Reached
) -> list[str]:
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
    fixed : mapping of str to str
        Options that the command does not let change, see :func:`~femprep.options.advice.followable`.
    reached : callable

    Returns
    -------
    list of str
        How far the slices concerned lie beside where their neighbours put them, and whether ``--correct-shifts``
        suffices, or else ``--leave-out``, with what surfaces then reach. Where neither suffices, whether it is the
        surfaces or the mesh between them that leave the labels.
    """
    failed = [record for record in found.records if judge_fidelity([record], options.limits).failures]
    if not failed:
        return []
    # A surface too far in the mean is so over all of its slices.
    allowed = options.limits.maximum_label_distance or np.inf
    limit = min(allowed, max(record.greatest_pixels for record in failed))
    off = {one.slice for record in failed for one in record.slices if one.greatest_pixels >= limit}
    pixel = min(record.pixel_mm for record in failed)
    beside = {k: away for k, away in _beside(seg).items() if k in off and away > _BESIDE * pixel}
    lines = []
    if beside:
        told = ", ".join(f"slice {k} by {away:.1f} mm" for k, away in beside.items())
        line = f"slices lie beside where their neighbours put them: {told}; "
        out = " ".join(f"--leave-out {k}" for k in sorted({*options.image.leave_out, *beside}))
        for one in followable((SHIFTS, Advice(out, "image.leave_out", tuple(beside))), options, fixed):
            distance = reached(changed(options, one))
            if distance is not None and distance <= allowed:
                return [f"{line}with {one.words} surfaces lie within {distance:.1f} pixels"]
        lines = [f"{line}mend their labels"]
    names = {(record.surface, record.labels) for record in failed}
    own = _greatest(one for one in _of_surfaces(fitted, seg).records if (one.surface, one.labels) in names)
    if own > allowed:
        line = f"the surfaces that the wall is built from are {own:.1f} pixels off themselves"
        return [*lines, f"{line}: more --vertices follow a narrow end more closely; else look at the labels"]
    swept = options.volume.mesher == "sweep"
    nearer = followable([TETWILD, _FEWER_LAYERS] if swept else [SHORTER_EDGES], options, fixed)
    return [
        *lines,
        f"the surfaces that the wall is built from lie within {own:.1f} pixels, and the mesh between them leaves them; "
        f"what may help: {alternatives(nearer)}",
    ]


def with_shape_help(report: QualityReport, options: Options, fixed: Fixed) -> QualityReport:
    """The report of a swept mesh whose elements miss a limit on their shapes with the mesher that does not layer them.

    Parameters
    ----------
    report : QualityReport
        Of the mesh.
    options : Options
        Of the run.
    fixed : mapping of str to str
        Options that the command does not let change, see :func:`~femprep.options.advice.followable`.
    """
    if options.volume.mesher != "sweep" or all(one.passed for one in report.limits if one.name in SHAPES):
        return report
    other = alternatives(followable([TETWILD], options, fixed)) or "a mesh that is not swept"
    line = f"swept layers follow every bend of the surfaces; for even tetrahedra: {other}"
    return report.model_copy(update={"failures": (*report.failures, line)})


@contextmanager
def with_hints(seg: Segmentation, options: Options, fixed: Fixed, reached: Reached) -> Iterator[None]:
    """Advise with an error of the block what can be followed and, where it names a value, what that reaches.

    Parameters
    ----------
    seg : Segmentation
        The label map of the block.
    options : Options
        Of the run.
    fixed : mapping of str to str
        Options that the command does not let change, see :func:`~femprep.options.advice.followable`.
    reached : callable
    """
    try:
        yield
    except (StageError, InputError, OptionError) as error:
        shifts = [] if isinstance(error, OptionError) else _move_back(seg)
        tried = []
        for one in followable((*shifts, *error.advice), options, fixed):
            distance = 0.0 if one.value is None else reached(changed(options, one))
            if distance is not None:
                words = f" and surfaces lie within {distance:.1f} pixels" if distance else ""
                tried.append(one._replace(words=one.words + words))
                if one in shifts:  # nothing else is advised where moving slices back suffices
                    break
            elif one in shifts:
                tried.append(
                    Advice(one.words.partition(": moved")[0].replace("--correct-shifts", "mend the labels", 1))
                )
        error.advice = tuple(tried)  # the same error, with the records that it may hold
        raise


def surfaces_reached(seg: Segmentation, options: Options) -> float | None:
    """Greatest distance of surfaces fitted to a label map from its outlines, pixels; None where none fit."""
    stages = Stages(None)
    try:
        fitted = ANATOMIES[options.anatomy](seg, lay_out(seg, options, stages), options, stages)
    except FemprepError:
        return None
    return _greatest(_of_surfaces(fitted, seg).records)


def _move_back(seg: Segmentation) -> list[Advice]:
    """That slices can be moved back, where they are far displaced."""
    shifts = estimate_shifts(seg)
    if shifts.largest < _DISPLACED * float(np.delete(seg.grid.spacing, seg.stack_axis).max()):
        return []
    at = int(shifts.index[np.argmax(np.linalg.norm(shifts.shift, axis=1))])
    before, after = shifts.zigzag
    words = (
        f"--correct-shifts, as slices lie up to {shifts.largest:.1f} mm beside the others (slice {at}): moved back, "
        f"centroids zig-zag by {after:.1f} mm instead of {before:.1f}"
    )
    return [SHIFTS._replace(words=words)]


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


def _of_surfaces(fitted: WallSurfaces, seg: Segmentation) -> Fidelity:
    """How far the surfaces that a wall is built from lie from what its facets ought to follow, within its planes."""
    return surface_fidelity(fitted.by_facets, fitted.outlines, seg.grid, fitted.planes)


def _greatest(records: Iterable[FidelityRecord]) -> float:
    """Greatest distance of some surfaces from their outlines, pixels."""
    return max((record.greatest_pixels for record in records), default=0.0)
