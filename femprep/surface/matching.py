"""Endocardium and epicardium in, both on one cup out: a map from one to the other whose lines do not cross.

Equal numbers of vertices are not a map. Here both surfaces are seen from the long axis: every point lies on a ray from
it, level with the base in the upper part, spreading from a centre in the apex, and a ray meets both surfaces. That
gives a cup on each, with rims in the planes. Then the vertices slide along their surfaces to where the elements between
them are best, on a coarse cup first and on finer ones from there.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from femprep.geometry.patches import PatchSurface
from femprep.model import Plane, Surface
from femprep.options import SweepOptions, choose
from femprep.surface.apart import push_apart
from femprep.surface.axial import Axial
from femprep.surface.patches import patches_of
from femprep.surface.refine import refine, scatter
from femprep.surface.relax import Relaxation
from femprep.surface.resolution import HEIGHT, coarser, corners_of, make_cup, resolution
from femprep.template.matched import MatchedSurfaces

_log = logging.getLogger(__name__)

#: Sweeps: on the coarsest cup, between, and on the finest.
_SWEEPS: Final = (40, 12, 6)
#: A layer is at least this share of an edge high: where the wall is thinner, the epicardium is pushed outwards.
_THIN: Final = 0.2


def match_surfaces(
    *,
    endo: Surface,
    epi: Surface,
    base: Plane,
    apex: Plane | None = None,
    options: SweepOptions | None = None,
    progress: Callable[[str, float], None] | None = None,
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
        ``info`` tells the resolution, thickness (mm), how far the epicardium was pushed, the sweeps made.

    Raises
    ------
    InputError
        A plane does not cut a surface, or the wall is thinner than can be mended.
    OptionError
        Element and template do not go together, or a number of columns does not fit the template.
    """
    chosen = choose(SweepOptions, options, changes)
    tell = progress or (lambda stage, fraction: None)
    tell("match", 0.0)
    corners = corners_of(chosen)
    axial = Axial.of(endo, base, apex, np.asarray(chosen.toward or (1.0, 0.0, 0.0)))
    columns, rows, layers = resolution(axial, endo, epi, chosen, corners, apex is not None)
    inside, outside = patches_of(endo), patches_of(epi)
    least = max(chosen.minimum_thickness, _THIN * chosen.edge_length * layers)
    pushed, push = push_apart(
        Surface(inside.points, inside.triangles, name=endo.name),
        Surface(outside.points, outside.triangles, name=epi.name),
        base,
        least,
        chosen.maximum_push,
    )
    if push["vertices"]:
        outside = PatchSurface(pushed, outside.triangles)
    surfaces = (inside, outside)
    planes = {"base": base} if apex is None else {"base": base, "apex": apex}
    table = np.array([[*plane.normal, plane.offset] for plane in planes.values()])
    tell("match", 0.2)

    clouds = [axial.cloud(s.points, s.triangles) for s in surfaces]
    levels = [make_cup(c, r, corners, apex is not None) for c, r in coarser(columns, rows, corners, apex is not None)]
    positions = [scatter(disk, points, levels[0].disk) for disk, points in clouds]
    sweeps = []
    for number, cup in enumerate(levels):
        if number:
            positions = [refine(levels[number - 1], p, cup) for p in positions]
        last = number == len(levels) - 1
        thin = layers if last else max(round(layers * cup.columns / columns), 1)
        height = HEIGHT[corners] * layers * cup.columns / columns / thin
        edge = chosen.edge_length * columns / cup.columns
        state = Relaxation(
            cup, surfaces, table, height, last and chosen.element == "tetra", thin, edge, chosen.grading, positions
        )
        sweeps.append(state.run(_SWEEPS[0] if number == 0 else _SWEEPS[2] if last else _SWEEPS[1]))
        positions = state.places
        tell("match", 0.3 + 0.7 * (number + 1) / len(levels))
    inner, outer = positions
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
        "levels": [level.columns for level in levels],
        "sweeps": sweeps,
    }
    return MatchedSurfaces(cup, inner, outer, layers, state.growth, *surfaces, planes, info)
