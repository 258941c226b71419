"""A tagged volume mesh in, the triangles of one of its facet tags out."""

from __future__ import annotations

import numpy as np

from femprep.model import FACET_TAGS, IntArray, VolumeMesh


def facet_triangles(mesh: VolumeMesh, name: str) -> IntArray:
    """The facets of one tag as triangles; quadrilaterals are split, mid-side nodes left out."""
    parts, first = [], 0
    for kind, block in mesh.facets.items():
        chosen = block[mesh.facet_tag[first : first + len(block)] == FACET_TAGS[name]]
        first += len(block)
        parts.append(chosen[:, [0, 1, 2]])
        if kind.startswith("quad"):
            parts.append(chosen[:, [0, 2, 3]])
    return np.concatenate(parts) if parts else np.empty((0, 3), dtype=np.int64)
