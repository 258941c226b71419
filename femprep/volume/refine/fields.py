"""Point data of a mesh in, those of its refinement out: linear in between, directions of unit length, angles whole."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from femprep.model import TagArray, VolumeMesh
from femprep.volume.refine.transfer import prolongation

#: Point data that are directions: both signs mean the same.
_DIRECTIONS: Final = ("fiber", "sheet", "normal")


def carried(coarse: VolumeMesh, fine: VolumeMesh, ways: Mapping[str, TagArray]) -> VolumeMesh:
    """The fine mesh with the coarse one's point data."""
    if not coarse.point_data:
        return fine
    return fine.with_data(point=at_nodes(coarse, prolongation(coarse, fine.points, fine.cells, ways)))


def at_nodes(coarse: VolumeMesh, matrix: Any) -> dict[str, Any]:
    """Point data of a mesh at other nodes, of which a sparse matrix has the weights of its own."""
    found: dict[str, Any] = {}
    for name, values in coarse.point_data.items():
        array = np.asarray(values)
        if array.dtype.kind not in "fiu":
            continue
        if array.dtype.kind in "iu":  # numbers of things have no values in between: those of the nearest node
            whole = np.asarray(array[_heaviest(matrix)])
            found[name] = whole
            continue
        flat = array.reshape(len(array), -1).astype(float)
        if name in _DIRECTIONS and flat.shape[1] == 3:
            found[name] = _direction(matrix, flat)
        else:
            found[name] = (matrix @ flat).reshape(-1, *array.shape[1:]).astype(array.dtype)
    if {"rotational", "rotational_cos", "rotational_sin"} <= set(found):
        size = np.hypot(found["rotational_cos"], found["rotational_sin"])
        for part in ("rotational_cos", "rotational_sin"):
            found[part] = np.divide(found[part], size, out=np.zeros_like(size), where=size > 0.0)
        turn = np.arctan2(found["rotational_sin"], found["rotational_cos"]) / (2.0 * np.pi) % 1.0
        found["rotational"] = np.where(turn >= 1.0, 0.0, turn)
    return found


def _heaviest(matrix: Any) -> Any:
    """Column of the largest entry of each row; the first of equal ones."""
    row = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    order = np.lexsort((matrix.indices, -matrix.data, row))
    first = np.searchsorted(row[order], np.arange(matrix.shape[0]))
    return matrix.indices[order][first]


def _direction(matrix: Any, values: Any) -> Any:
    """Unit vectors along the largest axis of the mean of ``v v'``."""
    product = np.einsum("ni,nj->nij", values, values).reshape(-1, 9)
    mean = np.asarray(matrix @ product).reshape(-1, 3, 3)
    return np.ascontiguousarray(np.linalg.eigh(mean)[1][:, :, 2])
