"""A smooth surface and the size of the triangles to stand for it in, the surface their corners should lie on out."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.mesh.measures.triangles import vertex_normals
from femprep.mesh.patches import PatchSurface
from femprep.model import FloatArray

#: An even triangle of area A on a surface whose principal curvatures add up to H lies beneath it by A H over this.
_SAG: Final = 4.0 * np.sqrt(3.0)
#: Principal curvatures beyond this, 1/mm, are narrower than a triangle and not followed.
_SHARPEST: Final = 0.2


def outset(surface: PatchSurface, area: FloatArray) -> PatchSurface:
    """Move a surface outward where it is convex, by what flat triangles with their corners on it would cut off.

    Triangles with their corners on the surface that comes out lie as much within the one given as outside of it, and
    hold as much volume, up to terms of higher order in their size.

    Parameters
    ----------
    surface : PatchSurface
        Closed, wound outward.
    area : (n,) array
        Area of the triangles around each of its vertices, mm2.
    """
    bend = np.trace(surface.bend(), axis1=1, axis2=2)
    off = area * np.clip(bend, -2.0 * _SHARPEST, 2.0 * _SHARPEST) / _SAG
    return PatchSurface(
        surface.points + off[:, None] * vertex_normals(surface.points, surface.triangles), surface.triangles
    )
