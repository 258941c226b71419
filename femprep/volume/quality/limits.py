"""Element measures, validity and limits in, verdicts and one line for each failure out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from femprep.mesh.measures.sample_points import family
from femprep.model import FloatArray
from femprep.model.notice import spot
from femprep.model.shared_records.solution import SolutionRecord
from femprep.options import CheckOptions
from femprep.volume.quality.report import FacetRecord, LimitRecord, QualityReport, Validity, WorstElement
from femprep.volume.quality.verdicts import Verdicts

#: Counts that have to be zero, and how a failure is told.
_FAULTS: Final[Mapping[str, str]] = {
    "inverted_elements": "inverted element(s)",
    "duplicate_elements": "element(s) doubled",
    "non_manifold_faces": "face(s) shared by more than two elements",
    "open_boundary_edges": "boundary edge(s) with one face only",
    "non_manifold_boundary_edges": "boundary edge(s) with more than two faces",
    "non_manifold_boundary_points": "point(s) where the boundary touches itself",
    "duplicate_points": "pair(s) of points in the same place",
    "orphan_points": "point(s) that no element uses",
    "untagged_boundary_facets": "boundary facet(s) without a tag",
    "stray_facets": "tagged facet(s) that are no face of any element",
    "inward_facets": "tagged facet(s) wound into the mesh",
    "untagged_interface_facets": "facet(s) between wall and blood without a tag",
    "misplaced_interface_facets": "tagged facet(s) inside that are not between wall and blood, wound out of the wall",
}

#: Names of the limits on the shapes of elements.
SHAPES: Final = frozenset(
    {
        *("minimum_scaled_jacobian", "minimum_mean_ratio", "minimum_relative_jacobian"),
        *("minimum_dihedral", "maximum_dihedral", "mean_of_mean_ratio"),
    }
)


def judge(
    measures: Mapping[str, Mapping[str, FloatArray]],
    validity: Validity,
    facet_tags: Mapping[str, FacetRecord],
    sizes: Mapping[str, float | None],
    options: CheckOptions,
    worst: Sequence[WorstElement] = (),
) -> tuple[tuple[LimitRecord, ...], tuple[str, ...]]:
    """Compare what was found with the limits.

    Parameters
    ----------
    measures : mapping
        Measures by element type.
    validity : Validity
    facet_tags : mapping
        Facets by tag name.
    sizes : mapping
        ``time_step``, ``size_ratio``, ``volume_ratio`` and ``edge_by_space_constant`` of the mesh; None where there is
        no such thing.
    options : CheckOptions
        The limits; those on angles and mean ratio concern tetrahedra.
    worst : sequence of WorstElement
        Elements whose place is told where they miss a limit; the worst by each measure first.

    Returns
    -------
    verdicts : tuple of LimitRecord
    failures : tuple of str
    """
    held = Verdicts()
    for name, what in _FAULTS.items():
        value = getattr(validity, name)
        if held.misses(name, "exactly", 0.0, value):
            held.failures.append(f"{value} {what}")
    for name, record in facet_tags.items():
        if record.off_plane is not None:
            held.compare(
                *(f"{name}_off_plane", "at most", options.plane_tolerance, record.off_plane),
                f"greatest distance of {name} points from their plane in mm",
            )
    judge_shapes(measures, options, held, worst)
    held.compare(
        *("minimum_size_ratio", "at least", options.minimum_size_ratio, sizes["size_ratio"]),
        "smallest characteristic length by the median one",
    )
    held.compare(
        *("maximum_volume_ratio", "at most", options.maximum_volume_ratio, sizes["volume_ratio"]),
        "largest ratio of the volumes of neighbouring elements",
    )
    held.compare(
        *("minimum_time_step", "at least", options.minimum_time_step, sizes["time_step"]),
        "stable time step in microseconds",
    )
    held.compare(
        "maximum_edge_by_space_constant",
        *("at most", options.maximum_edge_by_space_constant, sizes["edge_by_space_constant"]),
        "mean edge length by the space constant",
    )
    return tuple(held.limits), tuple(held.failures)


def judge_shapes(
    measures: Mapping[str, Mapping[str, FloatArray]],
    options: CheckOptions,
    held: Verdicts,
    worst: Sequence[WorstElement] = (),
) -> None:
    """Hold the shapes of elements, measures by element type, to the limits on them."""
    place = {item.measure: f" near {spot(item.centroid)}" for item in reversed(worst)}
    for name, limit, what in (
        ("scaled_jacobian", options.minimum_scaled_jacobian, "smallest scaled Jacobian"),
        ("mean_ratio", options.minimum_mean_ratio, "smallest mean ratio"),
        ("relative_jacobian", options.minimum_relative_jacobian, "smallest relative Jacobian"),
    ):
        smallest = min(float(table[name].min()) for table in measures.values())
        held.compare(f"minimum_{name}", "at least", limit, smallest, what, place.get(name, ""))
    tets = [table for name, table in measures.items() if family(name) == "tetra"]
    if tets:
        least = min(float(table["minimum_dihedral"].min()) for table in tets)
        most = max(float(table["maximum_dihedral"].max()) for table in tets)
        mean = float(np.concatenate([table["mean_ratio"] for table in tets]).mean())
        degrees = "dihedral angle in degrees"
        held.compare(
            *("minimum_dihedral", "at least", options.minimum_dihedral, least, f"smallest {degrees}"),
            place.get("minimum_dihedral", ""),
        )
        held.compare("maximum_dihedral", "at most", options.maximum_dihedral, most, f"largest {degrees}")
        held.compare("mean_of_mean_ratio", "at least", options.mean_of_mean_ratio, mean, "mean of the mean ratio")


def judge_wall_volume(report: QualityReport, difference: float | None) -> QualityReport:
    """The report with a verdict on how much the wall's volume differs from its labels', which a mesh alone cannot tell.

    Parameters
    ----------
    report : QualityReport
        Of the mesh; its options hold the limit.
    difference : float, optional
        Per cent of the labels' volume, positive where the wall has more; None where there is nothing to compare with.
    """
    limit = report.options.maximum_wall_volume_difference
    if limit is None or difference is None:
        return report
    held = Verdicts()
    if held.misses("wall_volume_difference", "at most", limit, abs(difference)):
        more = "more" if difference > 0 else "less"
        held.failures.append(
            f"the wall of the left ventricle has {abs(difference):.1f} % {more} volume than its labels (what was "
            f"extrapolated at the apex aside), asked for is at most {limit:g} %; compare the outlines in report.html"
        )
    return held.on(report)


def judge_solution(report: QualityReport, solution: SolutionRecord) -> QualityReport:
    """The report with a failure where a solver could not inflate the mesh, or its reaction tells of a wrong deck."""
    if solution.failure is None:
        return report
    return report.model_copy(update={"failures": (*report.failures, solution.failure)})
