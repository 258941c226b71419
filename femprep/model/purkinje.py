"""A net of fast-conducting fibres on the endocardia of a mesh, and the nodes of the mesh that it ends in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra

from femprep.errors import InputError
from femprep.model.arrays import FloatArray, IntArray, TagArray, mapping, readonly, require_points
from femprep.model.immutable import Immutable
from femprep.model.tags import tag_name


@dataclass(frozen=True, eq=False)
class PurkinjeNet(Immutable):
    """Purkinje fibres on the endocardia, one tree on each.

    Points are numbered as the edges first name them. Each tree begins at its root, where the bundle branch comes onto
    the endocardium, and ends in junctions, which are nodes of the mesh: there alone it meets the wall.

    Attributes
    ----------
    points : (n, 3) array
        mm LPS.
    edges : (m, 2) array
        From the root outward.
    edge_tag : (m,) array
        Facet tag of the endocardium each edge lies on.
    mesh_point : (n,) array
        Number of the mesh's point that a junction is; -1 for all others.
    speed : float
        Of conduction, m/s.
    info : mapping
        How it was made. JSON-ready.

    Examples
    --------
    >>> grown = fp.add_purkinje(mesh, generations=3, seed=1)  # doctest: +SKIP
    >>> len(grown.purkinje.junctions) > 4  # doctest: +SKIP
    True
    """

    points: FloatArray
    edges: IntArray
    edge_tag: TagArray
    mesh_point: IntArray
    speed: float = 2.5
    info: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "points", readonly(self.points, np.float64, (None, 3), "points of a Purkinje net"))
        put(self, "edges", readonly(self.edges, np.int64, (None, 2), "edges of a Purkinje net"))
        put(self, "edge_tag", readonly(self.edge_tag, np.int32, (len(self.edges),), "edge tags of a Purkinje net"))
        put(self, "mesh_point", readonly(self.mesh_point, np.int64, (len(self.points),), "junctions of a Purkinje net"))
        require_points(self.edges, len(self.points), "edges of a Purkinje net")
        named, first = np.unique(self.edges.ravel(), return_index=True)
        if not np.array_equal(named, np.arange(len(self.points))) or not np.all(np.diff(first) > 0):
            raise InputError(
                f"the edges of a Purkinje net name {len(named)} points, of which there are {len(self.points)}; number "
                "them as the edges first name them (PurkinjeNet.numbered)"
            )
        if not np.isfinite(self.points).all() or not 0 < self.speed < np.inf:
            raise InputError(f"a Purkinje net has finite points and a positive speed, not {self.speed} m/s")
        put(self, "info", mapping(self.info, "info"))

    @classmethod
    def numbered(
        cls, points: FloatArray, edges: IntArray, edge_tag: TagArray, mesh_point: IntArray, **more: Any
    ) -> PurkinjeNet:
        """A net of points in any order, some of which no edge may name.

        Examples
        --------
        >>> import numpy as np
        >>> points, edges = np.array([[9.0, 9, 9], [0, 0, 0], [3, 0, 0]]), np.array([[1, 2]])
        >>> net = fp.PurkinjeNet.numbered(points, edges, [111], np.array([5, -1, 7]))
        >>> net.mesh_point.tolist()
        [-1, 7]
        """
        used, first, inverse = np.unique(np.asarray(edges).ravel(), return_index=True, return_inverse=True)
        order = np.argsort(first, kind="stable")
        number = np.empty(len(used), dtype=np.int64)
        number[order] = np.arange(len(used))
        chosen = used[order]
        return cls(
            np.asarray(points)[chosen], number[inverse].reshape(-1, 2), edge_tag, np.asarray(mesh_point)[chosen], **more
        )

    def __repr__(self) -> str:
        names = ", ".join(tag_name(int(tag)) for tag in np.unique(self.edge_tag))
        return f"PurkinjeNet({len(self.points)} points, {len(self.junctions)} junctions, on {names})"

    @property
    def roots(self) -> IntArray:
        """Points in which no edge ends.

        Examples
        --------
        >>> net = fp.PurkinjeNet([[0, 0, 0], [3, 0, 0], [3, 4, 0]], [[0, 1], [1, 2]], [111, 111], [-1, -1, 7])
        >>> net.roots.tolist()
        [0]
        """
        return np.setdiff1d(self.edges[:, 0], self.edges[:, 1])

    @property
    def junctions(self) -> IntArray:
        """Points that are points of the mesh.

        Examples
        --------
        >>> net = fp.PurkinjeNet([[0, 0, 0], [3, 0, 0], [3, 4, 0]], [[0, 1], [1, 2]], [111, 111], [-1, -1, 7])
        >>> net.junctions.tolist()
        [2]
        """
        return np.flatnonzero(self.mesh_point >= 0)

    @property
    def lengths(self) -> FloatArray:
        """Length of each edge, mm.

        Examples
        --------
        >>> net = fp.PurkinjeNet([[0, 0, 0], [3, 0, 0], [3, 4, 0]], [[0, 1], [1, 2]], [111, 111], [-1, -1, 7])
        >>> net.lengths.tolist()
        [3.0, 4.0]
        """
        ends = self.points[self.edges]
        return np.asarray(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))

    @cached_property
    def arrival(self) -> FloatArray:
        """When each point is reached by a beat that leaves the roots at 0, ms.

        Examples
        --------
        >>> net = fp.PurkinjeNet([[0, 0, 0], [3, 0, 0], [3, 4, 0]], [[0, 1], [1, 2]], [111, 111], [-1, -1, 7])
        >>> net.arrival.tolist()
        [0.0, 1.2, 2.8]
        """
        n = len(self.points)
        # Edges of no length would be none to the graph.
        length = np.maximum(self.lengths, 1e-12)
        graph = sp.csr_array((length, (self.edges[:, 0], self.edges[:, 1])), shape=(n, n))
        return np.asarray(dijkstra(graph, indices=self.roots, min_only=True) / self.speed)

    def renumbered(self, number: IntArray) -> PurkinjeNet:
        """The same for a mesh whose point i is now ``number[i]``.

        Raises
        ------
        InputError
            A junction's point is no longer there.

        Examples
        --------
        >>> import numpy as np
        >>> net = fp.PurkinjeNet([[0, 0, 0], [3, 0, 0], [3, 4, 0]], [[0, 1], [1, 2]], [111, 111], [-1, -1, 7])
        >>> net.renumbered(np.arange(8)[::-1]).mesh_point.tolist()
        [-1, -1, 0]
        """
        new = np.where(self.mesh_point >= 0, np.asarray(number)[self.mesh_point], -1)
        if np.any(new[self.junctions] < 0):
            raise InputError("a junction of the Purkinje net is no point of the mesh any more; add the net afterwards")
        return replace(self, mesh_point=new)
