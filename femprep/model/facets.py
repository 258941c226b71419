"""Facets of a tagged volume mesh in; the triangles of a tag, centres and area vectors out."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femprep.model import FACET_TAGS, FloatArray, IntArray, VolumeMesh
from femprep.model.blocks import chosen_rows


def facet_triangles(mesh: VolumeMesh, name: str) -> IntArray:
    """The facets of one tag as triangles; quadrilaterals are split, mid-side nodes left out."""
    return split_facets(chosen_rows(mesh.facets, mesh.facet_tag == FACET_TAGS[name]))


def split_facets(facets: Mapping[str, IntArray]) -> IntArray:
    """Blocks of facets as triangles ``(m, 3)``, of quadrilaterals the first halves before the others."""
    parts = [np.empty((0, 3), dtype=np.int64)]
    for kind, block in facets.items():
        parts.append(block[:, [0, 1, 2]])
        if kind.startswith("quad"):
            parts.append(block[:, [0, 2, 3]])
    return np.concatenate(parts)


def centres_and_areas(points: FloatArray, facets: Mapping[str, IntArray]) -> tuple[FloatArray, FloatArray]:
    """Centres and area vectors of all facets of some blocks, by their corners, ``(f, 3)`` each."""
    centres, areas = [np.empty((0, 3))], [np.empty((0, 3))]
    for kind, block in facets.items():
        triangles = kind.startswith("triangle")
        x = points[block[:, : 3 if triangles else 4]]
        one, other = (x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) if triangles else (x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
        centres.append(x.mean(axis=1))
        areas.append(np.cross(one, other) / 2)
    return np.concatenate(centres), np.concatenate(areas)
