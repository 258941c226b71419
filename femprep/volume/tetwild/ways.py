"""The ways to have fTetWild fill a wall, in the order in which they are tried, and the record of each run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Final, Literal

from pydantic import Field

from femprep.model.record import Record
from femprep.options import VolumeOptions

Status = Literal["reached", "missed", "too long", "crashed", "wrong mesh"]

#: Stop energy of the run after one that missed the quality, and its envelope at least, edge lengths. fTetWild goes
#: through its whole box, by up to twenty passes, until no element there has a higher energy. In the envelope of the run
#: before one element could not reach 6.5 in two runs of eight, which took 40 s in place of 15; in this one all did, in
#: 1.1 to 1.5 times the first run's time; in one of .2 a wall of 1 mm came out wrong.
_LOWEST_ENERGY: Final = 6.5
_WIDE_ENVELOPE: Final = 0.15
#: Stop energy of the first run in a wall of few elements, by the quality's. With 10, in the envelope of others, 10 of
#: 24 such walls missed the mean ratio, with 10 in the wide one 6, with 8 there 3, with 7 one of 15, with 6.5 none: in
#: all 413, 335, 328 and 363 s for 24 with 10, 10, 8 and 6.5, the runs that came next among them. With 7, one wall took
#: 16 to 24 s, but more than 40 in two runs of six that might make 8 passes and in two of three with 4; in nine with 30
#: and more never.
_FEW_ENERGY: Final = 0.7
#: Passes of improvement that fTetWild makes at most, and that it makes with the lowest stop energy: the mean ratio
#: rises with the first ones (of a thin wall by .012 with 8, .019 with 15, .026 with 30), the others wait for a few
#: elements.
_PASSES: Final = 80
_PASSES_LOWEST: Final = 8
#: A run may take so many times the seconds estimated, so many seconds where those are few, and for each triangle of the
#: boundary, which is what coarse meshes wait for (left ventricles took .5 to 4 ms each, both 3 to 6). By luck a run
#: takes many times as long as the next one, or comes to no end.
_PATIENCE: Final = 4.0
_LEAST_SECONDS, _SECONDS_PER_TRIANGLE = 40.0, 0.01


@dataclass(frozen=True)
class FillingWay:
    """One way to fill a wall.

    Attributes
    ----------
    name : str
    refined : bool
        The mesher's elements are larger than asked for, and refined.
    fewer : int
        So much less often than the wall bears at most; left out where nothing is left of it.
    follows : bool
        Edges follow the thickness wherever the wall is thinner than they are long; otherwise only where much is.
    envelope : float, optional
        Edge lengths at least; the quality's where not given.
    energy : float, optional
        Stop energy at least; the quality's where not given.
    """

    name: str
    refined: bool = False
    fewer: int = 0
    follows: bool = False
    envelope: float | None = None
    energy: float | None = None


@dataclass(frozen=True)
class Change:
    """What is changed for another run of the last way, by what came of the run before.

    Attributes
    ----------
    after : str
        What came of it.
    envelope, energy : float
        Factors.
    less : float
        What is taken off the stop energy, down to the lowest.
    lowest : bool
        The stop energy is the lowest, with few passes, in a wide envelope for once where none is given; tried once.
    follows : bool
        As of :class:`FillingWay`.
    """

    after: Status
    envelope: float = 1.0
    energy: float = 1.0
    less: float = 0.0
    lowest: bool = False
    follows: bool = False


#: Optimisation after refinement makes a high stop energy good.
FILLING_WAYS: Final = (
    FillingWay("refined", refined=True, envelope=0.1, energy=50.0),
    FillingWay("refined, along all of the wall", refined=True, follows=True),
    FillingWay("refined from a finer mesh", refined=True, fewer=1, envelope=0.1, energy=50.0),
    FillingWay("direct"),
)
#: Where the quality was missed a little less energy gains little; a tighter envelope would keep more of the wall's
#: small triangles, a wider one lets go of them.
CHANGES: Final = (
    Change("too long", envelope=1.5, energy=2.0, follows=True),
    Change("missed", lowest=True),
    Change("crashed", envelope=1.0 / 1.5, less=2.0, follows=True),
    Change("wrong mesh", envelope=1.0 / 1.5, less=2.0, follows=True),
)


@dataclass(frozen=True)
class RunParameters:
    """Parameters of one run.

    Attributes
    ----------
    envelope : float
        mm.
    stop_energy : float
    levels : int
        How often its mesh is refined.
    way : str
        Name of the way.
    follows : bool
        As of :class:`FillingWay`.
    patience : float
        How many times the seconds estimated it may take.
    passes : int
        Passes of improvement at most.
    """

    envelope: float
    stop_energy: float
    levels: int = 0
    way: str = "direct"
    follows: bool = False
    patience: float = _PATIENCE
    passes: int = _PASSES

    def time_limit(self, estimate: float, triangles: int, longest: float) -> float:
        """Processor seconds the run may take, by those estimated, the boundary's triangles and the most any run may."""
        least = max(_LEAST_SECONDS, _SECONDS_PER_TRIANGLE * triangles)
        return min(longest, max(least, self.patience * estimate))


class RunRecord(Record):
    """One run of the mesher, as ``run.json`` has it."""

    way: str = Field(description="How the wall was filled.")
    status: Status = Field(
        description="reached: the quality asked for. missed: a sound mesh, but poorer. too long: ended by its time "
        "limit. crashed: ended by itself. wrong mesh: no sound mesh of this wall."
    )
    outcome: str = Field(description="The same in words.")
    refined_levels: int = Field(description="How often its mesh is refined.")
    edge_length_mm: tuple[float, float] = Field(description="Shortest and longest edges asked of it, mm.")
    envelope_mm: float = Field(description="How far it might leave the wall, mm.")
    stop_energy: float = Field(description="Shape energy at which it stops.")
    passes: int = Field(_PASSES, description="Passes of improvement it might make.")
    time_limit_s: float = Field(description="Processor time it was allowed, s.")
    seconds: float | None = Field(None, description="Time it took by the clock, s.")
    processor_seconds: float | None = Field(None, description="Processor time it took, s.")
    peak_bytes: int | None = Field(None, description="Its greatest memory, bytes, where the system tells.")
    elements: int | None = Field(None, description="Elements it gave.")
    undone: tuple[str, ...] = Field((), description="Steps of putting its mesh in order that spoiled it, and why.")


def planned_runs(
    options: VolumeOptions,
    status: Callable[[], Status],
    edge_length: float | None = None,
    levels: int = 0,
    few: bool = False,
) -> Iterator[RunParameters]:
    """Parameters of the runs: the ways in their order, then the last one changed by what came of the run before.

    Parameters
    ----------
    options : VolumeOptions
        Those given win over what a way would have.
    status : callable
        What came of the run before.
    edge_length : float, optional
        Of the mesh in the end, mm; the option's where not given.
    levels : int
        How often a coarser mesh may be refined; without it, ways that are refined are left out.
    few : bool
        The wall has few elements through it: the mesher alone begins with less energy, in a wide envelope.

    Returns
    -------
    iterator of RunParameters
        So many as there are further runs, and one; where refined ones come first, as many as there are ways, and one.
    """
    targets = options.targets
    edge = edge_length or options.edge_length
    ways = [way for way in FILLING_WAYS if levels > way.fewer or not way.refined]
    if targets.retries < 2 and len(ways) > 1:
        ways = [ways[0], ways[-1]]
    patience = _PATIENCE
    for way in ways:
        parameters = _first(options, way, edge, levels - way.fewer if way.refined else 0, few)
        yield replace(parameters, patience=patience)
        came = status()
        patience *= 2.0 if came == "too long" else 1.0
    # The mesher alone may try again after the refined ways, too: of a small heart in systole it misses the mean ratio
    # with its own stop energy and reached it with 6.
    least = 1 if len(ways) > 1 and targets.retries > 1 else 0
    narrow, wide = narrow_envelope(options, edge), wide_envelope(options, edge)
    lowest = False
    for _ in range(max(targets.retries - len(ways) + 1, least)):
        (change,) = [change for change in CHANGES if change.after == came]
        if change.lowest and parameters.stop_energy <= _LOWEST_ENERGY:
            return  # what it misses no run reaches
        if came == "too long" and lowest:
            return  # a mesh that misses is at hand, and a higher stop energy gives no better one
        lowest = lowest or change.lowest
        envelope = wide if change.lowest else change.envelope * parameters.envelope
        if change.envelope < 1.0 < parameters.envelope / narrow:
            envelope = narrow  # nothing sound came of a wider one
        parameters = replace(
            parameters,
            envelope=envelope,
            stop_energy=_changed(parameters.stop_energy, change),
            passes=_PASSES_LOWEST if lowest else parameters.passes,
            follows=parameters.follows or change.follows,
            patience=patience,
        )
        yield parameters
        came = status()
        patience *= 2.0 if came == "too long" else 1.0


def narrow_envelope(options: VolumeOptions, edge: float) -> float:
    """Envelope of the mesher alone, as the quality or the user has it, mm."""
    return options.envelope or options.targets.envelope * edge


def wide_envelope(options: VolumeOptions, edge: float) -> float:
    """The envelope of walls of few elements, and of runs with the lowest stop energy, mm."""
    return options.envelope or max(narrow_envelope(options, edge), _WIDE_ENVELOPE * edge)


def _changed(energy: float, change: Change) -> float:
    """Stop energy of a run by that of the run before."""
    if change.lowest:
        return _LOWEST_ENERGY
    if change.less:
        return min(energy, max(_LOWEST_ENERGY, energy - change.less))
    return change.energy * energy


def _first(options: VolumeOptions, way: FillingWay, edge: float, levels: int, few: bool) -> RunParameters:
    """Parameters of the first run of a way."""
    targets = options.targets
    energy = targets.stop_energy
    envelope = options.envelope or max(targets.envelope, way.envelope or 0.0) * edge * 2.0**levels
    few = few and not way.refined
    if few:
        envelope = wide_envelope(options, edge)
    if options.stop_energy is None:
        energy = max(energy, way.energy or 0.0)
        if few:
            energy = min(energy, max(_LOWEST_ENERGY, _FEW_ENERGY * energy))
    return RunParameters(envelope, energy, levels, way.name, way.follows)
