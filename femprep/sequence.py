"""Label maps of the phases of one heart in, swept meshes of one connectivity and their displacements out."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from femprep.anatomy.tissue.regions import without_tissues
from femprep.errors import InputError, OptionError
from femprep.image import Segmentation
from femprep.model import Progress, noted
from femprep.model.stages import Stages
from femprep.options import Options, choose, takes
from femprep.options.advice import SEQUENCE, followable
from femprep.options.base import with_groups
from femprep.options.run import LEFT_ALONE, TETWILD
from femprep.pipeline import begin, mesh_map
from femprep.report.run import Run, SequenceRun
from femprep.sweeping import displacements, template_of
from femprep.wall import phase_base_offsets
from femprep.wall.planes.phase_bases import base_moved_with_phases


@takes(Options)
def mesh_sequence(
    phases: Sequence[Segmentation],
    options: Options | None = None,
    *,
    times: Sequence[float] | None = None,
    reference: int = 0,
    progress: Progress | None = None,
    **changes: object,
) -> SequenceRun:
    """Sweep all phases of one heart with one connectivity.

    The reference phase is meshed first; its columns, rows and layers, or those given in the options, are those of all.
    The base planes leave out the same share of the labelled cavity in all phases, see
    :func:`~femprep.wall.phase_base_offsets`.

    Parameters
    ----------
    phases : sequence of Segmentation
        Label maps with ``lv`` and ``myo``, in order of time.
    options, **changes
        As for :func:`femprep.mesh_segmentation`; the mesher is the sweep.
    times : sequence of float, optional
        One per phase, increasing; their numbers where not given.
    reference : int
        Number of the phase that displacements are from.
    progress : callable, optional
        Called with ``(stage, fraction)``; stages are those of a run with the number of the phase before them.

    Returns
    -------
    SequenceRun

    Raises
    ------
    InputError, OptionError
        No phases, times that do not increase, another anatomy than the left ventricle; as for ``mesh_segmentation``.
    StageError
        A phase cannot be meshed.

    Examples
    --------
    >>> found = fp.mesh_sequence([diastole, systole], volume={"edge_length": 4.0})  # doctest: +SKIP
    >>> round(found.ejection_fraction)  # doctest: +SKIP
    58
    """
    options = choose(Options, options, changes)
    count = len(phases)
    if not 0 <= reference < count:
        raise InputError(f"reference phase {reference} asked for, but there are {count} phases, counted from 0")
    moments = tuple(float(t) for t in (range(count) if times is None else times))
    if len(moments) != count or np.any(np.diff(moments) <= 0.0):
        raise InputError(f"times of {count} phases have to be as many and increase, not {list(moments)}")
    if options.anatomy != "lv":
        advice = followable([LEFT_ALONE, TETWILD], None, SEQUENCE)
        raise OptionError(f"a sequence is swept, which anatomy {options.anatomy} cannot be", advice=advice)
    options = with_groups(options, volume={"mesher": "sweep"})
    phases = [without_tissues(seg) for seg in phases]
    # Cubic voxels do not tell the stack: all phases are cut across the one of the reference.
    phases = [replace(seg, grid=replace(seg.grid, stack=phases[reference].grid.stack)) for seg in phases]
    stages = Stages(None)
    with stages("preflight of all phases"):
        offsets = [options.wall.base_offset] * count
        with suppress(InputError):  # a base that labels do not show is given, or a phase refused for it
            offsets = phase_base_offsets(phases, options=options.wall)
        for number, seg in enumerate(phases):  # a phase that cannot be meshed is known before the first is
            try:
                begin(seg, with_groups(options, wall={"base_offset": offsets[number]}), Stages(None), SEQUENCE)
            except InputError as error:
                error.args = (f"phase {number}: {error.args[0]}",)
                raise

    def run(number: int, chosen: Options) -> Run:
        report = progress or (lambda stage, fraction: None)
        own = with_groups(chosen, wall={"base_offset": offsets[number]})
        moved = base_moved_with_phases(offsets[number] - chosen.wall.base_offset)
        seg = replace(phases[number], info=noted(phases[number].info, *moved))
        return mesh_map(seg, own, lambda stage, fraction: report(f"{number} {stage}", fraction), SEQUENCE)

    first = run(reference, options)
    template = template_of(first.mesh)
    same = with_groups(options, sweep=dict(template))
    runs = [first if number == reference else run(number, same) for number in range(count)]
    with stages("displacements"):
        moved = displacements([one.mesh for one in runs], reference)
    runs = [replace(one, mesh=mesh) for one, mesh in zip(runs, moved)]
    return SequenceRun(tuple(runs), moments, reference, dict(template), options, stages.seconds)
