"""A triangle surface to points spread evenly over its area, the same ones every time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.mesh.measures.triangles import areas
from femprep.model import FloatArray, IntArray

# The plane's most even sequence: its steps are 1/g and 1/g^2 with g^3 = g + 1 (Roberts 2018).
_PLASTIC = 1.32471795724474602596


@dataclass(frozen=True)
class SurfaceSamples:
    """Points of a surface.

    Attributes
    ----------
    points : (s, 3) array
        mm.
    triangle : (s,) array
        The triangle each lies in.
    """

    points: FloatArray
    triangle: IntArray


def sample_surface(points: npt.ArrayLike, triangles: npt.ArrayLike, count: int) -> SurfaceSamples:
    """Spread points over a surface so that every part gets its share by area.

    The triangles are laid end to end by area and sampled at equal steps (systematic sampling); within the triangles
    the points follow a low-discrepancy sequence. No random numbers: the same surface gives the same points, and a
    moved surface the moved ones.

    Parameters
    ----------
    points : (n, 3) array
        Vertices, mm.
    triangles : (m, 3) array
        Corner numbers.
    count : int
        Number of samples.

    Returns
    -------
    SurfaceSamples

    Raises
    ------
    InputError
        The surface has no area.
    """
    p, t = np.asarray(points, dtype=np.float64), np.asarray(triangles, dtype=np.int64)
    end = np.cumsum(areas(p, t))
    if len(end) == 0 or not end[-1] > 0.0:
        raise InputError(f"the surface of {len(t)} triangles has no area to sample")
    step = (np.arange(count) + 0.5) / count
    triangle = np.minimum(np.searchsorted(end, step * end[-1], side="right"), len(t) - 1)
    number = np.arange(1, count + 1)
    u, v = (0.5 + number / _PLASTIC) % 1.0, (0.5 + number / _PLASTIC**2) % 1.0
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    a, b, c = (p[t[triangle, k]] for k in range(3))
    return SurfaceSamples(a + u[:, None] * (b - a) + v[:, None] * (c - a), triangle.astype(np.int64))
