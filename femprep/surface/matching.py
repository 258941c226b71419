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

from femprep.errors import StageError
from femprep.geometry.patches import PatchSurface
from femprep.model import FloatArray, IntArray, Plane, Surface
from femprep.options import SweepOptions, choose
from femprep.surface.apart import push_apart
from femprep.surface.axial import Axial
from femprep.surface.denser import denser
from femprep.surface.refine import refine, scatter
from femprep.surface.resolution import HEIGHT, coarser, corners_of, make_cup, resolution
from femprep.surface.sliding import colour, judge, slide
from femprep.template.cup import Cup
from femprep.template.matched import MatchedSurfaces

_log = logging.getLogger(__name__)

#: Sweeps: on the coarsest cup, between, and on the finest.
_SWEEPS: Final = (40, 12, 6)
#: A layer is at least this share of an edge high: where the wall is thinner, the epicardium is pushed outwards.
_THIN: Final = 0.2
#: A sweep that moves no vertex by more than this share of an edge is the last.
_SETTLED: Final = 0.02
#: Cells with a greater inverse mean ratio than this are mended alone, with so many rings of cells around them, in so
#: many rounds of so many sweeps.
_BAD: Final = 2.0
_RINGS: Final = 2
_ROUNDS: Final = 5
_LOCAL: Final = 10


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
    StageError
        Elements between the surfaces remain folded.
    """
    chosen = choose(SweepOptions, options, changes)
    tell = progress or (lambda stage, fraction: None)
    tell("match", 0.0)
    corners = corners_of(chosen)
    axial = Axial.of(endo, base, apex, np.asarray(chosen.toward))
    columns, rows, layers = resolution(axial, endo, epi, chosen, corners, apex is not None)
    sparse = len(endo.points), len(epi.points)
    endo, epi = denser(endo), denser(epi)
    least = max(chosen.minimum_thickness, _THIN * chosen.edge_length * layers)
    pushed, push = push_apart(endo, epi, base, least, chosen.maximum_push)
    surfaces = (PatchSurface(endo.points, endo.triangles), PatchSurface(pushed, epi.triangles))
    planes = {"base": base} if apex is None else {"base": base, "apex": apex}
    table = np.array([[*plane.normal, plane.offset] for plane in planes.values()])
    tell("match", 0.2)

    clouds = [
        axial.cloud(s.points, t, n) for s, t, n in zip(surfaces, (endo.triangles, epi.triangles), sparse, strict=True)
    ]
    levels = [make_cup(c, r, corners, apex is not None) for c, r in coarser(columns, rows, corners, apex is not None)]
    positions = [scatter(disk, points, levels[0].disk) for disk, points in clouds]
    state = _State(surfaces, table)
    sweeps = []
    for number, cup in enumerate(levels):
        if number:
            positions = [refine(levels[number - 1], p, cup) for p in positions]
        most = _SWEEPS[0] if number == 0 else _SWEEPS[2] if number == len(levels) - 1 else _SWEEPS[1]
        edges = chosen.edge_length * columns / cup.columns
        positions, made = state.relax(cup, positions, edges, layers * cup.columns / columns, most)
        sweeps.append(made)
        tell("match", 0.3 + 0.7 * (number + 1) / len(levels))
    cup = levels[-1]
    inner, outer = positions
    quality = _require_unfolded(cup, inner, outer, layers)
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
        "least_mean_ratio": quality,
        "pushed": push,
        "levels": [level.columns for level in levels],
        "sweeps": sweeps,
    }
    return MatchedSurfaces(cup, inner, outer, layers, *surfaces, planes, info)


class _State:
    """The surfaces and planes the vertices slide on."""

    def __init__(self, surfaces: tuple[PatchSurface, PatchSurface], planes: FloatArray) -> None:
        self.surfaces, self.planes = surfaces, planes

    def relax(
        self, cup: Cup, positions: list[FloatArray], edge: float, layers: float, most: int
    ) -> tuple[list[FloatArray], int]:
        """Slide all vertices until they settle; returns positions and the number of sweeps."""
        corners = cup.cells.shape[1]
        flat = cup.rim
        settled = [s.settle(p, None, flat, self.planes) for s, p in zip(self.surfaces, positions)]
        places = [s[0] for s in settled]
        normals, near = [s[1] for s in settled], [s[2] for s in settled]
        starts, incident = _incidence(cup.cells, len(cup.disk))
        order, colours = _colours(cup.cells, len(cup.disk))
        cells = np.ascontiguousarray(cup.cells)
        worst = np.empty(len(cells))
        moved = np.zeros(len(cup.disk))
        typical = edge * edge * float(np.linalg.norm(places[1] - places[0], axis=1).mean()) / layers

        def once(order: IntArray, colours: IntArray, delta: float, steep: bool) -> float:
            moved[:] = 0.0
            slide(
                *places,
                *normals,
                *near,
                flat,
                self.planes,
                self.surfaces[0].arrays,
                self.surfaces[1].arrays,
                cells,
                starts,
                incident,
                order,
                colours,
                layers,
                HEIGHT[corners],
                delta,
                steep,
                edge,
                moved,
            )
            judge(*places, cells, layers, HEIGHT[corners], worst)
            return float(moved.max())

        judge(*places, cells, layers, HEIGHT[corners], worst)
        made, share, far = 0, 0.1, np.inf
        while made < most and far > _SETTLED * edge:
            folded = not np.all(np.isfinite(worst))
            step = once(order, colours, share * typical if folded else 0.0, False)
            far = np.inf if folded else step
            share = max(0.7 * share, 1e-4)
            made += 1
        # What is still bad lies in few places: more sweeps there alone.
        for _ in range(_ROUNDS):
            active = np.zeros(len(cup.disk), dtype=bool)
            active[cells[worst > _BAD]] = True
            if not active.any():
                break
            for _ in range(_RINGS):
                active[cells[active[cells].any(axis=1)]] = True
            part = order[active[order]]
            bounds = np.concatenate([[0], np.cumsum(active[order])])[colours]
            for _ in range(_LOCAL):
                folded = not np.all(np.isfinite(worst))
                if once(part, bounds, share * typical if folded else 0.0, True) < 0.1 * _SETTLED * edge and not folded:
                    break
        return places, made


def _incidence(cells: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Cells around each vertex, as row starts and columns."""
    order = np.argsort(cells.ravel(), kind="stable")
    starts = np.searchsorted(cells.ravel()[order], np.arange(count + 1))
    return starts.astype(np.int64), (order // cells.shape[1]).astype(np.int64)


def _colours(cells: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Vertices ordered by colour, and where each colour starts; vertices of one colour share no cell."""
    corners = cells.shape[1]
    pairs = np.concatenate([cells[:, [i, j]] for i in range(corners) for j in range(corners) if i != j])
    pairs = np.unique(pairs, axis=0)
    starts = np.searchsorted(pairs[:, 0], np.arange(count + 1)).astype(np.int64)
    found = np.empty(count, dtype=np.int64)
    number = colour(starts, np.ascontiguousarray(pairs[:, 1]), found)
    order = np.argsort(found, kind="stable").astype(np.int64)
    return order, np.searchsorted(found[order], np.arange(number + 1)).astype(np.int64)


def _require_unfolded(cup: Cup, inner: FloatArray, outer: FloatArray, layers: int) -> float:
    """Least mean ratio of the elements' corners; an error where one is folded."""
    corners = cup.cells.shape[1]
    worst = np.empty(len(cup.cells))
    judge(inner, outer, np.ascontiguousarray(cup.cells), float(layers), HEIGHT[corners], worst)
    folded = np.flatnonzero(~np.isfinite(worst))
    if len(folded):
        where = 0.5 * (inner + outer)[cup.cells[folded[0]]].mean(axis=0)
        raise StageError(
            f"{len(folded)} of {len(cup.cells)} columns of elements between the surfaces remain folded, one near "
            f"{np.round(where, 1).tolist()} (mm LPS); try a longer edge length, or the mesher tetwild"
        )
    return float(1.0 / worst.max())
