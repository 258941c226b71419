"""Vertices of a cup on two surfaces in, moved along them out: well-shaped elements between."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from femprep.mesh.patches import PatchSurface
from femprep.mesh.stars import coloured, each_colour, stars
from femprep.model import FloatArray, IntArray
from femprep.sweeping.cup.cup import Cup
from femprep.sweeping.cup.followed_points import FollowedPoints, pulls
from femprep.sweeping.cup.layers import layer_depths
from femprep.sweeping.cup.simplices import Simplices, corners, tetrahedra
from femprep.sweeping.elements.mean_ratio import inverse_mean_ratio
from femprep.sweeping.matching.vertex_newton import slide

#: A vertex that moves by no more than this share of an edge, as its neighbours, rests.
_SETTLED: Final = 0.02
#: Columns with a greater inverse mean ratio than this are mended alone, with so many rings of cells around them, in
#: so many rounds of so many sweeps.
_BAD: Final = 2.0
_RINGS: Final = 2
_ROUNDS: Final = 5
_LOCAL: Final = 10
#: Where the wall is thin, elements are allowed to be as low as this share of the best height.
_LOW: Final = 0.2
#: The elements of so many layers, spread over the wall, are looked at.
_LAYERS: Final = 3
#: Widths of elements outside and inside differ by this factor at most where layers follow them.
_GROWTH: Final = 3.0


@dataclass
class Relaxation:
    """Vertices of a cup on two surfaces, and what moves them.

    Attributes
    ----------
    cup : Cup
    surfaces : tuple of PatchSurface
        Inner and outer.
    planes : (p, 4) array
        Normal and offset of each plane.
    height : float
        Best height of an element over its side.
    split : bool
        Whether elements are tetrahedra.
    layers : int
    edge : float
        Edge length of the elements, mm.
    grading : float or None
        Height of the last layer over the first; None: as wide elements need.
    places : list of two (V, 3) arrays
        Where the vertices are; moved in place.
    """

    cup: Cup
    surfaces: tuple[PatchSurface, PatchSurface]
    planes: FloatArray
    height: float
    split: bool
    layers: int
    edge: float
    grading: float | None
    places: list[FloatArray]
    worst: FloatArray = field(init=False)
    growth: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        cells, count = np.ascontiguousarray(self.cup.cells), len(self.cup.disk)
        settled = [s.settle(p, None, self.cup.rim, self.planes) for s, p in zip(self.surfaces, self.places)]
        self.places = [s[0] for s in settled]
        self._normals, self._near = tuple(s[1] for s in settled), tuple(s[2] for s in settled)
        self._followed = [FollowedPoints(s, self.planes) for s in self.surfaces]
        self._mesh = (cells, *stars(cells, count))
        self._neighbours = _neighbours(cells)
        self._order, self._colours = coloured(*self._mesh, np.arange(count))
        self._shown = np.unique(np.round(np.linspace(0, self.layers - 1, _LAYERS)).astype(np.int64))
        self._frames = corners(cells, np.full(len(cells), self.height))
        self._follow(self._frames)

    @property
    def folded(self) -> bool:
        """Whether an element is inverted."""
        return not bool(np.all(np.isfinite(self.worst)))

    def run(self, most: int) -> int:
        """Slide all vertices until they settle, then those of poor elements alone; returns the number of sweeps."""
        typical = self.edge**2 * float(np.linalg.norm(self.places[1] - self.places[0], axis=1).mean()) / self.layers
        made, share = 0, 0.1
        active = np.ones(len(self.cup.disk), dtype=bool)
        while made < most and active.any():
            folded = self.folded
            moved = self._sweep(active, share * typical if folded else 0.0, self._frames, False)
            share = max(0.7 * share, 1e-4)
            active = moved > _SETTLED * self.edge
            one, two = self._neighbours.T
            active[one[active[two]]] = True
            if folded:
                active[:] = True
            made += 1
        # Tetrahedra alone would be best on slanted lines; so all are moved for upright columns, and few for tetrahedra.
        elements = (
            tetrahedra(self.cup.cells, len(self.cup.disk)) if self.split else corners(self.cup.cells, self._low())
        )
        self._follow(elements)
        # What is still bad lies in few places: more sweeps there alone.
        cells = self.cup.cells
        for _ in range(_ROUNDS):
            active = np.zeros(len(self.cup.disk), dtype=bool)
            active[cells[self.worst > _BAD]] = True
            if not active.any():
                break
            for _ in range(_RINGS):
                active[cells[active[cells].any(axis=1)]] = True
            for _ in range(_LOCAL):
                folded = self.folded
                moved = self._sweep(active, share * typical if folded else 0.0, elements, True)
                if moved.max() < 0.1 * _SETTLED * self.edge and not folded:
                    break
        self._follow(elements if self.split else self._frames)
        return made

    def _low(self) -> FloatArray:
        """Height of the elements over their side ``(T,)`` where the wall is thin, else the best one.

        There no vertex can make them higher, but it can keep them upright.
        """
        cells = self.cup.cells
        lines = np.linalg.norm(self.places[1] - self.places[0], axis=1)[cells].mean(axis=1) / self.layers
        middle = 0.5 * (self.places[0] + self.places[1])
        side = np.linalg.norm(middle[cells] - middle[np.roll(cells, 1, axis=1)], axis=2).mean(axis=1)
        return np.asarray(np.clip(lines / side, _LOW * self.height, self.height))

    def _sweep(self, active: np.ndarray[Any, Any], delta: float, judged: Simplices, steep: bool) -> FloatArray:
        """One sweep over some vertices, steep where the worst counts most; returns how far each moved."""
        moved = np.zeros(len(active))
        missed = [s.missed(p, self.cup.cells, self.edge) for s, p in zip(self._followed, self.places)]
        part = self._order[active[self._order]]
        bounds = np.concatenate([[0], np.cumsum(active[self._order])])[self._colours]
        pulled = [pulls(m, len(active), self.edge, steep) for m in missed]
        for order in each_colour((part, bounds)):
            slide(
                len(order),
                (*self.places, self._depth),
                self._normals,
                self._near,
                self.cup.rim,
                self.planes,
                self.surfaces[0].arrays,
                self.surfaces[1].arrays,
                self._mesh,
                tuple(judged),
                *pulled,
                self._shown,
                order,
                delta,
                steep,
                self.edge,
                moved,
            )
        self._follow(judged)
        return moved

    def _follow(self, judged: Simplices) -> None:
        """Let layers follow the widths of the elements, and judge these."""
        one, two = self._neighbours.T
        widths = [np.bincount(one, np.linalg.norm(p[one] - p[two], axis=1), len(self.cup.disk)) for p in self.places]
        growth = np.clip(widths[1] / widths[0], 1.0 / _GROWTH, _GROWTH)
        degree = np.bincount(one, minlength=len(growth))
        # Neighbouring lines are divided alike, or layers would be rough.
        for _ in range(2):
            growth = 0.5 * growth + 0.5 * np.bincount(one, growth[two], len(growth)) / degree
        self.growth = growth
        self._depth = layer_depths(self.layers, growth, self.grading)
        inner, outer = self.places
        nodes = inner + self._depth[:, :, None] * (outer - inner)
        self.worst = inverse_mean_ratio(nodes, self._mesh[0], judged, self._shown).max(axis=0)


def _neighbours(cells: IntArray) -> IntArray:
    """Pairs of vertices that share a cell, ``(e, 2)``, both ways, sorted."""
    corners = cells.shape[1]
    pairs = np.concatenate([cells[:, [i, j]] for i in range(corners) for j in range(corners) if i != j])
    return np.unique(pairs, axis=0)
