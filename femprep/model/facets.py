"""A tagged volume mesh in, the triangles of one of its facet tags out."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femprep.model import FACET_TAGS, IntArray, VolumeMesh
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
