"""A mapped surface in, its faults out: triangles that cross, are turned inside out or lie lost, and where."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femprep.mesh.measures.triangles import area_vectors
from femprep.mesh.search.intersection import self_intersections
from femprep.mesh.topology import volume
from femprep.model import FloatArray, IntArray
from femprep.surface.harmonic.field import Field


@dataclass(frozen=True)
class Faults:
    """What is wrong with a surface carried in from a sphere.

    Attributes
    ----------
    lost : int
        Vertices that are not finite.
    crossing : int
        Triangles that intersect another one.
    turned : int
        Triangles whose outer side faces up the field. Every flow line passes the smooth surface once, on its way in,
        so that such a triangle is folded over.
    place : (3,) array
        The middle of the first faulty triangle, mm LPS.
    inward : bool
        The enclosed volume is not positive.
    triangles : (k,) array
        The crossing and the turned triangles.
    """

    lost: int
    crossing: int
    turned: int
    place: FloatArray
    inward: bool
    triangles: IntArray

    def __bool__(self) -> bool:
        """Whether there is any."""
        return bool(self.lost or self.crossing or self.turned or self.inward)

    def __str__(self) -> str:
        if self.lost:
            return _count(self.lost, "lost vertex", "lost vertices")
        parts = []
        if self.crossing:
            parts.append(_count(self.crossing, "crossing triangle", "crossing triangles"))
        if self.turned:
            parts.append(_count(self.turned, "folded triangle", "folded triangles"))
        if self.inward:
            parts.append("no positive volume")
        return f"{' and '.join(parts)} near {np.round(self.place, 1).tolist()} (mm LPS)"


def find_faults(points: FloatArray, cells: IntArray, field: Field) -> Faults:
    """Look for what makes a surface unfit to bound a volume.

    Its triangles are those of a template sphere, so that it is closed and consistently wound in any case.

    Parameters
    ----------
    points : (V, 3) array
        Vertices, mm LPS.
    cells : (T, 3) array
        Triangles, wound outward on the template.
    field : Field
        The field along which the vertices were carried.

    Returns
    -------
    Faults
    """
    lost = int(np.count_nonzero(~np.isfinite(points).all(axis=1)))
    if lost:
        return Faults(lost, 0, 0, np.full(3, np.nan), False, np.empty(0, dtype=np.int64))
    middle = points[cells].mean(axis=1)
    crossing = np.unique(self_intersections(points, cells))
    turned = np.flatnonzero(np.einsum("ij,ij->i", area_vectors(points, cells), field.gradient(middle)) >= 0.0)
    faulty = np.concatenate([crossing, turned])
    place = middle[faulty[0]] if len(faulty) else middle.mean(axis=0)
    return Faults(0, len(crossing), len(turned), place, volume(points, cells) <= 0.0, np.unique(faulty))


def _count(number: int, one: str, several: str) -> str:
    return f"{number} {one if number == 1 else several}"
