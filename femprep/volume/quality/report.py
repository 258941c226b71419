"""The record a mesh check gives: counts, volumes, element measures, worst elements, validity, limits. JSON-ready."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, computed_field

from femprep.errors import QualityError
from femprep.model.record import Record
from femprep.model.shared_records.label_fidelity import FidelityRecord
from femprep.model.shared_records.surface_fidelity import SurfaceFidelity
from femprep.model.shared_records.tissue import TissuesRecord
from femprep.options import CheckOptions


class Histogram(Record):
    """Counts between edges: ``counts[i]`` values lie from ``edges[i]`` to ``edges[i + 1]``."""

    edges: tuple[float, ...]
    counts: tuple[int, ...]


class Statistics(Record):
    """Distribution of one measure over elements."""

    unit: str = Field(description="Unit of the measure, or what 1 means.")
    count: int = Field(description="Number of elements (or edges, nodes) it is finite on.")
    min: float
    mean: float
    median: float
    max: float
    standard_deviation: float
    percentiles: dict[str, float] = Field(description="Values that 1, 5, 25, 75, 95, 99 % of the elements stay below.")
    histogram: Histogram


class RegionRecord(Record):
    """Elements of one region tag."""

    tag: int
    elements: int
    volume: float = Field(description="mm3")


class FacetRecord(Record):
    """Facets of one facet tag."""

    tag: int
    facets: int
    area: float = Field(description="mm2; curved facets are taken as straight between their corners.")
    pieces: int = Field(description="Connected pieces the facets are in.")
    off_plane: float | None = Field(None, description="Greatest distance of their points from their plane, mm.")


class WorstElement(Record):
    """One of the worst elements by one measure."""

    measure: str
    value: float
    element: int = Field(description="Number of the element over all blocks in their order, from 0.")
    type: str
    region: str
    centroid: tuple[float, float, float] = Field(description="Mean of its corners, mm LPS.")


class Validity(Record):
    """What makes a mesh unfit whatever its element shapes."""

    inverted_elements: int = Field(description="Elements whose Jacobian is not positive at a corner or inside.")
    duplicate_elements: int = Field(description="Elements with the same corners as another one.")
    non_manifold_faces: int = Field(description="Faces that belong to more than two elements.")
    open_boundary_edges: int = Field(description="Edges of the boundary with one boundary face only.")
    non_manifold_boundary_edges: int = Field(description="Edges of the boundary with more than two boundary faces.")
    non_manifold_boundary_points: int = Field(description="Points at which the boundary touches itself.")
    duplicate_points: int = Field(description="Points in use that lie on another one.")
    orphan_points: int = Field(description="Points that no element uses.")
    pieces: int = Field(description="Connected pieces of the mesh; elements are connected through faces.")
    boundary_shells: int = Field(description="Closed surfaces the boundary consists of.")
    euler_characteristic: int = Field(description="Of the boundary: 2 for a ball or a wall that is open at its base.")
    boundary_facets: int = Field(description="Faces that belong to one element only.")
    untagged_boundary_facets: int | None = Field(description="Boundary faces without a tag; null without any tags.")
    stray_facets: int = Field(description="Tagged facets that are no face of any element.")
    inward_facets: int = Field(description="Tagged boundary facets that are wound into the mesh.")
    interface_facets: int = Field(0, description="Tagged facets with an element on either side.")
    untagged_interface_facets: int | None = Field(
        None, description="Faces between wall and blood without a tag; null without blood pools."
    )
    misplaced_interface_facets: int | None = Field(
        None,
        description="Tagged facets inside that do not lie between wall and blood, wound out of the wall; null without "
        "blood pools.",
    )


class LimitRecord(Record):
    """One limit, what was found, and whether it is met."""

    name: str
    kind: Literal["at least", "at most", "exactly"]
    limit: float
    value: float
    passed: bool


class QualityReport(Record):
    """Quality and validity of a mesh, against limits.

    Examples
    --------
    >>> fp.check(mesh)
    QualityReport(... points, ... tetra, ...)
    """

    n_points: int
    cells: dict[str, int] = Field(description="Number of elements by type.")
    facets: dict[str, int] = Field(description="Number of tagged facets by type.")
    volume: float = Field(description="mm3")
    bounds: tuple[tuple[float, float, float], tuple[float, float, float]] = Field(
        description="Smallest and largest coordinates of the points in use, mm LPS."
    )
    regions: dict[str, RegionRecord]
    facet_tags: dict[str, FacetRecord]
    measures: dict[str, Statistics] = Field(description="Over all elements a measure is defined on.")
    measures_by_type: dict[str, dict[str, Statistics]] = Field(description="The same for each type of element.")
    edge_length: Statistics = Field(description="Over all edges of the mesh.")
    elements_through_wall: Statistics | None = Field(
        description="Elements between endocardial nodes and the epicardium; null without such facets."
    )
    time_step: float = Field(description="Stable time step of explicit dynamics, microseconds, by options.wave_speed.")
    volume_ratio: float | None = Field(
        description="Largest ratio of the volumes of two elements that share a face; null where one has no volume."
    )
    worst: tuple[WorstElement, ...]
    validity: Validity
    options: CheckOptions
    limits_from: str = Field(description="Where the limits come from: the mesh, the defaults, given by hand.")
    limits: tuple[LimitRecord, ...]
    fidelity: tuple[FidelityRecord, ...] | None = Field(
        None, description="Distance to the labels the mesh was made from; null where they are not at hand."
    )
    tissues: TissuesRecord | None = Field(
        None, description="Scar, border zone or other tissue of a second image, by AHA segment; null without one."
    )
    thickness_mm: dict[str, float | None] | None = Field(
        None,
        description="Mean thickness of the wall in each of the 17 AHA segments by its name, mm; null without segments, "
        "and before the folder of the run is written.",
    )
    given_fidelity: tuple[SurfaceFidelity, ...] | None = Field(
        None, description="Distance to the surfaces that were given; null where none were."
    )
    failures: tuple[str, ...] = Field(description="One line for each limit or condition that is not met.")
    notes: tuple[str, ...] = Field(description="What could not be judged, and why.")

    @computed_field(description="Whether every limit and condition is met.")  # type: ignore[prop-decorator]
    @property
    def passed(self) -> bool:
        """Whether every limit and condition is met.

        Examples
        --------
        >>> fp.check(mesh).passed
        True
        """
        return not self.failures

    @property
    def success(self) -> str:
        """What there is to say of a mesh that passed: without limits on its elements their quality is not judged.

        Examples
        --------
        >>> fp.check(mesh).success
        'every check passed'
        """
        if any(one.kind != "exactly" for one in self.limits):
            return "every check passed"
        return "no defects found; the quality of the elements is not judged: --purpose sets limits"

    def __repr__(self) -> str:
        cells = ", ".join(f"{number} {kind}" for kind, number in self.cells.items())
        verdict = "passed" if self.passed else f"failed: {'; '.join(self.failures)}"
        return f"QualityReport({self.n_points} points, {cells}, {verdict})"

    def worst_few(self, count: int) -> list[WorstElement]:
        """So many of the worst elements by each measure.

        Examples
        --------
        >>> len(fp.check(mesh).worst_few(1)) > 0
        True
        """
        measures = [item.measure for item in self.worst]
        return [item for k, item in enumerate(self.worst) if measures[:k].count(item.measure) < count]

    def raise_if_failed(self) -> Self:
        """Raise where a check failed, else return the report itself.

        Raises
        ------
        QualityError
            One line with everything that failed.

        Examples
        --------
        >>> fp.check(mesh).raise_if_failed()  # doctest: +SKIP
        """
        if self.failures:
            raise QualityError("the mesh fails its checks: " + "; ".join(self.failures))
        return self
