"""A layered mesh in, its poor elements mended out: their nodes and those around them moved, also inside the wall.

Lines from surface to surface that are straight cannot unfold every wall: where slices are shifted or the wall is
pinched, the nodes between have to leave them. Surfaces, planes, tags and connectivity stay as they are.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from femprep.mesh.patches import plane_table
from femprep.mesh.stars import stars
from femprep.model import BoolArray, FloatArray, IntArray, Notice, records
from femprep.sweeping.cup.followed_points import FollowedPoints, Pulls, pulls
from femprep.sweeping.cup.matched import MatchedSurfaces
from femprep.sweeping.cup.simplices import Simplices, corners, tetrahedra
from femprep.sweeping.elements.mean_ratio import inverse_mean_ratio
from femprep.sweeping.elements.nodes import least_determinant, move_nodes

#: Elements with a greater inverse mean ratio than this are mended.
_BAD: Final = 2.0
#: Where more than this share of all exceeds a lower one, as in a wavy wall, the first rounds are for these, for a good
#: mean.
_SHARE: Final = 0.1
_POOR: Final = 1.6
_FIRST: Final = 2
#: Rings of elements around them that move along, rounds, and sweeps in each.
_RINGS: Final = 3
_ROUNDS: Final = 6
_SWEEPS: Final = 12
#: A sweep whose longest move is shorter than this share of an edge is the last of its round.
_SETTLED: Final = 0.005
#: Elements may be as low as this share of the best height, where the wall is thin.
_LOW: Final = 0.2
#: Share of a cube of edges that an element's least determinant is taken as while elements are inverted, and how it
#: falls from round to round: what is small by itself, as near an apex, unfolds last.
_FLAT: Final = 1e-3
_SMALLER: Final = 0.2


def mend(points: FloatArray, matched: MatchedSurfaces, element: str) -> dict[str, Any]:
    """Move nodes around poor elements of a layered mesh, in place.

    Parameters
    ----------
    points : (layers + 1, V, 3) array
        Nodes, mm; moved in place.
    matched : MatchedSurfaces
        What they lie between.
    element : str
        ``"tetra"``, ``"wedge"`` or ``"hexahedron"``: what they are judged by.

    Returns
    -------
    dict
        How many elements were ``poor`` before and are after, nodes ``moved`` and the farthest move, mm; ``notices``.
    """
    layers, count = len(points) - 1, points.shape[1]
    cells = np.ascontiguousarray(matched.cup.cells)
    flatness = matched.cup.rim
    planes = plane_table(matched.planes.values())
    judged = _measured(points, cells, element)
    nodes = points.reshape(-1, 3)
    worst = inverse_mean_ratio(points, cells, judged)
    limits = [_POOR] * _FIRST if np.mean(worst > _POOR) > _SHARE else []
    poor = int(np.count_nonzero(worst > _BAD))
    found: dict[str, Any] = {"poor_before": poor, "poor": poor, "moved": 0, "farthest_mm": 0.0}
    if not poor and not limits:
        return found
    start = nodes.copy()
    surfaces = (matched.inner_surface, matched.outer_surface)
    followed = [FollowedPoints(surface, planes) for surface in surfaces]
    edge = float(np.linalg.norm(points[:, cells[:, 0]] - points[:, cells[:, 1]], axis=2).mean())
    for round_ in range(_ROUNDS):
        limit = limits[round_] if round_ < len(limits) else _BAD
        if not np.any(worst > limit):
            break
        small = _FLAT * _SMALLER**round_ * (edge * edge * edge)
        moving, simplices, kinds = _region(worst > limit, cells, count, judged)
        side = np.select([moving < count, moving >= layers * count], [1, 2], 0)
        normals, near = np.zeros((len(moving), 3)), np.zeros(len(moving), dtype=np.int64)
        for number, surface in enumerate(surfaces, 1):
            rows = side == number
            _, normals[rows], near[rows] = surface.settle(nodes[moving[rows]])
        star = stars(simplices, len(nodes))
        measure = (judged.weights, judged.scale, judged.upright[kinds])
        for _ in range(_SWEEPS):
            least = least_determinant(nodes, simplices)
            delta = np.sqrt(small * (small - least)) if least <= 0.0 else 0.0
            longest = move_nodes(
                *(nodes, moving, star, simplices, measure, side, flatness[moving % count], normals, near, planes),
                *(tuple(s.arrays for s in surfaces), _pulls(followed, points, cells, edge, delta == 0.0), delta, edge),
            )
            if longest < _SETTLED * edge and least > 0.0:
                break
        worst = inverse_mean_ratio(points, cells, judged)
    moved = np.linalg.norm(nodes - start, axis=1)
    found |= {
        "poor": int(np.count_nonzero(worst > _BAD)),
        "moved": int(np.count_nonzero(moved)),
        "farthest_mm": float(moved.max()),
    }
    if moved.any():
        words = (
            f"straight lines from surface to surface gave poor elements: {found['moved']} nodes were moved along the "
            "surfaces and within the wall, by up to {amount}"
        )
        place = start[int(moved.argmax())]
        found["notices"] = records(Notice.of("moved", words, amount=found["farthest_mm"], unit="mm", place=place))
    return found


def worst_columns(points: FloatArray, matched: MatchedSurfaces, element: str) -> FloatArray:
    """Greatest inverse mean ratio of the elements over each cell ``(T,)``; arguments as of :func:`mend`."""
    cells = matched.cup.cells
    return np.asarray(inverse_mean_ratio(points, cells, _measured(points, cells, element)).max(axis=0))


def _pulls(followed: list[FollowedPoints], points: FloatArray, cells: IntArray, edge: float, steep: bool) -> Pulls:
    """What the facets of both surfaces must not pass by."""
    found = []
    for one, layer in zip(followed, (0, len(points) - 1)):
        corners, shares, missed = one.missed(points[layer], cells, edge)
        found.append((corners + layer * points.shape[1], shares, missed))
    return pulls([np.concatenate(parts) for parts in zip(*found)], points.shape[0] * points.shape[1], edge, steep)


def _measured(points: FloatArray, cells: IntArray, element: str) -> Simplices:
    """What elements are judged by; where the wall is thin they may be low, but have to stand upright."""
    if element == "tetra":
        return tetrahedra(cells, points.shape[1])
    layers = len(points) - 1
    lines = np.linalg.norm(np.diff(points, axis=0), axis=2).sum(axis=0)[cells].mean(axis=1) / layers
    middle = points[layers // 2]
    side = np.linalg.norm(middle[cells] - middle[np.roll(cells, 1, axis=1)], axis=2).mean(axis=1)
    return corners(cells, np.clip(lines / side, _LOW, 1.0))


def _region(poor: BoolArray, cells: IntArray, count: int, judged: Simplices) -> tuple[IntArray, IntArray, IntArray]:
    """Nodes to move around poor elements ``(layers, T)``, the simplices that feel them, and the cell of each."""
    layers = len(poor)
    active = np.zeros((layers + 1, count), dtype=bool)
    chosen = poor.copy()
    for ring in range(_RINGS + 1):
        for low in range(layers):
            near = cells[chosen[low]].ravel()
            active[low, near] = active[low + 1, near] = True
        touched = np.stack([active[k][cells].any(axis=1) | active[k + 1][cells].any(axis=1) for k in range(layers)])
        if ring < _RINGS:
            chosen = touched
    layer, cell = np.nonzero(touched)
    prism = np.concatenate([cells[cell] + layer[:, None] * count, cells[cell] + (layer[:, None] + 1) * count], axis=1)
    table = judged.nodes[judged.kinds[cell, layer % 2]]
    simplices = np.take_along_axis(prism[:, None, :], table, axis=2).reshape(-1, 4)
    return np.flatnonzero(active.ravel()), simplices, np.repeat(cell, table.shape[1])
