"""Boundary facets of a mesh and the tagged wall it fills in, a tag for every facet out."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.errors import StageError
from femprep.geometry.closest import ClosestFinder
from femprep.geometry.topology import edge_table, pieces
from femprep.geometry.triangles import areas, normals
from femprep.model import FACET_TAGS, Wall, tag_name

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
TagArray = npt.NDArray[np.int32]

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
    samples = np.einsum("si,fik->fsk", _SAMPLES, points[facets])
    score = np.empty((len(tags), len(facets)))
    for row, tag in enumerate(tags):
        triangles = wall.triangles[wall.facet_tag == tag]
        closest = ClosestFinder(wall.points, triangles)(samples.reshape(-1, 3))
        distance = closest.distance.reshape(len(facets), -1).mean(axis=1)
        there = normals(wall.points, triangles)[closest.triangle.reshape(len(facets), -1)[:, 0]]
        score[row] = distance / envelope + _NORMAL_WEIGHT * (1.0 - np.einsum("fk,fk->f", normal, there))
    fixed = np.zeros(len(facets), dtype=bool)
    for name, plane in wall.planes.items():
        row = int(np.searchsorted(tags, FACET_TAGS[name]))
        near = (np.abs(plane.signed_distance(points))[facets] <= 1.5 * envelope).all(axis=1)
        flat = near & (normal @ plane.normal > _FLAT) & (score[row] < score.min(axis=0) + 2.0 * _NORMAL_WEIGHT)
        score[row] = np.where(flat, -1.0, np.inf)
        fixed |= flat
    result = tags[np.argmin(score, axis=0)]
    _join_strays(points, facets, result, fixed, wall)
    return np.asarray(result, dtype=np.int32)


def _join_strays(points: FloatArray, facets: IntArray, tag: TagArray, fixed: npt.NDArray[np.bool_], wall: Wall) -> None:
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
