"""What fTetWild gave in, a mesh in order out: checked, its facets tagged, put onto the wall and improved."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from femprep.errors import StageError
from femprep.mesh.measures.volume_elements import element_measures, element_volumes
from femprep.mesh.topology import edge_table, euler_characteristic, pieces, pinched_vertices
from femprep.mesh.tree import curve_order
from femprep.model import REGION_TAGS, FloatArray, IntArray, TagArray, VolumeMesh, Wall, endo_tags, tag_name
from femprep.options import VolumeOptions
from femprep.volume.blood import Filling, TaggedFacets, check_cavities, find_facets
from femprep.volume.optimise import REGULAR_SINE, optimise
from femprep.volume.optimise.constraints import Constraints, constrain
from femprep.volume.refine import PARENT, refine
from femprep.volume.refine.peel import without_flat
from femprep.volume.tagging import tag_facets
from femprep.volume.tetwild.attempts import MISSED, Attempt
from femprep.volume.tetwild.guard import Run

#: Largest relative difference between the volumes of mesh and wall.
_VOLUME_LIMIT: Final = 0.02


@dataclass(frozen=True)
class Candidate:
    """A sound mesh of one run, and whether it is as good as asked.

    Attributes
    ----------
    mesh : VolumeMesh
    smallest_dihedral : float
        Degrees.
    mean_ratio : float
        Mean of the mean ratio.
    reached : bool
        Whether both are as asked.
    """

    mesh: VolumeMesh
    smallest_dihedral: float
    mean_ratio: float
    reached: bool

    @property
    def outcome(self) -> str:
        """What came of the run, for its record."""
        if self.reached:
            return "reached"
        return (
            f"smallest dihedral angle {self.smallest_dihedral:.1f} degrees, mean of the mean ratio "
            f"{self.mean_ratio:.3f}: {MISSED}"
        )


def finish(run: Run, filling: Filling, options: VolumeOptions, attempt: Attempt) -> Candidate:
    """Check, tag, put in place and improve what the mesher gave.

    Raises
    ------
    StageError
        The mesh is wrong.
    """
    kept = filling.regions(run.points, run.cells) > 0 if filling.cavities else slice(None)
    given, cells = _used(run.points, run.cells[kept])
    region = filling.regions(given, cells)
    _check_volumes(given, cells, filling.outer)
    facets = find_facets(cells, region)
    merged, constraints = _held(given, facets, filling, attempt.envelope)
    if filling.cavities:
        check_cavities(given, cells, region, filling, 2.0 * _VOLUME_LIMIT)
    points, record = _improved(given, cells, constraints, options)
    _check_positive(points, cells, element_volumes(points, cells, "tetra"))
    step = np.linalg.norm(points - given, axis=1)
    info = {
        "envelope_mm": attempt.envelope,
        "stop_energy": attempt.stop_energy,
        "moved_points": int((step > 0).sum()),
        "greatest_move_mm": float(step.max()),
        **record,
    }
    tag = filling.tags(merged, facets, region)
    planes = {**filling.wall.planes, **filling.caps}
    mesh = VolumeMesh(points, {"tetra": cells}, region, {"triangle": facets.nodes}, tag, planes=planes, info=info)
    if attempt.levels:
        mesh = _refined(mesh, filling, options, attempt.levels)
    measures = element_measures(mesh.points, mesh.cells["tetra"], "tetra")
    mesh = replace(mesh, info={**mesh.info, **_filled(measures["volume"], mesh.region, filling)})
    smallest, mean = float(measures["minimum_dihedral"].min()), float(measures["mean_ratio"].mean())
    reached = smallest >= options.targets.minimum_dihedral and mean >= options.targets.mean_ratio
    return Candidate(mesh, smallest, mean, reached)


def _refined(mesh: VolumeMesh, filling: Filling, options: VolumeOptions, levels: int) -> VolumeMesh:
    """The mesh refined to the edge length asked for, its boundary on the smooth surfaces of the wall."""
    smooth = [t for t in np.unique(mesh.facet_tag).tolist() if tag_name(t).startswith(("endo", "epi"))]
    # The endocardium of a wall with blood has elements on both sides.
    tags = [t for t in smooth if not (filling.cavities and t in endo_tags())]
    mesh, flat = without_flat(mesh, tags, _poor(options))
    fine = refine(mesh, levels, wall=filling.sheets, optimised=options.optimise, poor=_poor(options))
    # Of the coarse mesh nothing is kept that the parents' numbers could point into.
    fine = replace(fine, cell_data={name: values for name, values in fine.cell_data.items() if name != PARENT})
    fine, few = without_flat(fine, tags, _poor(options))
    return replace(fine, info={**fine.info, "flat_elements_removed": flat + few})


def _poor(options: VolumeOptions) -> float:
    """Quality below which an element is improved."""
    return float(np.sin(np.radians(options.targets.poor_angle)) / REGULAR_SINE)


def _used(points: FloatArray, cells: IntArray) -> tuple[FloatArray, IntArray]:
    """Points in use alone, and the cells that name them; what is near in space near in memory, which is quicker."""
    if len(cells) == 0:
        raise StageError("the mesher gave no elements; choose a smaller edge_length or envelope")
    if not np.isfinite(points).all() or cells.min() < 0 or cells.max() >= len(points):
        raise StageError("the mesher gave points that are not finite or not there; choose another edge_length")
    used = np.zeros(len(points), dtype=np.bool_)
    used[cells] = True
    kept = np.flatnonzero(used)
    kept = kept[curve_order(points[kept])]
    number = np.empty(len(points), dtype=np.int64)
    number[kept] = np.arange(len(kept))
    cells = number[cells]
    return points[kept], cells[np.argsort(cells.min(axis=1), kind="stable")]


def _check_volumes(points: FloatArray, cells: IntArray, wall: Wall) -> None:
    """Make sure that no element is inverted and that they fill the wall, nothing else."""
    volumes = element_volumes(points, cells, "tetra")
    if (volumes <= 0).any():
        raise StageError(f"the mesher gave {int((volumes <= 0).sum())} inverted elements; choose another edge_length")
    difference = float(volumes.sum() / wall.volume - 1.0)
    if abs(difference) > 2.0 * _VOLUME_LIMIT:
        raise StageError(
            f"the mesher made {volumes.sum():.4g} mm3 of a wall of {wall.volume:.4g} mm3"
            + ("; it filled a cavity" if difference > 0 else "; it lost part of it")
            + "; choose a smaller edge_length or envelope"
        )


def _held(points: FloatArray, facets: TaggedFacets, filling: Filling, envelope: float) -> tuple[TagArray, Constraints]:
    """Tag of each facet ``(f,)``, with that of a plane for the caps that lie in it, and what holds the boundary points.

    Raises
    ------
    StageError
        The boundary is not that of what is filled, or cannot be tagged.
    """
    boundary = facets.interface == 0
    # Before it is tagged: what is wrong with the boundary is told rather than that it cannot be.
    _check_boundary(facets.nodes[boundary], filling.outer)
    merged = filling.interface_tags(facets.interface)
    merged[boundary] = tag_facets(points, facets.nodes[boundary], filling.outer, envelope)
    return merged, constrain(len(points), facets.nodes, merged, filling.sheets)


def _check_boundary(facets: IntArray, wall: Wall) -> None:
    """Make sure that the boundary facets bound the same kind of body as the wall."""
    table = edge_table(facets)
    if (table.count != 2).any() or (table.forward != 1).any() or len(pinched_vertices(facets, table)):
        raise StageError("the boundary of the mesh is no closed 2-manifold; choose a smaller edge_length or envelope")
    shells, euler = int(pieces(facets, table).max()) + 1, euler_characteristic(facets, table)
    table = edge_table(wall.triangles)
    expected, wanted = int(pieces(wall.triangles, table).max()) + 1, euler_characteristic(wall.triangles, table)
    if shells != expected or euler != wanted:
        raise StageError(
            f"the boundary of the mesh has {shells} shell(s) and Euler characteristic {euler}, the wall's {expected} "
            f"and {wanted}; choose a smaller edge_length or envelope"
        )


def _improved(
    points: FloatArray, cells: IntArray, constraints: Constraints, options: VolumeOptions
) -> tuple[FloatArray, dict[str, Any]]:
    """Points ``(n, 3)`` put in place and, where asked for, moved for better elements; what was done, for the record."""
    if not options.optimise:
        flat = points.copy()
        constraints.flatten(flat)
        return flat, {}
    outcome = optimise(points, cells, constraints, poor=_poor(options))
    return outcome.points, {
        "sweeps": outcome.sweeps,
        "poor_elements_before": outcome.poor_before,
        "poor_elements_after": outcome.poor_after,
        "greatest_distance_from_wall_mm": outcome.off_wall,
    }


def _check_positive(points: FloatArray, cells: IntArray, volumes: FloatArray) -> None:
    """Make sure that putting points in place inverted no element."""
    inverted = volumes <= 0
    if inverted.any():
        worst = points[cells[np.argmin(volumes)]].mean(axis=0)
        raise StageError(
            f"{int(inverted.sum())} elements are inverted once points lie on the planes, the worst near "
            f"x y z = {' '.join(f'{v:.1f}' for v in worst)}; choose a smaller edge_length or envelope"
        )


def _filled(volumes: FloatArray, region: TagArray, filling: Filling) -> dict[str, Any]:
    """Volumes of wall and blood, for the record.

    Raises
    ------
    StageError
        One differs too much from what was to be filled.
    """
    found = {name: float(volumes[region == REGION_TAGS[name]].sum()) for name in filling.volumes}
    difference = {name: found[name] / wanted - 1.0 for name, wanted in filling.volumes.items()}
    for name, value in difference.items():
        if abs(value) > _VOLUME_LIMIT:
            what = "wall" if name == "lv" else name
            raise StageError(
                f"the mesh has {found[name]:.4g} mm3 of {what}, {filling.volumes[name]:.4g} mm3 are to be filled: a "
                f"difference of {100 * value:.2f} %, more than {100 * _VOLUME_LIMIT:g} %; "
                "choose a smaller edge_length or envelope"
            )
    return {
        "volume_mm3": found.pop("lv"),
        "volume_difference_to_wall": difference["lv"],
        **({"blood_mm3": found} if found else {}),
    }
