"""A triangle mesh in, its curvature and how it changes when vertices move along their normals out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from femprep.mesh.measures.triangles import angles, areas, vertex_normals, vertex_sums
from femprep.mesh.topology import adjacency
from femprep.model import FloatArray, IntArray
from femprep.model.functions import sine_cosine

#: Passes of smoothing the curvature before its change is taken.
_PASSES: Final = 2


@dataclass(frozen=True, eq=False)
class Curvature:
    """Curvature of a mesh, by cotangents [1]_.

    Attributes
    ----------
    normals : (n, 3) array
        Unit normals of the vertices.
    area : (n,) array
        A third of the area of each vertex' triangles, mm2.
    stiffness : (n, n) sparse array
        Cotangent matrix: f'Cf is the integral of \\|grad f\\|^2.
    mean : (n,) array
        Sum of the principal curvatures, 1/mm, positive where the surface is convex.
    change : (n, n) sparse array
        Change of ``mean`` when vertices move along their normals: minus Laplacian, minus the sum of the squared
        principal curvatures.
    triangles : (m, 3) array
        Corner numbers.
    cotangents : (m, 3) array
        Of the angle at each corner.
    size : (m,) array
        Area of each triangle, mm2.

    References
    ----------
    .. [1] Meyer et al., Discrete differential-geometry operators for triangulated 2-manifolds, 2003.
       doi:10.1007/978-3-662-05105-4_2
    """

    normals: FloatArray
    area: FloatArray
    stiffness: Any
    mean: FloatArray
    change: Any
    triangles: IntArray
    cotangents: FloatArray
    size: FloatArray

    @classmethod
    def of(cls, points: FloatArray, triangles: IntArray, sharpest: float) -> Curvature:
        """Curvature of a closed mesh; principal curvatures beyond ``sharpest``, 1/mm, are noise and count no more."""
        from scipy.sparse import diags

        count = len(points)
        corner = angles(points, triangles)
        sine, cosine = sine_cosine(np.clip(corner, 1e-3, np.pi - 1e-3))
        cotangents = cosine / sine
        matrix = stiffness(cotangents, triangles, count)
        size = areas(points, triangles)
        area = vertex_sums(size / 3.0, triangles, count)
        normals = vertex_normals(points, triangles)
        mean = np.asarray((matrix @ points) * normals).sum(axis=1) / area
        turn = vertex_sums(corner, triangles, count)
        squares = np.clip(mean * mean - 2.0 * (2.0 * np.pi - turn) / area, 0.0, sharpest * sharpest)
        change = diags(1.0 / area) @ matrix - diags(squares)
        return cls(normals, area, matrix, mean, change, triangles, cotangents, size)

    def lenient(self, usual: float, least: float) -> Any:
        """Stiffness in which triangles where the curvature changes by more than usual count less.

        A weight of 1 / (1 + (change / usual)^2) for each, so that few sharp edges cost less than the same bend
        everywhere: the estimate of a surface that is smooth except at edges (Cauchy's).

        Parameters
        ----------
        usual : float
            Change of ``mean`` along the surface, 1/mm2.
        least : float
            Least weight.
        """
        from scipy.sparse import eye_array

        count = len(self.area)
        around = adjacency(self.triangles, count) + eye_array(count)
        mean = self.mean
        for _ in range(_PASSES):
            mean = (around @ (mean * self.area)) / (around @ self.area)
        corner = mean[self.triangles]
        # |grad f|^2 of a linear function: the cotangents times the squared differences along the sides opposite.
        steps = np.roll(corner, -1, axis=1) - np.roll(corner, 1, axis=1)
        square = np.maximum((self.cotangents * steps * steps).sum(axis=1), 0.0) / (2.0 * self.size)
        weight = np.maximum(1.0 / (1.0 + square / (usual * usual)), least)
        return stiffness(self.cotangents * weight[:, None], self.triangles, count)


def stiffness(cotangents: FloatArray, triangles: IntArray, count: int) -> Any:
    """Cotangent matrix of triangles ``(m, 3)``, cotangents given by corner."""
    from scipy.sparse import coo_matrix, diags

    # The side opposite of corner k joins the two others.
    row = np.concatenate([triangles[:, 1], triangles[:, 2], triangles[:, 0]])
    column = np.concatenate([triangles[:, 2], triangles[:, 0], triangles[:, 1]])
    half = coo_matrix((0.5 * cotangents.T.ravel(), (row, column)), shape=(count, count)).tocsr()
    full = half + half.T
    return (diags(np.asarray(full.sum(axis=1)).ravel()) - full).tocsr()
