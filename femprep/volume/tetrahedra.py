"""A closed tagged wall in, a mesh of tetrahedra with tagged facets out: fTetWild behind a guard, then put in order."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
import numpy.typing as npt

from femprep.errors import StageError
from femprep.geometry.topology import edge_table, euler_characteristic, pieces, pinched_vertices
from femprep.geometry.tree import curve_order
from femprep.geometry.triangles import areas
from femprep.model import REGION_TAGS, BloodPools, VolumeMesh, Wall
from femprep.options import VolumeOptions, choose
from femprep.volume.blood import Filling, check_cavities, find_facets
from femprep.volume.constraints import constrain
from femprep.volume.guard import Run, run_tetwild
from femprep.volume.measures import element_measures, element_volumes
from femprep.volume.optimise import REGULAR_SINE, optimise
from femprep.volume.rehearsal import meanwhile, rehearse
from femprep.volume.sizing import Sizing, SizingField, sizing_field
from femprep.volume.smooth import quadratic_tetrahedra
from femprep.volume.tagging import tag_facets
from femprep.volume.transmural import elements_through_wall
from femprep.volume.validate import Estimate, check_edge_length, check_sizing, check_wall

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
Progress = Callable[[str, float], None]

_log = logging.getLogger(__name__)

#: Share of the progress that belongs to the mesher.
_MESHER_SHARE = 0.9
#: How the outcome of a run is told whose mesh is sound but poorer than asked.
_MISSED = "below what was asked"
#: Lowest stop energy of a run: with 5 fTetWild may not come to an end.
_LOWEST_ENERGY = 6.0
#: An edge that is longer than this share of the wall's mean thickness, and the mean of the mean ratio that then needs
#: the lowest stop energy (edges of 6 mm, wall of 9 mm: 0.855 with an energy of 10 or 8, 0.873 with 6).
_COARSE, _BOUND = 0.5, 0.85
#: Largest relative difference between the volumes of mesh and wall.
_VOLUME_LIMIT = 0.02
#: Least share of endocardial nodes with as many elements through the wall as asked for.
_THROUGH_SHARE = 0.95


@dataclass(frozen=True)
class Attempt:
    """Parameters of one run: envelope in mm and stop energy."""

    envelope: float
    stop_energy: float


@dataclass(frozen=True)
class _Candidate:
    mesh: VolumeMesh
    smallest_dihedral: float
    mean_ratio: float
    reached: bool


def tetrahedralize(
    wall: Wall,
    *,
    options: VolumeOptions | None = None,
    progress: Progress | None = None,
    sizing: Sizing | None = None,
    blood: BloodPools | None = None,
    **changes: Any,
) -> VolumeMesh:
    """Fill a wall with tetrahedra, and the blood in its cavities where that is given.

    fTetWild [1]_ meshes the wall in a child process. Then every boundary facet gets its tag from the wall, points of
    base and apex facets are put onto their planes, other boundary points back onto the wall, and the worst elements
    are improved. The result is checked; a run that fails, or misses the quality asked for, is repeated with other
    parameters. fTetWild is not deterministic: two runs give different meshes.

    Parameters
    ----------
    wall : Wall
        Closed, wound out of the tissue, tagged.
    options : VolumeOptions, optional
        Quality asked for, edge length or elements through the wall, limits of time and memory.
    progress : callable, optional
        Called with ``("volume", fraction)`` about five times a second while the mesher runs; the fraction is a guess
        from the time gone, as the mesher tells nothing. An exception it raises ends the mesher and is passed on.
    sizing : callable or pair of arrays, optional
        Edge lengths wanted, mm: a function of points ``(n, 3)``, or points ``(k, 3)`` and the lengths there ``(k,)``,
        of which the nearest counts.
    blood : BloodPools, optional
        Of this wall, from :func:`~femprep.fill_cavities`: meshed together with it, so that both share their nodes.
    **changes
        Options by name in place of those given.

    Returns
    -------
    VolumeMesh
        One block ``"tetra"`` (``"tetra10"`` for order 2), every boundary facet tagged. The wall is region ``lv``.
        Blood is ``blood_lv``, ``blood_rv``...; its facets in planes that cut the wall open are tagged ``cap_lv``...,
        those it shares with the wall as the endocardium, wound out of the wall.
        ``info`` tells parameters, attempts with seconds and peak memory, what was moved, whether the quality asked for
        was reached, and the elements through the wall where a number of them was asked for.

    Raises
    ------
    InputError
        The wall is open, wound wrongly, crosses itself, is not finite, or is not tagged.
    OptionError
        An option is out of range, or the edge length larger than the wall is thick.
    ResourceError
        The mesh would need more memory than the limit.
    StageError
        Every attempt crashed, ran out of time or gave a wrong mesh.

    References
    ----------
    .. [1] Hu et al., Fast tetrahedral meshing in the wild, ACM Trans. Graph. 39(4), 2020.
       doi:10.1145/3386569.3392385
    """
    settings = choose(VolumeOptions, options, changes)
    check_wall(wall)
    filling = Filling(wall, blood)
    field = sizing_field(wall, settings, sizing)
    size = filling.outer.volume / wall.volume
    need = check_edge_length(wall, settings, size) if field is None else check_sizing(field, settings, size)
    if need.seconds > settings.time_limit:
        _log.warning(
            "about %.2g elements will take about %.0f s, longer than the time limit of %g s",
            *(need.elements, need.seconds, settings.time_limit),
        )
    report = progress or (lambda stage, fraction: None)
    record: list[dict[str, Any]] = []
    best: _Candidate | None = None
    shortest = settings.edge_length if field is None else max(field.finest, 0.4 * field.coarsest)
    thickness = 2.0 * wall.volume / float(areas(wall.points, wall.triangles).sum())
    for attempt in attempts(settings, lambda: record[-1]["outcome"], shortest, thickness):
        entry: dict[str, Any] = {"envelope_mm": attempt.envelope, "stop_energy": attempt.stop_energy}
        record.append(entry)
        try:
            with meanwhile(rehearse(need.elements)):
                run = _mesh(filling, settings, attempt, field, need, report)
            entry.update(
                seconds=run.seconds,
                processor_seconds=run.processor_seconds,
                peak_bytes=run.peak_bytes,
                elements=len(run.cells),
            )
            candidate = _finish(run, filling, settings, attempt)
        except StageError as error:
            entry["outcome"] = str(error)
            _log.warning("attempt %d failed: %s", len(record), error)
            continue
        entry["outcome"] = "reached" if candidate.reached else _missed(candidate)
        if best is None or (candidate.reached, candidate.smallest_dihedral) > (best.reached, best.smallest_dihedral):
            best = candidate
        if candidate.reached:
            break
        _log.warning("attempt %d: %s", len(record), entry["outcome"])
    if best is None:
        raise StageError(f"no mesh after {len(record)} attempt(s), the last: {record[-1]['outcome']}")
    report("volume", 1.0)
    info = {
        "mesher": f"fTetWild through pytetwild {_version('pytetwild')}",
        "deterministic": False,
        "quality": settings.quality,
        "edge_length_mm": settings.edge_length if field is None else [field.finest, field.coarsest],
        "estimate": {"elements": need.elements, "gigabytes": need.gigabytes, "seconds": need.seconds},
        "attempts": record,
        "quality_reached": best.reached,
    }
    mesh = replace(best.mesh, planes={**wall.planes, **filling.caps}, info={**info, **best.mesh.info})
    if settings.elements_through_wall is not None:
        mesh = replace(mesh, info={**mesh.info, **_through(mesh, settings.elements_through_wall)})
    return quadratic_tetrahedra(mesh, wall) if settings.order == 2 else mesh


def attempts(
    options: VolumeOptions, outcome: Callable[[], str], edge_length: float | None = None, thickness: float = np.inf
) -> Iterator[Attempt]:
    """Parameters of the runs: those asked for, then others, by the outcome of the run before.

    After a time limit everything is looser. Where the quality was missed the stop energy is the lowest: a little less
    gains little, and a tighter envelope would only keep more of the wall's small triangles; what it misses no run
    reaches. After a crash or a wrong mesh both are tighter. Where an edge takes more than half of the wall's mean
    ``thickness``, most elements are bound by its surfaces and a good mean ratio needs the lowest stop energy from the
    first run on.
    """
    targets = options.targets
    edge = edge_length or options.edge_length
    envelope = options.envelope or targets.envelope * edge
    energy = targets.stop_energy
    if options.stop_energy is None and edge > _COARSE * thickness and targets.mean_ratio >= _BOUND:
        energy = min(energy, _LOWEST_ENERGY)
    yield Attempt(envelope, energy)
    for _ in range(targets.retries):
        if "time_limit" in outcome():
            envelope, energy = 1.5 * envelope, 2.0 * energy
        elif _MISSED in outcome():
            if energy <= _LOWEST_ENERGY:
                return
            energy = _LOWEST_ENERGY
        else:
            energy, envelope = min(energy, max(_LOWEST_ENERGY, energy - 2.0)), envelope / 1.5
        yield Attempt(envelope, energy)


def _mesh(
    filling: Filling,
    options: VolumeOptions,
    attempt: Attempt,
    field: SizingField | None,
    need: Estimate,
    report: Progress,
) -> Run:
    points, triangles = filling.outer.points, filling.triangles
    diagonal = float(np.linalg.norm(np.ptp(points[np.unique(triangles)], axis=0)))
    expected = max(need.seconds, 1.0)
    return run_tetwild(
        points,
        triangles,
        {
            "edge_length_abs": float(options.edge_length if field is None else field.coarsest),
            "epsilon": float(attempt.envelope / diagonal),
            "stop_energy": float(attempt.stop_energy),
            "num_threads": 1,
        },
        arrays={} if field is None else {"bg_vertices": field.points, "bg_tets": field.tets, "bg_values": field.values},
        time_limit=options.time_limit,
        memory_limit=options.memory_limit,
        pulse=lambda gone: report("volume", _MESHER_SHARE * (1.0 - float(np.exp(-gone / expected)))),
    )


def _finish(run: Run, filling: Filling, options: VolumeOptions, attempt: Attempt) -> _Candidate:
    """Check, tag, put in place and improve what the mesher gave.

    Raises
    ------
    StageError
        The mesh is wrong.
    """
    kept = filling.regions(run.points, run.cells) > 0 if filling.cavities else slice(None)
    points, cells = _used(run.points, run.cells[kept])
    region, outer = filling.regions(points, cells), filling.outer
    _check_volumes(points, cells, outer)
    facets = find_facets(cells, region)
    boundary = facets.interface == 0
    with ThreadPoolExecutor(1) as pool:  # two threads, which numpy lets work side by side
        sound = pool.submit(_check_boundary, facets.nodes[boundary], outer)
        try:
            merged = filling.interface_tags(facets.interface)
            merged[boundary] = tag_facets(points, facets.nodes[boundary], outer, attempt.envelope)
            constraints = constrain(len(points), facets.nodes, merged, filling.sheets)
        finally:  # what is wrong with the boundary is told rather than that it cannot be tagged
            sound.result()
    if filling.cavities:
        check_cavities(points, cells, region, filling, 2.0 * _VOLUME_LIMIT)
    before = points.copy()
    if options.optimise:
        poor = float(np.sin(np.radians(options.targets.poor_angle)) / REGULAR_SINE)
        outcome = optimise(points, cells, constraints, poor=poor)
        points = outcome.points
        moved = {
            "sweeps": outcome.sweeps,
            "poor_elements_before": outcome.poor_before,
            "poor_elements_after": outcome.poor_after,
            "greatest_distance_from_wall_mm": outcome.off_wall,
        }
    else:
        points = points.copy()
        constraints.flatten(points)
        moved = {}
    measures = element_measures(points, cells, "tetra")
    inverted = measures["volume"] <= 0
    if inverted.any():
        worst = points[cells[np.argmin(measures["volume"])]].mean(axis=0)
        raise StageError(
            f"{int(inverted.sum())} elements are inverted once points lie on the planes, the worst near "
            f"x y z = {' '.join(f'{v:.1f}' for v in worst)}; choose a smaller edge_length or envelope"
        )
    found = {name: float(measures["volume"][region == REGION_TAGS[name]].sum()) for name in filling.volumes}
    difference = {name: found[name] / wanted - 1.0 for name, wanted in filling.volumes.items()}
    for name, value in difference.items():
        if abs(value) > _VOLUME_LIMIT:
            what = "wall" if name == "lv" else name
            raise StageError(
                f"the mesh has {found[name]:.4g} mm3 of {what}, {filling.volumes[name]:.4g} mm3 are to be filled: a "
                f"difference of {100 * value:.2f} %, more than {100 * _VOLUME_LIMIT:g} %; "
                "choose a smaller edge_length or envelope"
            )
    step = np.linalg.norm(points - before, axis=1)
    info = {
        "envelope_mm": attempt.envelope,
        "stop_energy": attempt.stop_energy,
        "volume_mm3": found.pop("lv"),
        "volume_difference_to_wall": difference["lv"],
        **({"blood_mm3": found} if found else {}),
        "moved_points": int((step > 0).sum()),
        "greatest_move_mm": float(step.max()),
        **moved,
    }
    tag = filling.tags(merged, facets, region)
    mesh = VolumeMesh(points, {"tetra": cells}, region, {"triangle": facets.nodes}, tag, info=info)
    smallest, mean = float(measures["minimum_dihedral"].min()), float(measures["mean_ratio"].mean())
    reached = smallest >= options.targets.minimum_dihedral and mean >= options.targets.mean_ratio
    return _Candidate(mesh, smallest, mean, reached)


def _through(mesh: VolumeMesh, asked: int) -> dict[str, Any]:
    """Elements through the wall: asked for and measured; a note where too few nodes have as many."""
    count = elements_through_wall(mesh)
    share = float((count >= asked).mean())
    found = {
        "asked": asked,
        "share_of_nodes": share,
        "minimum": int(count.min()),
        "median": float(np.median(count)),
        "maximum": int(count.max()),
    }
    if share >= _THROUGH_SHARE:
        return {"elements_through_wall": found}
    line = (
        f"{asked} elements through the wall were asked for, {100 * share:.0f} % of the endocardial nodes have them "
        f"(least {found['minimum']}, median {found['median']:g})"
    )
    _log.warning(line)
    return {"elements_through_wall": found, "notes": [line]}


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


def _check_boundary(facets: IntArray, wall: Wall) -> None:
    """Make sure that the boundary facets bound the same kind of body as the wall."""
    table = edge_table(facets)
    if (table.count != 2).any() or (table.forward != 1).any() or len(pinched_vertices(facets)):
        raise StageError("the boundary of the mesh is no closed 2-manifold; choose a smaller edge_length or envelope")
    shells, expected = int(pieces(facets).max()) + 1, int(pieces(wall.triangles).max()) + 1
    euler, wanted = euler_characteristic(facets), euler_characteristic(wall.triangles)
    if shells != expected or euler != wanted:
        raise StageError(
            f"the boundary of the mesh has {shells} shell(s) and Euler characteristic {euler}, the wall's {expected} "
            f"and {wanted}; choose a smaller edge_length or envelope"
        )


def _missed(candidate: _Candidate) -> str:
    return (
        f"smallest dihedral angle {candidate.smallest_dihedral:.1f} degrees, mean of the mean ratio "
        f"{candidate.mean_ratio:.3f}: {_MISSED}"
    )


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"
