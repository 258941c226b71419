"""A wall and options in, the best mesh of as many runs of fTetWild as it takes out, with a record of each run."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, Final

import numpy as np

from femprep.errors import StageError
from femprep.model import Notice, Progress
from femprep.options import CheckOptions, VolumeOptions
from femprep.volume.background import background_field
from femprep.volume.blood import Filling
from femprep.volume.finish import Candidate, finish
from femprep.volume.refine.plan import WallThickness, has_few_through, is_thin, nearest_sheets
from femprep.volume.sizing import SizingField
from femprep.volume.tetwild.guard import RunError, TetwildRun, TooLongError, run_tetwild
from femprep.volume.tetwild.ways import RunParameters, RunRecord, Status, planned_runs, wide_envelope
from femprep.volume.validate import SECONDS_PER_TET, TETS_PER_CUBE, Estimate, estimate

_log = logging.getLogger(__name__)

#: Least room for temporary files, bytes for each element expected; the files hold 18 to 21, estimates lie within 30 %.
_BYTES_PER_ELEMENT: Final = 12.0
#: Share of the progress that belongs to the mesher, by how often its mesh is refined: each time takes eight times as
#: long as the one before.
_MESHER_SHARE: Final = (0.9, 0.8, 0.6, 0.2)
#: Envelope of a run whose edges follow a thin wall, in the shortest of them: no wider, that its sides are not joined.
_THIN_ENVELOPE: Final = 0.1
#: Another run of the way that missed the quality may take so many times the processor seconds of the one before: of 97
#: hearts 96 took 1 to 1.55 times, one four times, by luck. A mesh is at hand.
_AGAIN: Final = 1.6


class NoMeshError(StageError):
    """No run gave a sound mesh.

    Attributes
    ----------
    records : list of RunRecord
    """

    def __init__(self, message: str, records: list[RunRecord]) -> None:
        super().__init__(message)
        self.records = records


class Sizes:
    """Edge lengths the mesher is asked for: the user's, or one, shortened where the wall is thinner than that.

    Parameters
    ----------
    filling : Filling
    options : VolumeOptions
    thickness : WallThickness
        Of its wall.
    given : SizingField, optional
        Edges that vary as the user wants them.
    """

    def __init__(
        self, filling: Filling, options: VolumeOptions, thickness: WallThickness, given: SizingField | None
    ) -> None:
        self._filling, self._options, self._thickness = filling, options, thickness
        self._found: dict[tuple[int, bool], SizingField | None] = {}
        self._given = given

    def field(self, levels: int, follows: bool = False) -> SizingField | None:
        """How edges of a mesh that is refined so often vary; None where they are of one length, and long.

        ``follows`` where the wall is thin anywhere; otherwise where much of it is.
        """
        if self._given is not None:
            return self._given.coarser(levels)
        key = levels, follows
        if key not in self._found:
            edge = self._options.edge_length * 2.0**levels
            thin = follows or is_thin(self._thickness, edge, levels)
            within = (self._filling, edge, self._options.gradation)
            # Coarse elements are few in the whole box about the body.
            some = thin or levels == 0
            self._found[key] = background_field(*within, self._thickness if thin else None) if some else None
        return self._found[key]

    def range(self, levels: int, follows: bool = False) -> tuple[float, float]:
        """The shortest and the longest of these edges, mm."""
        field = self.field(levels, follows)
        edge = self._options.edge_length * 2.0**levels
        return (edge, edge) if field is None else (field.finest, field.coarsest)

    def shortest(self, levels: int, follows: bool = False) -> float:
        """The shortest of them but for a few, mm."""
        finest, coarsest = self.range(levels, follows)
        return max(finest, 0.4 * coarsest)

    @property
    def few_through(self) -> bool:
        """Whether edges of one length leave few elements through the wall, whose sheets a wide envelope keeps apart.

        Of 515 such walls it joined the sheets of three, which come as near as .13 to .29 mm where it was .29 to .39 mm
        wide; 13 others whose sheets are nearer than it is wide came out well with it, and do without.
        """
        edge = self._options.edge_length
        few = self._given is None and has_few_through(self._thickness, edge)
        return few and nearest_sheets(self._filling.wall) > wide_envelope(self._options, edge)

    def seconds(self, need: Estimate, parameters: RunParameters) -> float:
        """Seconds that a run will take, by those that one with edges of one length needs."""
        field = self.field(parameters.levels, parameters.follows)
        if self._given is not None or field is None:
            return need.seconds
        return max(need.seconds, SECONDS_PER_TET * TETS_PER_CUBE * field.elements)


def best_of_runs(
    filling: Filling,
    options: VolumeOptions,
    limits: CheckOptions,
    sizes: Sizes,
    need: Estimate,
    levels: int,
    report: Progress,
) -> tuple[Candidate, list[RunRecord]]:
    """The best mesh of as many runs as it takes, and a record of each.

    Parameters
    ----------
    filling : Filling
    options : VolumeOptions
    limits : CheckOptions
        What elements are held to.
    sizes : Sizes
    need : Estimate
        Of a run.
    levels : int
        How often a coarser mesh may be refined.
    report : callable

    Returns
    -------
    candidate : Candidate
    records : list of RunRecord

    Raises
    ------
    NoMeshError
        No run gave a sound mesh.
    """
    records: list[RunRecord] = []
    best: Candidate | None = None
    shortest = sizes.shortest(levels) / 2.0**levels
    for parameters in planned_runs(options, lambda: records[-1].status, shortest, levels, sizes.few_through):
        if parameters.follows and options.envelope is None:
            widest = _THIN_ENVELOPE * sizes.shortest(parameters.levels, True)
            parameters = replace(parameters, envelope=min(parameters.envelope, widest))
        held = _held(options, parameters, records)
        candidate, record = _one(filling, held, limits, parameters, sizes, need, report)
        records.append(record)
        if candidate is not None and (best is None or _rank(candidate) > _rank(best)):
            best = candidate
        if record.status == "reached":
            break
        _log.warning("attempt %d%s: %s", len(records), "" if candidate else " failed", record.outcome)
    if best is None:
        raise NoMeshError(f"no mesh after {len(records)} attempt(s), the last: {records[-1].outcome}", records)
    return best, records


def _held(options: VolumeOptions, parameters: RunParameters, records: list[RunRecord]) -> VolumeOptions:
    """Options with the time another run of a way may take, by the run of it that missed."""
    before = records[-1] if records else None
    if before is None or (before.status, before.way) != ("missed", parameters.way) or not before.processor_seconds:
        return options
    return options.model_copy(update={"time_limit": min(options.time_limit, _AGAIN * before.processor_seconds)})


def _rank(candidate: Candidate) -> tuple[bool, int, float]:
    return candidate.fine, -len(candidate.failures), candidate.share


def _one(
    filling: Filling,
    options: VolumeOptions,
    limits: CheckOptions,
    parameters: RunParameters,
    sizes: Sizes,
    need: Estimate,
    report: Progress,
) -> tuple[Candidate | None, RunRecord]:
    """One run: its mesh in order, where it gave a sound one, and its record."""
    need = estimate(need.elements, parameters.levels)
    seconds = sizes.seconds(need, parameters)
    limit = parameters.time_limit(seconds, len(filling.triangles), options.time_limit)
    told: dict[str, Any] = {
        "way": parameters.way,
        "refined_levels": parameters.levels,
        "edge_length_mm": sizes.range(parameters.levels, parameters.follows),
        "envelope_mm": parameters.envelope,
        "stop_energy": parameters.stop_energy,
        "passes": parameters.passes,
        "time_limit_s": limit,
    }
    status: Status = "crashed"
    try:
        run = _mesh(filling, options, parameters, sizes, need, limit, report)
        status = "wrong mesh"
        told.update(
            seconds=run.seconds,
            processor_seconds=run.processor_seconds,
            peak_bytes=run.peak_bytes,
            elements=len(run.cells),
        )
        share = _share(parameters.levels)

        def refining(_: str, fraction: float) -> None:
            report("volume", share + (1.0 - share) * fraction)

        candidate = finish(run, filling, options, parameters, limits, refining)
    except StageError as error:
        status = "too long" if isinstance(error, TooLongError) else status
        if isinstance(error, RunError):
            told.update(seconds=error.seconds, processor_seconds=error.processor_seconds)
        return None, RunRecord(**told, status=status, outcome=str(error))
    finest, coarsest = (edge / 2.0**parameters.levels for edge in sizes.range(parameters.levels, parameters.follows))
    edges = finest if finest == coarsest else [finest, coarsest]
    mesh = replace(candidate.mesh, info={"edge_length_mm": edges, **candidate.mesh.info})
    candidate = replace(candidate, mesh=mesh)
    status = "reached" if candidate.reached else "missed" if candidate.fine else "wrong mesh"
    return candidate, RunRecord(**told, status=status, outcome=candidate.outcome, undone=candidate.undone)


def _mesh(
    filling: Filling,
    options: VolumeOptions,
    parameters: RunParameters,
    sizes: Sizes,
    need: Estimate,
    limit: float,
    report: Progress,
) -> TetwildRun:
    points, triangles = filling.outer.points, filling.triangles
    diagonal = float(np.linalg.norm(np.ptp(points[np.unique(triangles)], axis=0)))
    expected = max(need.seconds, 1.0)
    field = sizes.field(parameters.levels, parameters.follows)
    longest = sizes.range(parameters.levels)[1] if field is None else field.values.max()
    return run_tetwild(
        points,
        triangles,
        {
            "edge_length_abs": float(longest),
            "epsilon": float(parameters.envelope / diagonal),
            "stop_energy": float(parameters.stop_energy),
            "num_opt_iter": parameters.passes,
            "num_threads": 1,
        },
        arrays={} if field is None else {"bg_vertices": field.points, "bg_tets": field.tets, "bg_values": field.values},
        time_limit=limit,
        memory_limit=options.memory_limit,
        least_room=_BYTES_PER_ELEMENT * need.elements,
        pulse=lambda gone: report("volume", _share(parameters.levels) * (1.0 - float(np.exp(-gone / expected)))),
    )


def _share(levels: int) -> float:
    return _MESHER_SHARE[min(levels, len(_MESHER_SHARE) - 1)]


def attempt_notices(records: list[RunRecord], reached: bool, undone: Iterable[str] = ()) -> list[Notice]:
    """Which runs were not good enough, whether any was, and what was undone of the one that is kept."""
    count = len(records)
    found = [
        Notice.of("not reached", f"fTetWild run {number} of {count}: {run.outcome}")
        for number, run in enumerate(records[:-1] if reached else records, 1)
    ]
    found += [Notice.of("left out", f"of the mesh that was kept, a step was undone: {step}") for step in undone]
    if not reached:
        line = "the mesher did not reach the quality asked of it; the best of its runs was kept"
        found.append(Notice.of("not reached", line))
    return found
