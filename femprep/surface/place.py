"""A template and a smooth closed surface in, the template's vertices placed on it with even triangles out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from femprep.errors import StageError
from femprep.geometry.closest import ClosestFinder
from femprep.geometry.patches import PatchSurface
from femprep.geometry.topology import euler_characteristic, is_closed
from femprep.geometry.triangles import areas
from femprep.model import FloatArray, IntArray
from femprep.surface.descent import OnPatches, descend, smoother
from femprep.surface.distortion import Ideal
from femprep.surface.spherical import sphere_map

#: Vertices of the coarse mesh from which the map to the sphere is made.
_COARSE: Final = 1000
#: What a triangle's area counts beside its shape.
SIZE: Final = 0.1
#: Steps of the last descent at most.
_STEPS: Final = 100


@dataclass(frozen=True, eq=False)
class Placed:
    """A template on a surface.

    Attributes
    ----------
    points, normals : (V, 3) arrays
        Vertices on the smooth surface, mm, and its unit normals there.
    cells : (T, 3) or (T, 4) array
        The template's.
    steps : int
        Of the descent.
    folded : int
        Triangles turned against the surface: 0 unless the surface bends more sharply than its triangles can follow.
    """

    points: FloatArray
    normals: FloatArray
    cells: IntArray
    steps: int
    folded: int


def place_evenly(
    directions: FloatArray,
    cells: IntArray,
    surface: PatchSurface,
    start: FloatArray | None = None,
    *,
    size: float = SIZE,
) -> Placed:
    """Place a template on a smooth closed surface so that its triangles, or quadrilaterals, are even.

    The surface is mapped to the sphere with little distortion of angles and areas and turned to agree with ``start``;
    through that map the template is carried to the surface, and there its vertices slide to a minimum of the
    distortion of its cells.

    Parameters
    ----------
    directions : (V, 3) array
        The template's vertices, unit vectors.
    cells : (T, 3) or (T, 4) array
        Its triangles or quadrilaterals, wound outward.
    surface : PatchSurface
        The smooth surface, of a ball's topology, wound outward.
    start : (V, 3) array, optional
        Where vertices should roughly lie, mm, for example at the ends of harmonic field lines: tells how the template
        is turned. By default a vertex should lie in its direction as seen from the surface's middle.
    size : float
        What the cells' area counts beside their shape.

    Raises
    ------
    StageError
        The surface is not a closed surface of one piece without handles.
    """
    if not is_closed(surface.triangles) or euler_characteristic(surface.triangles) != 2:
        raise StageError(
            "the smooth surface is not a ball's: it is open or has "
            f"Euler characteristic {euler_characteristic(surface.triangles)}, not 2"
        )
    points, triangles = coarser(surface.points, surface.triangles, _COARSE)
    sphere = sphere_map(points, triangles)
    sphere = sphere @ _turn(sphere, _wanted(points, directions, start), areas(points, triangles), triangles).T
    begin = _carry(directions, sphere, points, triangles)

    domain = OnPatches(surface)
    mean = float(areas(surface.points, surface.triangles).sum() / len(cells))
    ideal = Ideal.even(cells, np.full(len(cells), mean))
    there, steps = descend(begin, domain, ideal, smoother(cells, len(directions)), size, _STEPS)
    folded = int(np.count_nonzero(ideal.folded(there.points, there.normals)))
    return Placed(there.points, there.normals, cells, steps, folded)


def coarser(points: FloatArray, cells: IntArray, count: int) -> tuple[FloatArray, IntArray]:
    """A mesh of about ``count`` vertices for the same surface; the mesh itself where it is small, or fails to shrink.

    Edges are collapsed where that moves the surface least (quadric error metrics).
    """
    if len(points) <= 1.5 * count:
        return points, cells
    import pyvista as pv

    faces = np.column_stack([np.full(len(cells), 3), cells])
    mesh = pv.PolyData(points, faces.ravel()).decimate(1.0 - count / len(points), volume_preservation=True)
    shape = np.asarray(mesh.points, dtype=np.float64), mesh.regular_faces.astype(np.int64)
    if not is_closed(shape[1]) or euler_characteristic(shape[1]) != 2 or areas(*shape).min() <= 0.0:
        return points, cells
    return shape


def _wanted(points: FloatArray, directions: FloatArray, start: FloatArray | None) -> FloatArray:
    """Unit vectors at which points of the surface should lie on the sphere, roughly."""
    if start is None:
        off = points - points.mean(axis=0)
        return np.asarray(off / np.linalg.norm(off, axis=1, keepdims=True))
    from scipy.spatial import cKDTree

    return np.asarray(directions[cKDTree(start).query(points)[1]])


def _turn(sphere: FloatArray, wanted: FloatArray, weight: FloatArray, cells: IntArray) -> FloatArray:
    """The rotation ``(3, 3)`` after which vectors agree best with those wanted."""
    share = np.bincount(cells.ravel(), weights=np.repeat(weight, 3), minlength=len(sphere))
    left, _, right = np.linalg.svd(wanted.T @ (share[:, None] * sphere))
    flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return np.asarray(left @ flip @ right)


def _carry(directions: FloatArray, sphere: FloatArray, points: FloatArray, cells: IntArray) -> FloatArray:
    """Where directions lie on the mesh whose vertices have places on the sphere: linear within its triangles."""
    found = ClosestFinder(sphere, cells)(directions)
    return np.asarray(np.einsum("qi,qik->qk", found.weights, points[cells[found.triangle]]))
