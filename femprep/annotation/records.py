"""What annotating a mesh made, and how it was told."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from femprep.annotation.reading import CavityOpening, Name, ReadingAttempt
from femprep.model import VolumeMesh
from femprep.options import AnnotateOptions
from femprep.volume import QualityReport


@dataclass(frozen=True, eq=False)
class Annotation:
    """What annotating a mesh made, and how it was told.

    Attributes
    ----------
    mesh : VolumeMesh
        With its boundary facets and regions named, in mm; with coordinates, segments and fibres where it has a
        ventricle with a base.
    quality : QualityReport
    options : AnnotateOptions
    unit : str
        Unit of length of the file it came from.
    names : mapping of str to Name
        How sure the name of each kind of facet and region is, and by what it was told.
    attempts : tuple of ReadingAttempt
        The ways that were tried, in order.
    openings : tuple of CavityOpening
        Openings of the cavities, where the mesh has any but a base.
    seconds : mapping of str to float
        Wall-clock time of each stage.

    Examples
    --------
    >>> found = fp.annotate(mesh)
    >>> found.names["endo"].sure
    1.0
    """

    mesh: VolumeMesh
    quality: QualityReport
    options: AnnotateOptions
    unit: str
    names: Mapping[str, Name]
    attempts: tuple[ReadingAttempt, ...]
    openings: tuple[CavityOpening, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)

    def __repr__(self) -> str:
        names = ", ".join(f"{name} {100 * found.sure:.0f} %" for name, found in self.names.items())
        return f"Annotation({self.mesh!r}, {names})"
