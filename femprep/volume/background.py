"""A body and the edge length wanted in it in, a background mesh of edge lengths out: longer the farther from the body.

The mesher fills the whole box about the body and drops at the end what lies outside. With edges of one length that is
many times what is kept: of a dilated heart, edges of 1.7 mm, 2.4 million tetrahedra, of which 70,000 lie in the wall.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from femprep.mesh.measures.volume_elements import element_volumes
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import edge_table
from femprep.model import FloatArray, IntArray
from femprep.volume.blood import Filling
from femprep.volume.refine.plan import WallThickness
from femprep.volume.sizing import LONGEST, SizingField, graded, grown

#: Edges of a mesh by the thickness of a wall that is thinner than they are long.
_THIN: Final = 1.05
#: Distance of the background mesh's nodes outside of the body, mm, and how many there are about at most.
_STEP: Final = 5.0
_MOST_NODES: Final = 40_000
#: Elements of the background mesh that are flatter than this, by their nodes' distance cubed, are left out.
_FLAT: Final = 1e-6


def background_field(
    filling: Filling, edge_length: float, gradation: float, thickness: WallThickness | None = None
) -> SizingField:
    """Edges of one length in a body, mm; no longer than its wall is thick, where its thickness is given.

    Parameters
    ----------
    filling : Filling
        Wall and blood to be filled.
    edge_length : float
        mm.
    gradation : float
        How much edges may grow by mm of distance in the body.
    thickness : WallThickness, optional
        Of the wall.
    """
    points, triangles = filling.outer.points, filling.triangles
    table = edge_table(triangles)
    on = np.concatenate(
        [points[np.unique(triangles)], points[table.nodes].mean(axis=1), points[triangles].mean(axis=1)]
    )
    longest = max(LONGEST, edge_length)
    outside, far = _outside(filling, longest)
    nodes = np.concatenate([on, outside])
    tets = _tetrahedra(nodes)
    lengths = np.full(1, edge_length)
    values = np.full(len(on), edge_length)
    if thickness is not None:
        lengths = np.minimum(_THIN * thickness.values, edge_length)
        values = graded(on, tets, lengths[cKDTree(thickness.points).query(on)[1]], gradation)
    beyond = grown(values[cKDTree(on).query(outside)[1]], far, longest)
    return SizingField(
        nodes,
        tets,
        np.concatenate([values, beyond]),
        float(lengths.min()),
        edge_length,
        float((1.0 / lengths**3).mean()) * filling.wall.volume,
    )


def _outside(filling: Filling, reach: float) -> tuple[FloatArray, FloatArray]:
    """Nodes of a grid outside of the body, up to where the mesher's box ends, and their distances from it."""
    points = filling.outer.points[np.unique(filling.outer.triangles)]
    low, high = points.min(axis=0) - reach - _STEP, points.max(axis=0) + reach + _STEP
    step = max(_STEP, float(np.cbrt(np.prod(high - low) / _MOST_NODES)))
    axes = [np.linspace(a, b, int(np.ceil((b - a) / step)) + 1) for a, b in zip(low, high)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    far = ClosestFinder(filling.outer.points, filling.outer.triangles).signed(grid)
    kept = far > 0.5 * step
    return grid[kept], far[kept]


def _tetrahedra(nodes: FloatArray) -> IntArray:
    """Positive tetrahedra between nodes; those of a grid that lie in one plane are none."""
    tets = np.asarray(Delaunay(nodes).simplices, dtype=np.int64)
    volumes = element_volumes(nodes, tets, "tetra")
    tets[volumes < 0.0] = tets[volumes < 0.0][:, [1, 0, 2, 3]]
    size = np.linalg.norm(nodes[tets[:, 1]] - nodes[tets[:, 0]], axis=1)
    return np.ascontiguousarray(tets[np.abs(volumes) > _FLAT * size**3])
