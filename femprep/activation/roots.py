"""A mesh, an endocardium and the heart's axes in; where its bundle branch begins and how it runs out.

The left bundle branch comes onto the endocardium below the aortic valve, high on the septum, and fans out into an
anterior, a septal and a posterior fascicle; the right one runs down the septum without a branch to beyond its middle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from femprep.anatomy import VentricularAxes
from femprep.errors import InputError
from femprep.mesh.measures.triangles import vertex_normals
from femprep.model import FloatArray, IntArray
from femprep.model.products import unit_vectors

#: Height of the root between the lowest and the highest point of the septal side.
_HEIGHT: Final = 0.85
#: How far from the middle of the septum a root is looked for, degrees.
_SECTOR: Final = 30.0
#: Length of the trunk as a share of that height, by ventricle; fascicles as (angle in degrees, share of that height).
_TRUNK: Final = {"lv": 0.15, "rv": 0.5}
_FASCICLES: Final = {"lv": ((-40.0, 0.25), (0.0, 0.25), (40.0, 0.25)), "rv": ()}


@dataclass(frozen=True)
class Root:
    """Where and how a tree begins.

    Attributes
    ----------
    point : (3,) array
        A vertex of the endocardium, mm.
    direction : (3,) array
        Unit vector along the endocardium there, to the apex.
    trunk : float
        Length of the first branch, mm.
    fascicles : tuple of (float, float)
        Angle, radians, and length, mm, of what leaves the trunk's end.
    """

    point: FloatArray
    direction: FloatArray
    trunk: float
    fascicles: tuple[tuple[float, float], ...]


def find_root(
    points: FloatArray,
    triangles: IntArray,
    axes: VentricularAxes,
    ventricle: str,
    given: tuple[float, float, float] | None,
) -> Root:
    """Find the root of a ventricle's tree.

    Parameters
    ----------
    points : (n, 3) array
        Vertices of its endocardium, mm.
    triangles : (m, 3) array
        Wound to be seen from the cavity.
    axes : VentricularAxes
    ventricle : {"lv", "rv"}
    given : tuple of float, optional
        The vertex nearest to this point is the root; lengths are then those of the whole endocardium where it has no
        septal side.

    Raises
    ------
    InputError
        The endocardium has no septal side, and no root was given; or the one given is farther away than it is large.
    """
    normal = vertex_normals(points, triangles)
    turn = axes.turn(points)
    # Seen from the left ventricle's axis the septum is inside of the right one's free wall, and faces away.
    facing = normal @ axes.septal * (1.0 if ventricle == "rv" else -1.0)
    side = np.flatnonzero((np.abs(turn) < _SECTOR) & (facing > 0.5))
    if given is not None:
        away = np.linalg.norm(points - np.asarray(given), axis=1)
        at = int(np.argmin(away))
        if away[at] > np.linalg.norm(np.ptp(points, axis=0)):
            place = ", ".join(f"{x:.6g}" for x in given)
            raise InputError(
                f"root_{ventricle} is {place}, {away[at]:.0f} mm from the endocardium of the {ventricle}; give a point "
                "on it, in mm"
            )
        side = side if len(side) else np.arange(len(points))
    elif not len(side):
        raise InputError(
            f"the endocardium of the {ventricle} has no side to the septum, where its bundle branch begins; name the "
            f"root (root_{ventricle})"
        )
    height = axes.height(points)
    low, high = height[side].min(), height[side].max()
    if given is None:
        off = (height[side] - (low + _HEIGHT * (high - low))) ** 2
        across = (np.radians(turn[side]) * axes.radius(points[side])) ** 2
        at = int(side[np.argmin(off + across)])
    down = -axes.long_axis
    direction = unit_vectors(down - (down @ normal[at]) * normal[at])
    length = float(high - low)
    fascicles = tuple((float(np.radians(angle)), share * length) for angle, share in _FASCICLES[ventricle])
    return Root(points[at], direction, _TRUNK[ventricle] * length, fascicles)
