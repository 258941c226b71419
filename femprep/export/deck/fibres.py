"""A mesh in, what solvers are told of its fibres out: fibre and sheet per element, and a stiffer direction's moduli."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from femprep.errors import InputError
from femprep.model import FloatArray, VolumeMesh
from femprep.model.products import unit_vectors
from femprep.options import ExportOptions


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
    fiber = _unit(mesh.cell_data["fiber"], mesh.n_cells, "fiber")
    if "sheet" in mesh.cell_data:
        return fiber, _unit(mesh.cell_data["sheet"], mesh.n_cells, "sheet")
    axis = np.eye(3)[np.argmin(np.abs(fiber), axis=1)]
    return fiber, unit_vectors(axis - np.einsum("ij,ij->i", axis, fiber)[:, None] * fiber)


def _unit(values: object, count: int, name: str) -> FloatArray:
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (count, 3):
        raise InputError(f"cell data {name!r} have shape {array.shape}, expected ({count}, 3): one vector per element")
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


@dataclass(frozen=True)
class Moduli:
    """Engineering constants along fibre (1), sheet (2) and normal (3), kPa and -."""

    e1: float
    e2: float
    e3: float
    nu12: float
    nu13: float
    nu23: float
    g12: float
    g13: float
    g23: float


def orthotropic(options: ExportOptions) -> Moduli:
    """A linear material that is stiffer along the fibres: ``nu12`` is the contraction across when pulled along."""
    across = options.young_modulus
    along = across * options.fibre_stiffness
    shear = across / (2 * (1 + options.poisson_ratio))
    nu = options.poisson_ratio
    return Moduli(along, across, across, nu, nu, nu, shear, shear, shear)
