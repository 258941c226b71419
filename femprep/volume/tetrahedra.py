"""A closed tagged wall in, a mesh of tetrahedra with tagged facets out: fTetWild behind a guard, then put in order."""

from __future__ import annotations

import logging
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Final

import numpy as np

from femprep.model import BloodPools, Notice, Progress, VolumeMesh, Wall, noted
from femprep.options import CheckOptions, VolumeOptions, choose, takes
from femprep.volume.blood import Filling
from femprep.volume.quality.transmural import elements_through_wall
from femprep.volume.refine.plan import levels_of, measured_thickness
from femprep.volume.runs import Sizes, attempt_notices, best_of_runs
from femprep.volume.sizing import Sizing, sizing_field
from femprep.volume.smooth import quadratic_tetrahedra
from femprep.volume.validate import check_edge_length, check_fillable, check_sizing

_log = logging.getLogger(__name__)

#: Least share of endocardial nodes with as many elements through the wall as asked for.
_THROUGH_SHARE: Final = 0.95


@takes(VolumeOptions)
def tetrahedralize(
    wall: Wall,
    *,
    options: VolumeOptions | None = None,
    progress: Progress | None = None,
    sizing: Sizing | None = None,
    blood: BloodPools | None = None,
    limits: CheckOptions | None = None,
    **changes: Any,
) -> VolumeMesh:
    """Fill a wall with tetrahedra, and the blood in its cavities where that is given.

    fTetWild [1]_ meshes the wall in a child process. Then every boundary facet gets its tag from the wall, points of
    base and apex facets are put onto their planes, other boundary points back onto the wall, and the worst elements
    are improved. With ``refinement="auto"``, where the wall bears elements twice as long as asked for, or four times,
    fTetWild makes those, and each is cut into eight, its new boundary nodes on the smooth surfaces (:func:`refine`).
    The result is checked; a run that fails, or misses the quality asked for or a limit on the shapes of elements, is
    repeated with other parameters, at last without refinement. fTetWild is not deterministic: two runs give different
    meshes.

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
    limits : CheckOptions, optional
        What the mesh will be judged by, of which the shapes of elements matter here; the defaults if not given.
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
        An option is out of range, or the edge length more than 1.2 times as long as the wall is thick.
    ResourceError
        The mesh would need more memory than the limit.
    StageError
        Every attempt crashed, ran out of time or gave a wrong mesh.
    DiskFullError
        The folder for temporary files is full.

    References
    ----------
    .. [1] Hu et al., Fast tetrahedral meshing in the wild, ACM Trans. Graph. 39(4), 2020.
       doi:10.1145/3386569.3392385

    Examples
    --------
    >>> fp.tetrahedralize(wall, edge_length=5.0)  # doctest: +SKIP
    VolumeMesh(... points, ... tetra, ... facets: lv, endo, epi, base)
    """
    settings = choose(VolumeOptions, options, changes)
    check_fillable(wall)
    filling = Filling(wall, blood)
    field = sizing_field(wall, settings, sizing, filling.outer)
    size = filling.outer.volume / wall.volume
    thickness = measured_thickness(wall)
    levels = levels_of(settings, thickness, field)
    if field is None:
        need = check_edge_length(wall, settings, size, levels)
    else:
        need = check_sizing(field, settings, size, levels=levels)
    sizes = Sizes(filling, settings, thickness, field)
    if need.seconds > settings.time_limit:
        _log.warning(
            "about %.2g elements will take about %.0f s, longer than the time limit of %g s",
            *(need.elements, need.seconds, settings.time_limit),
        )
    report = progress or (lambda stage, fraction: None)
    held = (limits or CheckOptions()).resolved("tetwild")
    best, records = best_of_runs(filling, settings, held, sizes, need, levels, report)
    report("volume", 1.0)
    info = {
        "mesher": f"fTetWild through pytetwild {_version('pytetwild')}",
        "deterministic": False,
        "quality": settings.quality,
        "estimate": {"elements": need.elements, "gigabytes": need.gigabytes, "seconds": need.seconds},
        "attempts": [one.model_dump(mode="json", exclude_none=True) for one in records],
        "quality_reached": best.reached,
    }
    info = noted({**info, **best.mesh.info}, *attempt_notices(records, best.reached, best.undone))
    mesh = replace(best.mesh, info=info)
    if settings.elements_through_wall is not None:
        mesh = replace(mesh, info=_through(mesh, settings.elements_through_wall))
    return quadratic_tetrahedra(mesh, wall) if settings.order == 2 else mesh


def _through(mesh: VolumeMesh, asked: int) -> dict[str, Any]:
    """The mesh's info with elements through the wall, asked for and measured; told where too few nodes have as many."""
    count = elements_through_wall(mesh)
    share = float((count >= asked).mean())
    found = {
        "asked": asked,
        "share_of_nodes": share,
        "minimum": int(count.min()),
        "median": float(np.median(count)),
        "maximum": int(count.max()),
    }
    info = {**mesh.info, "elements_through_wall": found}
    if share >= _THROUGH_SHARE:
        return info
    line = (
        f"{asked} elements through the wall were asked for, {100 * share:.0f} % of the endocardial nodes have them "
        f"(least {found['minimum']}, median {found['median']:g})"
    )
    _log.warning(line)
    return noted(info, Notice.of("not reached", line, amount=100.0 * share, unit="%"))


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"
