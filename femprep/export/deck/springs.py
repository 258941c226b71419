"""A mesh with a pericardium in, its springs out, as decks hold them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from femprep.export.deck.names import facet_names, facet_nodes, held
from femprep.export.deck.units import UNITS
from femprep.model import FloatArray, IntArray, VolumeMesh
from femprep.options import ExportOptions

#: The point data that ``add_pericardium`` makes and a spring is made of.
NEEDED: Final = ("pericardium", "pericardium_area", "pericardium_normal")
#: Name of the set of nodes where the epicardium meets the base.
RING: Final = "basal_ring"


@dataclass(frozen=True)
class Springs:
    """Springs that hold points along one direction each.

    Attributes
    ----------
    node : (k,) array
        Numbers of the points, from 0, ascending; none of the base, which a step holds anyhow.
    stiffness : (k,) array
        Force per displacement, in the units of the deck.
    normal : (k, 3) array
        Unit vectors.
    """

    node: IntArray
    stiffness: FloatArray
    normal: FloatArray

    def forces(self, displacement: FloatArray) -> FloatArray:
        """Force of each spring on its point ``(k, 3)``, for displacements ``(n, 3)`` of all points of the mesh."""
        along = np.einsum("kx,kx->k", self.normal, displacement[self.node])
        return np.asarray(-(self.stiffness * along)[:, None] * self.normal)


def pericardial_springs(mesh: VolumeMesh, options: ExportOptions) -> Springs | None:
    """The springs of a mesh's pericardium; ``None`` where it has none, or no point is free to feel one."""
    if any(name not in mesh.point_data for name in NEEDED):
        return None
    stiffness, area, normal = (np.asarray(mesh.point_data[name], dtype=np.float64) for name in NEEDED)
    free = stiffness * area > 0
    for name in held(facet_names(mesh)):
        free[facet_nodes(mesh, facet_names(mesh)[name])] = False
    node = np.flatnonzero(free)
    per_length = per_millimetre(options)
    scale = per_length * UNITS[options.length_unit].per_mm ** 2
    return Springs(node, (stiffness * area)[node] * scale, normal[node]) if node.size else None


def has_pericardium(mesh: VolumeMesh) -> bool:
    """Whether a mesh has a pericardium, for programs that take its stiffness on the facets."""
    return "pericardium" in mesh.point_data and "epi" in facet_names(mesh)


def per_millimetre(options: ExportOptions) -> float:
    """What 1 kPa/mm is in the units of a deck, pressure per length."""
    units = UNITS[options.length_unit]
    return units.per_kpa / units.per_mm


def ring_nodes(mesh: VolumeMesh) -> IntArray:
    """Numbers of the points where the epicardium meets the base, from 0; none without a pericardium."""
    return np.flatnonzero(np.asarray(mesh.point_data.get(RING, [])) > 0)
