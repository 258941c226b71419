"""A volume mesh, and cells and facets on its points, in; a mesh of these alone out, without points that none uses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from femprep.model.arrays import IntArray
from femprep.model.blocks import nodes_of, numbers_among
from femprep.model.volume_mesh import VolumeMesh


def on_used_points(
    mesh: VolumeMesh, cells: Mapping[str, IntArray], facets: Mapping[str, IntArray]
) -> tuple[dict[str, Any], IntArray]:
    """Points, cells, facets and point data of a mesh of some cells and of facets on them, to be put into a mesh.

    Returns
    -------
    fields : dict
        By their names in :class:`~femprep.model.VolumeMesh`.
    number : (n,) array
        New number of each point; -1 where no cell uses it.
    """
    used = nodes_of(cells)
    number = numbers_among(used, len(mesh.points))
    return {
        "points": mesh.points[used],
        "cells": {kind: number[block] for kind, block in cells.items()},
        "facets": {kind: number[block] for kind, block in facets.items()},
        "point_data": {name: np.asarray(values)[used] for name, values in mesh.point_data.items()},
    }, number
