"""Elements in, how they meet at their faces out: boundary, pieces, more than two at a face, how uneven they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.mesh.elements import ElementFaces, face_parts, faces_of
from femprep.mesh.least_corner import by_least_corner
from femprep.model import FloatArray, IntArray, TagArray


@dataclass(frozen=True)
class Neighbours:
    """What all faces of a mesh tell.

    Attributes
    ----------
    boundary : dict of str to ElementFaces
        The faces that belong to one element only, by facet type.
    crowded : int
        Number of faces that belong to more than two elements.
    pieces : int
        Number of pieces that elements are in which are linked by faces.
    volume_ratio : float or None
        Largest ratio of the volumes of two elements that share a face; 1 where none do, None where one has none.
    """

    boundary: dict[str, ElementFaces]
    crowded: int
    pieces: int
    volume_ratio: float | None


def neighbours(cells: Mapping[str, IntArray], volume: FloatArray) -> Neighbours:
    """Go through all faces once, chunk by chunk; ``volume`` ``(n,)`` is that of each element."""
    parent = np.arange(len(volume))
    boundary: dict[str, ElementFaces] = {}
    crowded, links, ratio = 0, 0, 1.0
    for facet, parts in face_parts(cells).items():
        single = []
        for chunk in by_least_corner(parts):
            before = chunk.before()
            single.append(chunk.unpaired(before))
            crowded += _crowded(before)
            links += _link(chunk.element, before, parent)
            ratio = max(ratio, _greatest_ratio(chunk.element, before, volume))
        boundary[facet] = faces_of(cells, facet, np.sort(np.concatenate([np.empty(0, dtype=np.int64), *single])))
    return Neighbours(boundary, crowded, len(volume) - links, ratio if ratio < np.inf else None)


def _crowded(before: TagArray) -> int:
    """Number of faces that are the third of their corners."""
    first = before[before[before >= 0]]
    return int(np.count_nonzero(before[first[first >= 0]] < 0))


def _greatest_ratio(element: TagArray, before: TagArray, volume: FloatArray) -> float:
    """Largest ratio over all faces, each element there with the next; infinite where a volume is not positive."""
    later = np.flatnonzero(before >= 0)
    one, other = volume[element[later]], volume[element[before[later]]]
    low, high = np.minimum(one, other), np.maximum(one, other)
    return float((high / low).max(initial=1.0)) if (low > 0.0).all() else np.inf


@compiled()
def _link(element: TagArray, before: TagArray, parent: IntArray) -> int:
    """Union and find, each path halved as it is walked; the number of links that joined two pieces."""
    links = 0
    for i in range(len(before)):
        if before[i] < 0:
            continue
        a, b = np.int64(element[i]), np.int64(element[before[i]])
        while parent[a] != a:
            parent[a] = parent[parent[a]]
            a = parent[a]
        while parent[b] != b:
            parent[b] = parent[parent[b]]
            b = parent[b]
        if a != b:
            parent[max(a, b)] = min(a, b)
            links += 1
    return links
