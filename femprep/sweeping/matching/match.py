"""Endocardium and epicardium in, both on one cup out: a map from one to the other whose lines do not cross.

Equal numbers of vertices are not a map. Here both surfaces are seen from the long axis: every point lies on a ray from
it, level with the base in the upper part, spreading from a centre in the apex, and a ray meets both surfaces. That
gives a cup on each, with rims in the planes. Then the vertices slide along their surfaces to where the elements between
them are best, on a coarse cup first and on finer ones from there. Where the surfaces bend too sharply for any elements
between them, mended ones too, as at the ledge that a shifted slice leaves, they are softened, and that is told.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np

from femprep.mesh.patches import PatchSurface
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import BoolArray, FloatArray, Notice, Plane, Progress, Surface, records
from femprep.model.surface import require_cells
from femprep.options import SweepOptions, choose, takes
from femprep.surface.fitting.patches import patches_of
from femprep.sweeping.cup.matched import MatchedSurfaces
from femprep.sweeping.elements.lay import lay
from femprep.sweeping.elements.mend import worst_columns
from femprep.sweeping.matching.axial import Axial
from femprep.sweeping.matching.cups import Cups
from femprep.sweeping.matching.minimum_thickness import push_outwards
from femprep.sweeping.matching.relax import Relaxation
from femprep.sweeping.matching.resolution import coarser, corners_of, make_cup, resolution
from femprep.sweeping.matching.soften import soften

_log = logging.getLogger(__name__)

#: A layer is at least this share of an edge high: where the wall is thinner, the epicardium is pushed outwards.
_THIN: Final = 0.1
#: Where mended columns have a greater inverse mean ratio than this, surfaces are softened within so many edges of them,
#: so often at most.
_BENT: Final = 3.0
_REACH: Final = 3.0
_TRIES: Final = 10


@takes(SweepOptions)
def match_surfaces(
    *,
    endo: Surface,
    epi: Surface,
    base: Plane,
    apex: Plane | None = None,
    options: SweepOptions | None = None,
    progress: Progress | None = None,
    **changes: Any,
) -> MatchedSurfaces:
    """Put endocardium and epicardium onto one cup, so that straight lines join their vertices without crossing.

    Parameters
    ----------
    endo, epi : Surface
        Closed, the endocardium inside the epicardium.
    base, apex : Plane
        Where the wall ends; what lies on the side of the normal is cut away. Without an apex plane the wall is closed
        at the apex.
    options, **changes
        :class:`~femprep.options.SweepOptions`.
    progress : callable, optional
        Called with ``("match", fraction)``.

    Returns
    -------
    MatchedSurfaces
        ``info`` tells the resolution, thickness (mm), how far the epicardium was pushed and surfaces were softened, the
        sweeps made.

    Raises
    ------
    InputError
        A plane does not cut a surface, or the wall is thinner than can be mended.
    OptionError
        Element and template do not go together, or a number of columns does not fit the template.

    Examples
    --------
    >>> matched = fp.match_surfaces(endo=endo, epi=epi, base=fp.find_base(seg), edge_length=8.0)
    >>> matched.layers
    1
    """
    chosen = choose(SweepOptions, options, changes)
    require_cells(endo)
    require_cells(epi)
    tell = progress or (lambda stage, fraction: None)
    tell("match", 0.0)
    corners = corners_of(chosen)
    axial = Axial.of(endo, base, apex, np.asarray(chosen.toward or (1.0, 0.0, 0.0)))
    columns, rows, layers = resolution(axial, endo, epi, chosen, corners, apex is not None)
    planes = {"base": base} if apex is None else {"base": base, "apex": apex}
    levels = [make_cup(c, r, corners, apex is not None) for c, r in coarser(columns, rows, corners, apex is not None)]
    cups = Cups(axial, planes, levels, layers, chosen)
    least = max(chosen.minimum_thickness, _THIN * chosen.edge_length * layers)
    tell("match", 0.2)

    def match(inside: PatchSurface, outside: PatchSurface) -> _Match:
        inner = Surface(inside.points, inside.triangles, name=endo.name)
        outer = Surface(outside.points, outside.triangles, name=epi.name)
        points, push = push_outwards(inner, outer, base, least, chosen.maximum_push)
        if push["vertices"]:
            outside = PatchSurface(points, outside.triangles)
        state, sweeps = cups.match((inside, outside), lambda share: tell("match", 0.3 + 0.7 * share))
        bent = state.worst > _BENT
        if bent.any():
            # Whatever no straight lines can fill the mending of the layers may.
            ends = state.places
            trial = MatchedSurfaces(levels[-1], ends[0], ends[1], layers, state.growth, inside, outside, planes)
            bent = worst_columns(lay(trial, chosen)[0], trial, chosen.element) > _BENT
        return _Match((inside, outside), state, sweeps, push, bent)

    first = last = best = match(patches_of(endo), patches_of(epi))
    for _ in range(_TRIES):
        if not last.bent.any():
            break
        last = match(*last.softened(_REACH * chosen.edge_length, planes))
        best = min(best, last, key=lambda found: np.count_nonzero(found.bent))
    state, cup = best.state, levels[-1]
    inner, outer = state.places
    push = max(first.push, best.push, key=lambda pushed: pushed["maximum_mm"])
    away, at = 0.0, None
    if best is not first:
        found = map(partial(_distance, planes=planes), best.surfaces, first.surfaces)
        away, at = max(found, key=lambda one: one[0])
    folded = int(np.count_nonzero(~np.isfinite(state.worst)))
    if folded:
        _log.info("%d of %d straight columns are folded; the sweep has to bend them", folded, len(state.worst))
    thickness = np.linalg.norm(outer - inner, axis=1)
    info = {
        "template": "triangle" if corners == 3 else "quad",
        "columns": cup.columns,
        "rows": cup.rows,
        "layers": layers,
        "vertices": len(cup.disk),
        "thickness_mm": {
            "minimum": float(thickness.min()),
            "mean": float(thickness.mean()),
            "maximum": float(thickness.max()),
        },
        "least_mean_ratio": 0.0 if folded else float(1.0 / state.worst.max()),
        "folded_columns": folded,
        "pushed": push,
        "softened_mm": away,
        "levels": [level.columns for level in levels],
        "sweeps": best.sweeps,
        "notices": records(*_notices(push, away, at)),
    }
    return MatchedSurfaces(cup, inner, outer, layers, state.growth, *best.surfaces, planes, info)


@dataclass(frozen=True, eq=False)
class _Match:
    """Both surfaces, a cup's vertices on them, the sweeps made, how far the outer surface was pushed for it.

    And the columns ``(T,)`` that stay so poor, mended, that the surfaces themselves must bend too sharply there.
    """

    surfaces: tuple[PatchSurface, PatchSurface]
    state: Relaxation
    sweeps: list[int]
    push: dict[str, Any]
    bent: BoolArray

    def softened(self, reach: float, planes: Mapping[str, Plane]) -> list[PatchSurface]:
        """The surfaces, softened within a distance of such columns, mm."""
        nodes = self.state.cup.cells[self.bent].ravel()
        return [soften(s, p[nodes], reach, planes.values()) for s, p in zip(self.surfaces, self.state.places)]


def _distance(surface: PatchSurface, other: PatchSurface, planes: Mapping[str, Plane]) -> tuple[float, FloatArray]:
    """How far a surface lies from another one between the planes, at most, mm, and where."""
    within = np.all([plane.signed_distance(surface.points) < 0.0 for plane in planes.values()], axis=0)
    points = surface.points[within]
    feet = ClosestFinder(other.points, other.triangles)(points).points
    away = np.linalg.norm(feet - points, axis=1)
    worst = int(away.argmax())
    return float(away[worst]), points[worst]


def _notices(push: Mapping[str, Any], softened: float, at: FloatArray | None) -> list[Notice]:
    """What was done to the surfaces for the sake of the elements between them."""
    found = []
    if push["vertices"]:
        words = (
            "the wall is too thin for its layers of elements: the epicardium was pushed outwards by up to {amount} to "
            f"lie {push['least_mm']:g} mm from the endocardium"
        )
        found.append(Notice.of("repaired", words, amount=push["maximum_mm"], unit="mm", place=push.get("worst_at_mm")))
    if softened:
        words = "the surfaces bend too sharply for layers of elements: there they were softened by up to {amount}"
        found.append(Notice.of("repaired", words, amount=softened, unit="mm", place=at))
    return found
