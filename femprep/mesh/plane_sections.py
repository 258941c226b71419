"""A surface and planes in, the closed contours where they meet out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from femprep.mesh.level_segments import level_segments
from femprep.model import FloatArray, IntArray, Plane


def plane_sections(points: npt.ArrayLike, triangles: npt.ArrayLike, planes: Sequence[Plane]) -> list[list[FloatArray]]:
    """Cut a surface by planes.

    Parameters
    ----------
    points : (n, 3) array
        Vertices, mm.
    triangles : (m, 3) array
        Corner numbers.
    planes : sequence of Plane

    Returns
    -------
    list of list of (k, 3) arrays
        For each plane its contours, mm; the last point of a contour repeats the first where it is closed. A plane
        through a vertex is taken as passing just beyond it, so that contours of a closed surface are always closed.
    """
    p, t = np.asarray(points, dtype=np.float64), np.asarray(triangles, dtype=np.int64)
    out = []
    for plane in planes:
        crossings, segments = level_segments(p, t, plane.signed_distance(p))
        out.append([crossings[chain] for chain in chains(segments, len(crossings))])
    return out


def chains(segments: IntArray, count: int) -> list[IntArray]:
    """Join directed segments ``(k, 2)`` between ``count`` nodes to chains; a closed one ends with its first node.

    Every segment is in one chain; where several leave a node the first comes first.
    """
    order = np.argsort(segments[:, 0], kind="stable")
    first = np.searchsorted(segments[order, 0], np.arange(count + 1))
    free, target = first[:-1].tolist(), segments[order, 1].tolist()
    limit = first[1:].tolist()
    found = []
    # Open chains begin where more segments leave than arrive; what is left afterwards is closed.
    surplus = np.bincount(segments[:, 0], minlength=count) - np.bincount(segments[:, 1], minlength=count)
    for node in [*np.repeat(np.arange(count), np.maximum(surplus, 0)).tolist(), *range(count)]:
        while free[node] < limit[node]:
            chain, here = [node], node
            while free[here] < limit[here]:
                free[here] += 1
                here = target[free[here] - 1]
                chain.append(here)
                if here == node and surplus[node] <= 0:
                    break
            found.append(np.array(chain, dtype=np.int64))
            if surplus[node] > 0:
                break
    return found
