"""A closed triangle mesh in, one with fewer vertices for the same surface out."""

from __future__ import annotations

from femprep.mesh.measures.triangles import areas
from femprep.mesh.polygons import decimated
from femprep.mesh.topology import euler_characteristic, is_closed
from femprep.model import FloatArray, IntArray


def coarser(points: FloatArray, cells: IntArray, count: int) -> tuple[FloatArray, IntArray]:
    """A mesh of about ``count`` vertices for the same surface; the mesh itself where it is small, or fails to shrink.

    Edges are collapsed where that moves the surface least (quadric error metrics).
    """
    if len(points) <= 1.5 * count:
        return points, cells
    shape = decimated(points, cells, 1.0 - count / len(points))
    if not is_closed(shape[1]) or euler_characteristic(shape[1]) != 2 or areas(*shape).min() <= 0.0:
        return points, cells
    return shape
