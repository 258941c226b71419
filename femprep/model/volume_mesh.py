"""A volume mesh with tagged regions and tagged boundary facets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from femprep.errors import InputError, quoted
from femprep.model.arrays import (
    FloatArray,
    IntArray,
    TagArray,
    mapping,
    readonly,
    readonly_table,
    require_points,
)
from femprep.model.convert import Convertible, maker
from femprep.model.element_nodes import ELEMENT_NODES, FACET_NODES, require_types
from femprep.model.plane import Plane
from femprep.model.purkinje import PurkinjeNet
from femprep.model.tags import FACET_TAGS, REGION_TAGS, names_of

if TYPE_CHECKING:
    import scipy.sparse as sp


@dataclass(frozen=True, eq=False)
class VolumeMesh(Convertible):
    """A volume mesh with tagged regions and tagged boundary facets.

    Attributes
    ----------
    points : (n, 3) array
        mm LPS.
    cells : mapping of str to (k, p) array
        Elements by meshio type name (``"tetra"``, ``"wedge"``, ``"hexahedron"``, ``"tetra10"``...), one block a
        type, in VTK's node order, positive.
    region : (n_cells,) array
        Numbers of ``REGION_TAGS``, over all blocks in their order.
    facets : mapping of str to (f, q) array
        Tagged boundary (and interface) facets: ``"triangle"``, ``"quad"``, ``"triangle6"``, ``"quad8"``, wound outward.
    facet_tag : (n_facets,) array
        Numbers of ``FACET_TAGS``, over all blocks in their order.
    cell_data, point_data, facet_data : mapping of str to array
        Further values, first axis n_cells, n, n_facets.
    planes : mapping of str to Plane
        Planes the facets of that name lie in.
    info : mapping
        How it was made. JSON-ready.
    purkinje : PurkinjeNet, optional
        The net of Purkinje fibres on its endocardia.
    nested : Nested, optional
        The coarser mesh it is a refinement of. Copies keep it as long as points and elements are the same.

    Examples
    --------
    >>> mesh.facet_names
    {'endo': 101, 'epi': 102, 'base': 103}
    >>> mesh.region.shape == (mesh.n_cells,)
    True
    """

    points: FloatArray
    cells: Mapping[str, IntArray]
    region: TagArray
    facets: Mapping[str, IntArray] = field(default_factory=dict)
    facet_tag: TagArray = field(default_factory=lambda: np.empty(0, dtype=np.int32))
    cell_data: Mapping[str, Any] = field(default_factory=dict)
    point_data: Mapping[str, Any] = field(default_factory=dict)
    facet_data: Mapping[str, Any] = field(default_factory=dict)
    planes: Mapping[str, Plane] = field(default_factory=dict)
    info: Mapping[str, Any] = field(default_factory=dict)
    purkinje: PurkinjeNet | None = None
    nested: Nested | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "points", readonly(self.points, np.float64, (None, 3), "points"))
        for name in ("cells", "facets"):
            blocks = {
                key: readonly(value, np.int64, (None, None), f"{name} {key!r}")
                for key, value in mapping(getattr(self, name), name).items()
            }
            require_types(blocks, *((ELEMENT_NODES, "element") if name == "cells" else (FACET_NODES, "facet")))
            for key, value in blocks.items():
                require_points(value, len(self.points), f"{name} {key!r}")
            put(self, name, MappingProxyType(blocks))
        put(self, "region", readonly(self.region, np.int32, (self.n_cells,), "region"))
        put(self, "facet_tag", readonly(self.facet_tag, np.int32, (self.n_facets,), "facet_tag"))
        put(self, "cell_data", readonly_table(self.cell_data, self.n_cells, "cell data"))
        put(self, "point_data", readonly_table(self.point_data, len(self.points), "point data"))
        put(self, "facet_data", readonly_table(self.facet_data, self.n_facets, "facet data"))
        put(self, "planes", mapping(self.planes, "planes", Plane))
        put(self, "info", mapping(self.info, "info"))
        if not isinstance(self.purkinje, PurkinjeNet | None):
            raise InputError(f"purkinje is {quoted(self.purkinje)}, expected a PurkinjeNet")
        if self.purkinje is not None and self.purkinje.mesh_point.max(initial=-1) >= len(self.points):
            raise InputError(
                f"the Purkinje net ends in point {self.purkinje.mesh_point.max()}, but there are {len(self.points)}"
            )
        if self.nested is not None and not self.nested.fits(self):
            put(self, "nested", None)

    def __repr__(self) -> str:
        cells = ", ".join(f"{len(block)} {kind}" for kind, block in self.cells.items())
        names = ", ".join([*self.region_names, *self.facet_names])
        return f"VolumeMesh({len(self.points)} points, {cells}, {self.n_facets} facets: {names})"

    def to_skfem(self) -> Any:
        """This as a mesh of scikit-fem's, with its regions as ``subdomains`` and its facets as ``boundaries``.

        Examples
        --------
        >>> list(mesh.to_skfem().boundaries)
        ['endo', 'epi', 'base']
        """
        return maker("to_skfem")(self)

    @property
    def n_cells(self) -> int:
        """Number of elements of all types.

        Examples
        --------
        >>> mesh.n_cells == len(mesh.region)
        True
        """
        return sum(len(block) for block in self.cells.values())

    @property
    def n_facets(self) -> int:
        """Number of tagged facets of all types.

        Examples
        --------
        >>> mesh.n_facets == len(mesh.facet_tag)
        True
        """
        return sum(len(block) for block in self.facets.values())

    @property
    def region_names(self) -> dict[str, int]:
        """Tags of the regions that occur, by name, in order of their numbers; names are the file's where it had some.

        Examples
        --------
        >>> mesh.region_names
        {'lv': 1}
        """
        return names_of(self.region, self.info, REGION_TAGS)

    @property
    def facet_names(self) -> dict[str, int]:
        """Tags of the facets that occur, by name, in order of their numbers; names are the file's where it had some.

        Examples
        --------
        >>> mesh.facet_names
        {'endo': 101, 'epi': 102, 'base': 103}
        """
        return names_of(self.facet_tag, self.info, FACET_TAGS)

    def with_data(
        self,
        *,
        cell: Mapping[str, Any] | None = None,
        point: Mapping[str, Any] | None = None,
        facet: Mapping[str, Any] | None = None,
    ) -> VolumeMesh:
        """Copy with further cell, point and facet data; a name that exists is replaced.

        Examples
        --------
        >>> "load" in mesh.with_data(point={"load": mesh.points[:, 2]}).point_data
        True
        """
        return replace(
            self,
            cell_data={**self.cell_data, **(cell or {})},
            point_data={**self.point_data, **(point or {})},
            facet_data={**self.facet_data, **(facet or {})},
        )


class Nested(Protocol):
    """What a mesh knows of the coarser one it is a refinement of."""

    @property
    def coarse(self) -> VolumeMesh:
        """The coarser mesh, which may have one in turn."""

    @property
    def down(self) -> sp.csr_array:
        """Values at the mesh's nodes from those of the coarser one; exact for linear fields."""

    @property
    def parent(self) -> IntArray:
        """The coarser mesh's element that each element is a part of, ``(n_cells,)``."""

    def fits(self, mesh: VolumeMesh) -> bool:
        """Whether points and elements of a mesh are still those that this was made for."""

    def part(self, mesh: VolumeMesh, nodes: IntArray, elements: IntArray) -> Nested:
        """That of a mesh of some of the elements, given by their numbers and those of the nodes that are left."""
