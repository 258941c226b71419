"""A mesh in, what solvers are told of its fibres and segments out: fibre and sheet per element, sets of elements."""

from __future__ import annotations

import re

import numpy as np

from femprep.errors import InputError
from femprep.model import FloatArray, VolumeMesh
from femprep.model.products import unit_vectors


def directions(mesh: VolumeMesh) -> tuple[FloatArray, FloatArray] | None:
    """Unit fibre and sheet direction ``(n_cells, 3)`` of each element, at right angles; ``None`` without fibres.

    They come from the cell data ``fiber`` and ``sheet``. Without sheets any direction across the fibre stands in:
    the coordinate axis that is most across it, made perpendicular.

    Raises
    ------
    InputError
        They are no vectors, or have no length.
    """
    if "fiber" not in mesh.cell_data:
        return None
    require_vectors(mesh)
    fiber = _unit(mesh.cell_data["fiber"], "fiber")
    if "sheet" in mesh.cell_data:
        return fiber, _unit(mesh.cell_data["sheet"], "sheet")
    axis = np.eye(3)[np.argmin(np.abs(fiber), axis=1)]
    return fiber, unit_vectors(axis - np.einsum("ij,ij->i", axis, fiber)[:, None] * fiber)


def require_vectors(mesh: VolumeMesh) -> None:
    """Refuse a mesh whose fibres or sheets are no vectors: programs take what has these names for directions.

    Raises
    ------
    InputError
    """
    for name in ("fiber", "sheet"):
        if (shape := np.shape(mesh.cell_data.get(name, np.empty((mesh.n_cells, 3))))) != (mesh.n_cells, 3):
            raise InputError(
                f"cell data {name!r} have shape {shape}, expected ({mesh.n_cells}, 3): one vector per element; "
                "give other values another name"
            )


def _unit(values: object, name: str) -> FloatArray:
    array = np.asarray(values, dtype=np.float64)
    length = np.sqrt(np.einsum("ij,ij->i", array, array))[:, None]
    wrong = np.flatnonzero(~(length[:, 0] > 0))
    if wrong.size:
        raise InputError(f"cell data {name!r} have no direction in {wrong.size} elements, first in element {wrong[0]}")
    # Unit vectors stay as they are, bit for bit.
    if np.abs(length - 1.0).max(initial=0.0) < 1e-12:
        return array
    return np.where(np.abs(length - 1.0) < 1e-12, array, array / length)


def segments(mesh: VolumeMesh) -> dict[str, np.ndarray]:
    """Element numbers of each AHA segment, as ``aha_1``, ``aha_2``...; empty without cell data ``aha``."""
    if "aha" not in mesh.cell_data:
        return {}
    values = np.asarray(mesh.cell_data["aha"])
    return {f"aha_{int(n)}": np.flatnonzero(values == n) for n in np.unique(values) if n > 0}


def segment_of(name: str) -> int | None:
    """Number of the segment that a set of this name, in any case, holds; ``None`` of another set."""
    match = re.fullmatch(r"aha_(\d+)", name.lower())
    return int(match[1]) if match else None
