"""Boundary facets of a mesh and the tagged wall it fills in, a tag for every facet out."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.errors import StageError
from femprep.mesh.measures.triangles import areas, normals
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import edge_table, pieces
from femprep.model import FACET_TAGS, BoolArray, FloatArray, IntArray, TagArray, Wall, tag_name

#: How much a normal at a right angle counts, in envelopes of distance: at a rim both surfaces are near.
_NORMAL_WEIGHT: Final = 3.0
#: Least cosine between the normal of a facet and that of the plane it lies in.
_FLAT: Final = 0.7
#: Points of a facet its distance is taken at, barycentric.
_SAMPLES: Final = np.array([(1, 1, 1), (4, 1, 1), (1, 4, 1), (1, 1, 4)]) / np.array([[3.0], [6.0], [6.0], [6.0]])


def tag_facets(points: FloatArray, facets: IntArray, wall: Wall, envelope: float) -> TagArray:
    """Tag each boundary facet by the tagged triangles of the wall it lies on.

    The tag is that of the nearest triangles whose normals agree. A facet whose corners all lie in a plane of the wall
    and whose normal is the plane's takes the plane's tag, and no other facet does. Facets, and groups of them, cut off
    from the rest of their tag join their neighbours, until every tag is in as many pieces as on the wall.

    Parameters
    ----------
    points : (n, 3) array
        mm.
    facets : (f, 3) array
        Closed boundary of the mesh, wound outward.
    wall : Wall
        What the mesh fills.
    envelope : float
        How far the facets may lie from the wall, mm.

    Returns
    -------
    (f,) array
        Numbers of ``FACET_TAGS``.

    Raises
    ------
    StageError
        A tag of the wall is missing on the mesh or in more pieces than on the wall.
    """
    tags = np.unique(wall.facet_tag)
    normal = normals(points, facets)
    level = {name: np.abs(plane.signed_distance(points)) <= 1.5 * envelope for name, plane in wall.planes.items()}
    flat = {
        name: level[name][facets].all(axis=1) & (normal @ plane.normal > _FLAT) for name, plane in wall.planes.items()
    }
    scores = _Scores(points, facets, normal, wall, envelope)
    score = scores.best(tags, wall, np.any([np.zeros(len(facets), dtype=bool), *flat.values()], axis=0))
    fixed = np.zeros(len(facets), dtype=bool)
    least = score.min(axis=0)
    for name, own in flat.items():
        row = int(np.searchsorted(tags, FACET_TAGS[name]))
        own = own & (score[row] < least + 2.0 * _NORMAL_WEIGHT)
        score[row] = np.where(own, -1.0, np.inf)
        fixed |= own
    result = tags[np.argmin(score, axis=0)]
    _join_strays(points, facets, result, fixed, wall)
    return np.asarray(result, dtype=np.int32)


class _Scores:
    """How well facets fit the triangles of each tag of a wall: distance in envelopes and angle; the least fits best."""

    def __init__(self, points: FloatArray, facets: IntArray, normal: FloatArray, wall: Wall, envelope: float) -> None:
        self._samples = np.einsum("si,fik->fsk", _SAMPLES, points[facets])
        self._normal, self._envelope = normal, envelope
        self._points, self._triangles, self._tag = wall.points, wall.triangles, wall.facet_tag
        self._finders: dict[int, ClosestFinder] = {}

    def best(self, tags: TagArray, wall: Wall, everywhere: BoolArray) -> FloatArray:
        """Score of each facet for each tag, ``(tags, facets)``; infinite where another tag is certain to fit better.

        Parameters
        ----------
        tags : (t,) array
        wall : Wall
        everywhere : (f,) array
            Facets that may lie in a plane of the wall: they get every score. The others never take a plane's tag.
        """
        score = np.full((len(tags), len(everywhere)), np.inf)
        planes = [FACET_TAGS[name] for name in wall.planes]
        free = [int(tag) for tag in tags if tag not in planes]
        every = everywhere | (len(free) == 0)
        for row, tag in enumerate(tags):
            score[row, every] = self._score(int(tag), every)
        if not free:
            return score
        rest = np.flatnonzero(~every)
        # The tag of the nearest triangle, unless another one may fit better: from there on only near its rim.
        triangles = np.flatnonzero(np.isin(self._tag, free))
        centre = self._samples[rest, 0]
        closest = ClosestFinder(self._points, self._triangles[triangles])(centre)
        triangle = triangles[closest.triangle]
        first = self._tag[triangle]
        score[np.searchsorted(tags, first), rest] = 0.0
        # The samples lie no farther than this from the centre, so that their mean distance from the nearest triangles
        # is at most so much more than the centre's, and from others at most so much less.
        size = np.linalg.norm(self._samples[rest] - centre[:, None], axis=2).max(axis=1)
        there = normals(self._points, self._triangles)[triangle]
        angle = 1.0 - np.einsum("fk,fk->f", self._normal[rest], there)
        reach = (closest.distance + 2.0 * size + _NORMAL_WEIGHT * self._envelope * angle) * (1.0 + 1e-9)
        near = {tag: self._finder(tag).any_within(centre, reach) & (first != tag) for tag in free}
        doubtful = rest[np.any(list(near.values()), axis=0)]
        for tag in free:
            score[np.searchsorted(tags, tag), doubtful] = self._score(tag, doubtful)
        return score

    def _score(self, tag: int, rows: npt.NDArray[Any]) -> FloatArray:
        samples, normal = self._samples[rows], self._normal[rows]
        closest = self._finder(tag)(samples.reshape(-1, 3))
        distance = closest.distance.reshape(-1, len(_SAMPLES)).mean(axis=1)
        triangles = self._triangles[self._tag == tag]
        there = normals(self._points, triangles)[closest.triangle.reshape(-1, len(_SAMPLES))[:, 0]]
        return np.asarray(distance / self._envelope + _NORMAL_WEIGHT * (1.0 - np.einsum("fk,fk->f", normal, there)))

    def _finder(self, tag: int) -> ClosestFinder:
        if tag not in self._finders:
            self._finders[tag] = ClosestFinder(self._points, self._triangles[self._tag == tag])
        return self._finders[tag]


def _join_strays(points: FloatArray, facets: IntArray, tag: TagArray, fixed: BoolArray, wall: Wall) -> None:
    """Give groups of facets that are cut off from the rest of their tag to their neighbours, in place."""
    expected = {int(t): _piece_count(wall.triangles[wall.facet_tag == t]) for t in np.unique(wall.facet_tag)}
    area, pairs = areas(points, facets), edge_table(facets).cells
    for _ in range(4):
        changed = False
        for name, count in expected.items():
            own = np.flatnonzero(tag == name)
            if len(own) == 0:
                continue
            label = pieces(facets[own])
            order = np.argsort(-np.bincount(label, weights=area[own]), kind="stable")
            for piece in order[count:]:
                group = own[label == piece]
                inside = np.isin(pairs, group)
                border = pairs[inside[:, 0] != inside[:, 1]]
                around = border[~np.isin(border, group)]
                if len(around) and not fixed[group].any():
                    values, counts = np.unique(tag[around], return_counts=True)
                    free = ~np.isin(values, [FACET_TAGS[p] for p in wall.planes])
                    if free.any():
                        tag[group] = values[free][np.argmax(counts[free])]
                        changed = True
        if not changed:
            break
    for name, count in expected.items():
        found = _piece_count(facets[tag == name])
        if found != count:
            raise StageError(
                f"the facets tagged {tag_name(name)!r} are in {found} pieces on the mesh but in {count} on the wall; "
                "choose a smaller edge_length or envelope"
            )


def _piece_count(cells: IntArray) -> int:
    return int(pieces(cells).max()) + 1 if len(cells) else 0
