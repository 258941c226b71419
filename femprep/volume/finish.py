"""What fTetWild gave in, a mesh in order out: checked, its facets tagged, put onto the wall and improved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from femprep.errors import StageError
from femprep.mesh.measures.volume_elements import element_measures, element_volumes
from femprep.mesh.search.tree import curve_order
from femprep.model import FloatArray, IntArray, Progress, TagArray, VolumeMesh, endo_tags, noted, tag_name
from femprep.model.blocks import nodes_of, numbers_among
from femprep.options import CheckOptions, VolumeOptions
from femprep.volume.blood import Filling, TaggedFacets, check_cavities, find_facets
from femprep.volume.optimise import optimise
from femprep.volume.optimise.constraints import Constraints, constrain
from femprep.volume.optimise.poor import poor_quality
from femprep.volume.pinches import pinch_notice, without_pinches
from femprep.volume.pits import pit_notice, without_pits
from femprep.volume.quality.limits import judge_shapes
from femprep.volume.quality.verdicts import Verdicts
from femprep.volume.refine import PARENT, refine
from femprep.volume.refine.peel import without_flat
from femprep.volume.sound import VOLUME_LIMIT, check_boundary, check_positive, check_volumes, filled, require_sound
from femprep.volume.tagging import tag_facets
from femprep.volume.tetwild.guard import TetwildRun
from femprep.volume.tetwild.ways import RunParameters

#: Smallest dihedral angle asked of a mesh that was refined, degrees, where no angle was asked for and the quality's own
#: is lower: the mesher itself mostly makes one of 25, of 20 at least.
_REFINED_DIHEDRAL: Final = 20.0
#: Gain of mean quality for which a mesh that misses its mean ratio is gone through once more: that takes a tenth of a
#: second, another run of the mesher a hundred times as long. It brought thin walls .002 to .004.
_WORTH: Final = 0.0005


@dataclass(frozen=True)
class Candidate:
    """A sound mesh of one run, and whether it is as good as asked.

    Attributes
    ----------
    mesh : VolumeMesh
    share : float
        Of smallest dihedral angle and mean of the mean ratio the one that is less of what was asked for, over that.
    failures : tuple of str
        What it misses of the quality asked for and of the limits on the shapes of elements.
    undone : tuple of str
        Steps of putting it in order that spoiled it, and how; it is as it was before each.
    fine : bool
        Whether it is as fine as asked: refinement was not undone.
    """

    mesh: VolumeMesh
    share: float
    failures: tuple[str, ...] = ()
    undone: tuple[str, ...] = ()
    fine: bool = True

    @property
    def reached(self) -> bool:
        """Whether it is as good and as fine as asked."""
        return self.fine and not self.failures

    @property
    def outcome(self) -> str:
        """What came of the run, for its record."""
        if not self.fine:
            return f"the mesh could not be refined: {self.undone[-1]}"
        return "; ".join(self.failures) or "reached"


def finish(
    run: TetwildRun,
    filling: Filling,
    options: VolumeOptions,
    parameters: RunParameters,
    limits: CheckOptions,
    progress: Progress | None = None,
) -> Candidate:
    """Check, tag, put in place, refine and improve what the mesher gave, and hold it to what is asked.

    ``progress`` is told of the refinement.

    Raises
    ------
    StageError
        The mesh is wrong.
    """
    kept = filling.regions(run.points, run.cells) > 0 if filling.cavities else slice(None)
    whole, pinches = without_pinches(run.points, run.cells[kept])
    given, cells = _used(run.points, whole)
    given, cells, pits = without_pits(given, cells, filling.outer)
    region = filling.regions(given, cells)
    check_volumes(given, cells, filling.outer)
    facets = find_facets(cells, region)
    merged, constraints = _held(given, facets, filling, parameters.envelope)
    if filling.cavities:
        check_cavities(given, cells, region, filling, 2.0 * VOLUME_LIMIT)
    poor = poor_quality(options.targets.poor_angle, limits)
    asked = options.targets.mean_ratio
    points, record = _improved(given, cells, constraints, poor if options.optimise else None, asked)
    check_positive(points, cells, element_volumes(points, cells, "tetra"))
    step = np.linalg.norm(points - given, axis=1)
    info = {
        "envelope_mm": parameters.envelope,
        "stop_energy": parameters.stop_energy,
        "moved_points": int((step > 0).sum()),
        "greatest_move_mm": float(step.max()),
        "pits_filled": pits,
        "pinched_edges": len(pinches),
        **record,
    }
    info = noted(info, pinch_notice(pinches)) if len(pinches) else info
    info = noted(info, pit_notice(given, pits)) if pits else info
    tag = filling.tags(merged, facets, region)
    planes = {**filling.wall.planes, **filling.caps}
    mesh = VolumeMesh(points, {"tetra": cells}, region, {"triangle": facets.nodes}, tag, planes=planes, info=info)
    mesh, undone, fine = _in_steps(mesh, filling, parameters.levels, poor, options.optimise, progress)
    measures = element_measures(mesh.points, mesh.cells["tetra"], "tetra")
    mesh = replace(mesh, info={**mesh.info, **filled(measures["volume"], mesh.region, filling)})
    smallest, mean = float(measures["minimum_dihedral"].min()), float(measures["mean_ratio"].mean())
    held = Verdicts()
    if smallest < _asked_dihedral(options, parameters) or mean < options.targets.mean_ratio:
        words = f"smallest dihedral angle {smallest:.1f} degrees, mean of the mean ratio {mean:.3f}"
        held.failures.append(f"{words}: below what was asked")
    judge_shapes({"tetra": measures}, limits, held)
    return Candidate(mesh, _share(smallest, mean, options), tuple(held.failures), undone, fine)


def _share(dihedral: float, mean_ratio: float, options: VolumeOptions) -> float:
    """Of smallest dihedral angle and mean of the mean ratio the one that is less of what was asked for, over that."""
    asked = options.targets
    pairs = ((dihedral, asked.minimum_dihedral), (mean_ratio, asked.mean_ratio))
    return min((found / wanted for found, wanted in pairs if wanted > 0.0), default=1.0)


def _asked_dihedral(options: VolumeOptions, parameters: RunParameters) -> float:
    """Smallest dihedral angle asked of a mesh, degrees."""
    asked = options.targets.minimum_dihedral
    own = options.minimum_dihedral is None and options.quality != "fast"
    return max(asked, _REFINED_DIHEDRAL) if own and parameters.levels else asked


def _in_steps(
    mesh: VolumeMesh, filling: Filling, levels: int, poor: float, optimised: bool, progress: Progress | None
) -> tuple[VolumeMesh, tuple[str, ...], bool]:
    """The mesh refined to the edge length asked for, its boundary on the smooth surfaces of the wall, step by step.

    A step after which the mesh is sound no more is undone: what the mesher gave was sound.

    Returns
    -------
    mesh : VolumeMesh
    undone : tuple of str
        The steps, and what they had spoiled.
    fine : bool
        Whether it is refined.
    """
    if not levels:
        return mesh, (), True
    smooth = [t for t in np.unique(mesh.facet_tag).tolist() if tag_name(t).startswith(("endo", "epi"))]
    # The endocardium of a wall with blood has elements on both sides.
    tags = [t for t in smooth if not (filling.cavities and t in endo_tags())]
    flat, undone = 0, []

    def without(mesh: VolumeMesh, poor: float = np.inf) -> VolumeMesh:
        nonlocal flat
        found, count = without_flat(mesh, tags, poor)
        if count:  # otherwise it is the mesh that was sound before
            require_sound(found, filling)
        flat += count
        return found

    def refined(mesh: VolumeMesh) -> VolumeMesh:
        found = refine(mesh, levels, wall=filling.sheets, optimised=optimised, poor=poor, progress=progress)
        # Of the coarse mesh nothing is kept that the parents' numbers could point into.
        found = replace(found, cell_data={name: values for name, values in found.cell_data.items() if name != PARENT})
        require_sound(found, filling)
        return found

    steps: tuple[tuple[str, Callable[[VolumeMesh], VolumeMesh]], ...] = (
        ("flat elements on a surface removed", without),
        ("refined", refined),
        ("flat elements of the refined mesh removed", lambda mesh: without(mesh, poor)),
    )
    for name, step in steps:
        try:
            mesh = step(mesh)
        except StageError as error:
            undone.append(f"{name}: {error}")
    mesh = replace(mesh, info={**mesh.info, "flat_elements_removed": flat})
    return mesh, tuple(undone), "refinement" in mesh.info


def _used(points: FloatArray, cells: IntArray) -> tuple[FloatArray, IntArray]:
    """Points in use alone, and the cells that name them; what is near in space near in memory, which is quicker."""
    if len(cells) == 0:
        raise StageError("the mesher gave no elements; choose a smaller edge_length or envelope")
    if not np.isfinite(points).all() or cells.min() < 0 or cells.max() >= len(points):
        raise StageError("the mesher gave points that are not finite or not there; choose another edge_length")
    kept = nodes_of({"tetra": cells})
    kept = kept[curve_order(points[kept])]
    cells = numbers_among(kept, len(points))[cells]
    return points[kept], cells[np.argsort(cells.min(axis=1), kind="stable")]


def _held(points: FloatArray, facets: TaggedFacets, filling: Filling, envelope: float) -> tuple[TagArray, Constraints]:
    """Tag of each facet ``(f,)``, with that of a plane for the caps that lie in it, and what holds the boundary points.

    Raises
    ------
    StageError
        The boundary is not that of what is filled, or cannot be tagged.
    """
    boundary = facets.interface == 0
    # Before it is tagged: what is wrong with the boundary is told rather than that it cannot be.
    check_boundary(facets.nodes[boundary], filling.outer)
    merged = filling.interface_tags(facets.interface)
    merged[boundary] = tag_facets(points, facets.nodes[boundary], filling.outer, envelope)
    return merged, constrain(len(points), facets.nodes, merged, filling.sheets)


def _improved(
    points: FloatArray, cells: IntArray, constraints: Constraints, poor: float | None, mean_ratio: float
) -> tuple[FloatArray, dict[str, Any]]:
    """Points ``(n, 3)`` put in place and, where a quality is asked for, moved for better elements; what was done."""
    if poor is None:
        flat = points.copy()
        constraints.flatten(flat)
        return flat, {}
    found = optimise(points, cells, constraints, poor=poor)
    if element_measures(found.points, cells, "tetra")["mean_ratio"].mean() < mean_ratio:
        more = optimise(found.points, cells, constraints, poor=poor, worth=_WORTH)
        found = replace(more, sweeps=found.sweeps + more.sweeps, poor_before=found.poor_before)
    return found.points, {**found.record(), "greatest_distance_from_wall_mm": found.off_wall}
