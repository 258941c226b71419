"""A fine mesh on a smooth surface in, an even one with exactly so many vertices out: short edges collapsed in turn."""

from __future__ import annotations

from typing import Any, Final, Protocol

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.mesh.energies.simplex import sides_and_normal
from femprep.mesh.measures.triangles import areas
from femprep.mesh.operations.flips import flip_edges
from femprep.mesh.operations.tangential_smoothing import smooth_tangentially
from femprep.mesh.topology import edge_table
from femprep.model import FloatArray, IntArray

#: Share of the vertices that go in one pass, and how many of the shortest edges are looked at for each of them.
_SHARE: Final = 0.1
_LOOKED_AT: Final = 4
#: Passes of spreading vertices along the surface after each, and what areas count beside shapes where edges flip.
_SPREAD: Final = 3
_SIZE: Final = 0.1
#: Fewest and most edges at a vertex, least Q of a triangle, and least cosine between its normal and the surface's.
_DEGREES: Final = (4, 9)
_POOR: Final = 0.1
_UPRIGHT: Final = 0.2


class Ground(Protocol):
    """What vertices stay on: a smooth surface, or a mesh's own facets."""

    def settle(self, queries: FloatArray, near: IntArray | None = None) -> tuple[FloatArray, FloatArray, IntArray]:
        """Feet of points near it, unit normals there, and the piece of it each lies in."""
        ...


def collapsed(
    points: FloatArray, cells: IntArray, surface: Ground, count: int
) -> tuple[FloatArray, FloatArray, IntArray, IntArray] | None:
    """Collapse the shortest edges of a mesh, evening it out on the way, until it has ``count`` vertices.

    Parameters
    ----------
    points : (n, 3) array
        Vertices on or near the surface, more than ``count``, mm.
    cells : (m, 3) array
        Triangles of a closed mesh, wound outward.
    surface : Ground
        What the vertices stay on.
    count : int

    Returns
    -------
    points, normals : (count, 3) arrays
        Vertices, and the surface's unit normals there.
    near : (count,) array
        The surface's vertex nearest to each, on the same side of a thin body.
    cells : (2 count - 4, 3) array
        Or None where no more edges can be collapsed without folding triangles.
    """
    points, normals, near = surface.settle(points)
    while len(points) > count:
        most = min(len(points) - count, int(np.ceil(_SHARE * len(points))))
        target = _one_pass(points, normals, cells, most)
        kept = target == np.arange(len(points))
        if kept.all():
            return None
        cells = target[cells]
        whole = (cells != np.roll(cells, 1, axis=1)).all(axis=1)
        cells = (np.cumsum(kept) - 1)[cells[whole]]
        points, normals, near = points[kept], normals[kept], near[kept]
        area = np.full(len(points), areas(points, cells).mean())
        cells = flip_edges(points, normals, cells, area, _SIZE)[0]
        points, normals, near = surface.settle(smooth_tangentially(points, cells, _SPREAD), near)
    return points, normals, near, cells


def _one_pass(points: FloatArray, normals: FloatArray, cells: IntArray, most: int) -> IntArray:
    """Into which vertex each goes ``(n,)``, at most ``most`` of them into another than itself."""
    table = edge_table(cells)
    length = np.linalg.norm(points[table.nodes[:, 1]] - points[table.nodes[:, 0]], axis=1)
    order = np.argsort(length, kind="stable")
    around = np.argsort(cells.ravel(), kind="stable")
    starts = np.searchsorted(cells.ravel()[around], np.arange(len(points) + 1))
    fan = np.stack([around // 3, around % 3], axis=1)
    target = np.arange(len(points))
    for looked_at in (_LOOKED_AT * most, len(order)):
        nodes = np.ascontiguousarray(table.nodes[order[:looked_at]])
        if _collapse(points, normals, cells, starts, fan, nodes, most, target):
            break
    return target


@compiled(writes="target")
def _collapse(points: Any, normals: Any, cells: Any, starts: Any, fan: Any, nodes: Any, most: int, target: Any) -> int:
    """Collapse edges in their order, each towards the end that leaves better triangles, none near another."""
    used = np.zeros(len(points), dtype=np.bool_)
    made = 0
    for e in range(len(nodes)):
        if made == most:
            break
        best = _POOR
        keep = drop = -1
        for side in range(2):
            k = nodes[e, side]
            d = nodes[e, 1 - side]
            worst = _worst(points, normals, cells, starts, fan, k, d, used)
            if worst > best:
                best = worst
                keep = k
                drop = d
        if keep < 0:
            continue
        for v in (keep, drop):
            for s in range(starts[v], starts[v + 1]):
                for i in range(3):
                    used[cells[fan[s, 0], i]] = True
        target[drop] = keep
        made += 1
    return made


@compiled(part=True)
def _worst(points: Any, normals: Any, cells: Any, starts: Any, fan: Any, keep: int, drop: int, used: Any) -> float:
    """Least Q of the triangles when one vertex goes into another; -1 where the mesh would fold or be none."""
    if starts[keep + 1] - starts[keep] + starts[drop + 1] - starts[drop] - 4 > _DEGREES[1]:
        return -1.0
    worst = 1.0
    common = 0
    up = np.empty(3)
    for s in range(starts[drop], starts[drop + 1]):
        t = fan[s, 0]
        i = fan[s, 1]
        v = cells[t, (i + 1) % 3]
        w = cells[t, (i + 2) % 3]
        if used[v] or used[w] or used[drop]:
            return -1.0
        if v != keep:
            # Each neighbour comes first in one triangle; both ends may share those beside the edge only.
            for r in range(starts[keep], starts[keep + 1]):
                if cells[fan[r, 0], (fan[r, 1] + 1) % 3] == v:
                    common += 1
                    if starts[v + 1] - starts[v] <= _DEGREES[0]:
                        return -1.0
        if v == keep or w == keep:
            continue
        for k in range(3):
            up[k] = normals[keep, k] + normals[v, k] + normals[w, k]
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = sides_and_normal(points, keep, v, w)
        double = np.sqrt(cx * cx + cy * cy + cz * cz)
        steep = np.sqrt(up[0] * up[0] + up[1] * up[1] + up[2] * up[2])
        if not cx * up[0] + cy * up[1] + cz * up[2] > _UPRIGHT * double * steep:
            return -1.0
        dx = bx - ax
        dy = by - ay
        dz = bz - az
        sides = ax * ax + ay * ay + az * az + bx * bx + by * by + bz * bz + dx * dx + dy * dy + dz * dz
        worst = min(worst, 2.0 * np.sqrt(3.0) * double / sides)
    return worst if common == 2 else -1.0
