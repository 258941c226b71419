"""What one run made, and what it took: the records that the pipeline fills and the report writes out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from femprep.image import LabelObject, Segmentation
from femprep.model import Surface, VolumeMesh, Wall
from femprep.model.shared_records.solution import SolutionRecord
from femprep.options import Options
from femprep.report.manifest import VolumeRecord
from femprep.report.volumes import cavity_volume
from femprep.volume import QualityReport
from femprep.volume.quality.fidelity import Fidelity, judge_fidelity
from femprep.wall.own import OwnSurfaces


@dataclass(frozen=True)
class Run:
    """What one run made, and what it took.

    Attributes
    ----------
    segmentation : Segmentation or None
        The label map it began with; None where it began with surfaces.
    options : Options
        All options, defaults included.
    objects : mapping of str to LabelObject
        What each surface was fitted to.
    surfaces : mapping of str to Surface
        Closed template surfaces by name.
    wall : Wall
    mesh : VolumeMesh
    quality : QualityReport
    fidelity : Fidelity
        How far the mesh lies from its labels; the quality report holds its records.
    volumes : tuple of VolumeRecord
        Volumes beside those of the labels.
    seconds : mapping of str to float
        Wall-clock time of each stage, in order.
    solution : SolutionRecord, optional
        What a solver made of the mesh, where one was asked for.
    inflated : VolumeMesh, optional
        The mesh with displacement, strain and stress of that solution.
    given : OwnSurfaces, optional
        The surfaces it began with, in place of a label map.

    Examples
    --------
    >>> fp.mesh_segmentation(seg)  # doctest: +SKIP
    Run(lv, epi: VolumeMesh(...), passed, ... s)
    """

    segmentation: Segmentation | None
    options: Options
    objects: Mapping[str, LabelObject]
    surfaces: Mapping[str, Surface]
    wall: Wall
    mesh: VolumeMesh
    quality: QualityReport
    fidelity: Fidelity = field(default_factory=Fidelity)
    volumes: tuple[VolumeRecord, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)
    solution: SolutionRecord | None = None
    inflated: VolumeMesh | None = None
    given: OwnSurfaces | None = None

    def __repr__(self) -> str:
        verdict = "passed" if self.quality.passed else "failed"
        took = f"{sum(self.seconds.values()):.1f} s"
        return f"Run({', '.join(self.surfaces)}: {self.mesh!r}, {verdict}, {took})"


@dataclass(frozen=True)
class Surfaces:
    """Closed surfaces alone: the objects they were fitted to, their distance to those, seconds per stage."""

    segmentation: Segmentation
    options: Options
    objects: Mapping[str, LabelObject]
    surfaces: Mapping[str, Surface]
    fidelity: Fidelity = field(default_factory=Fidelity)
    seconds: Mapping[str, float] = field(default_factory=dict)

    @property
    def failures(self) -> tuple[str, ...]:
        """A line for each surface that lies too far from its labels."""
        return tuple(judge_fidelity(self.fidelity.records, self.options.limits).failures)


@dataclass(frozen=True)
class SequenceRun:
    """Runs of the phases of one heart.

    Attributes
    ----------
    runs : tuple of Run
        In order; each mesh has ``point_data["displacement"]`` from the reference phase, mm.
    times : tuple of float
    reference : int
        Number of that phase, from 0.
    template : mapping of str to int or str
        What their connectivity follows from, see :func:`~femprep.sweeping.template_of`.
    options : Options, optional
        Those asked for; of each run, with its own base and this template.
    seconds : mapping of str to float
        Wall-clock time of each stage beside those of the runs.

    Examples
    --------
    >>> [run.quality.passed for run in found.runs]  # doctest: +SKIP
    [True, True]
    """

    runs: tuple[Run, ...]
    times: tuple[float, ...]
    reference: int
    template: Mapping[str, int | str]
    options: Options | None = None
    seconds: Mapping[str, float] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether every phase passed the quality check.

        Examples
        --------
        >>> fp.mesh_sequence(phases).passed  # doctest: +SKIP
        True
        """
        return all(run.quality.passed for run in self.runs)

    @property
    def ejection_fraction(self) -> float:
        """Greatest less least cavity of the meshes below their base planes, per cent of the greatest.

        Examples
        --------
        >>> round(fp.mesh_sequence(phases).ejection_fraction)  # doctest: +SKIP
        55
        """
        return _ejected([cavity_volume(run.mesh) for run in self.runs])

    @property
    def label_ejection_fraction(self) -> float:
        """The same of all voxels of the cavity.

        Examples
        --------
        >>> round(fp.mesh_sequence(phases).label_ejection_fraction)  # doctest: +SKIP
        55
        """
        return _ejected([run.objects["lv"].volume for run in self.runs])


def _ejected(volumes: Sequence[float]) -> float:
    return 100.0 * (max(volumes) - min(volumes)) / max(volumes)
