"""A triangle mesh in, its curvature and how it changes when vertices move along their normals out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from femprep.geometry.triangles import angles, areas, vertex_normals
from femprep.model import FloatArray, IntArray


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

    @classmethod
    def of(cls, points: FloatArray, triangles: IntArray, sharpest: float) -> Curvature:
        """Curvature of a closed mesh; principal curvatures beyond ``sharpest``, 1/mm, are noise and count no more."""
        from scipy.sparse import coo_matrix, diags

        count = len(points)
        corner = angles(points, triangles)
        cotangent = 0.5 / np.tan(np.clip(corner, 1e-3, np.pi - 1e-3))
        # The side opposite of corner k joins the two others.
        row = np.concatenate([triangles[:, 1], triangles[:, 2], triangles[:, 0]])
        column = np.concatenate([triangles[:, 2], triangles[:, 0], triangles[:, 1]])
        half = coo_matrix((cotangent.T.ravel(), (row, column)), shape=(count, count)).tocsr()
        full = half + half.T
        stiffness = (diags(np.asarray(full.sum(axis=1)).ravel()) - full).tocsr()
        third = np.repeat(areas(points, triangles) / 3.0, 3)
        area = np.asarray(np.bincount(triangles.ravel(), weights=third, minlength=count), dtype=np.float64)
        normals = vertex_normals(points, triangles)
        mean = np.asarray((stiffness @ points) * normals).sum(axis=1) / area
        turn = np.bincount(triangles.ravel(), weights=corner.ravel(), minlength=count)
        squares = np.clip(mean * mean - 2.0 * (2.0 * np.pi - turn) / area, 0.0, sharpest * sharpest)
        return cls(normals, area, stiffness, mean, diags(1.0 / area) @ stiffness - diags(squares))
