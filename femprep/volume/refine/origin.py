"""What a refined mesh keeps of the coarser one it was cut from: the mesh, and what carries values between both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from femprep.model import FloatArray, Immutable, IntArray, TagArray, VolumeMesh
from femprep.volume.refine.transfer import prolongation


@dataclass(frozen=True, eq=False)
class Origin(Immutable):
    """The coarser mesh that a mesh was cut from; a mesh has it as ``nested``.

    Attributes
    ----------
    coarse : VolumeMesh
        It may have one in turn.
    points : (n, 3) array
        Of the finer mesh, the very array: one whose nodes are others is not nested any more.
    cells : mapping of str to array
        As for ``points``.
    ways : mapping of str to array
        Which way each coarse element was cut, by type.
    """

    coarse: VolumeMesh
    points: FloatArray
    cells: Mapping[str, IntArray]
    ways: Mapping[str, TagArray]

    @cached_property
    def down(self) -> sp.csr_array:
        """Values at the finer mesh's nodes from those of the coarser one."""
        return prolongation(self.coarse, self.points, self.cells, self.ways)

    @property
    def parent(self) -> IntArray:
        """The coarse element that each element is a part of, ``(n_cells,)``."""
        return np.arange(8 * self.coarse.n_cells) // 8

    def fits(self, mesh: VolumeMesh) -> bool:
        """Whether nodes and elements of a mesh are those that were cut."""
        return _same(self, mesh)

    def part(self, mesh: VolumeMesh, nodes: IntArray, elements: IntArray) -> PartialOrigin:
        """That of a mesh of some of the elements, given by their numbers and those of the nodes that are left."""
        return PartialOrigin(self.coarse, mesh.points, mesh.cells, self.down[nodes], self.parent[elements])


@dataclass(frozen=True, eq=False)
class PartialOrigin(Immutable):
    """As :class:`Origin`, of a mesh that some elements were taken out of.

    Attributes
    ----------
    coarse, points, cells
        As there.
    down : sparse (n, coarse n)
    parent : (n_cells,) array
    """

    coarse: VolumeMesh
    points: FloatArray
    cells: Mapping[str, IntArray]
    down: sp.csr_array
    parent: IntArray

    def fits(self, mesh: VolumeMesh) -> bool:
        """Whether nodes and elements of a mesh are those that are left."""
        return _same(self, mesh)

    def part(self, mesh: VolumeMesh, nodes: IntArray, elements: IntArray) -> PartialOrigin:
        """That of a mesh of some of the elements, given by their numbers and those of the nodes that are left."""
        return PartialOrigin(self.coarse, mesh.points, mesh.cells, self.down[nodes], self.parent[elements])


def _same(one: Origin | PartialOrigin, mesh: VolumeMesh) -> bool:
    return one.points is mesh.points and [*map(id, one.cells.values())] == [*map(id, mesh.cells.values())]
