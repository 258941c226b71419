"""A plane that cuts a surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.model.arrays import FloatArray, floats, readonly
from femprep.model.immutable import Immutable
from femprep.model.notice import Notice, records
from femprep.model.products import inner, product
from femprep.model.products import length as length_of


@dataclass(frozen=True, eq=False)
class Plane(Immutable):
    """A plane that cuts a surface; its normal points to the side that is cut away.

    Attributes
    ----------
    point : (3,) array
        A point of the plane, mm LPS.
    normal : (3,) array
        Unit normal (normalised here).
    source : str
        Where it comes from, for the run's record: ``"labels"``, ``"given"``...
    notices : tuple of Notice
        Why it does not lie where it would usually.
    ring : (n, 3) array, optional
        The annulus of a valve that it was laid through, a closed ring, mm LPS.

    Examples
    --------
    >>> plane = fp.Plane([0.0, 0.0, 5.0], [0.0, 0.0, 2.0])
    >>> float(plane.signed_distance([[0.0, 0.0, 8.0]])[0])
    3.0
    """

    point: FloatArray
    normal: FloatArray
    source: str = "given"
    notices: tuple[Notice, ...] = ()
    ring: FloatArray | None = None

    def __post_init__(self) -> None:
        normal, point = floats(self.normal, "plane normal"), floats(self.point, "plane point")
        if not np.isfinite(point).all():
            raise InputError(f"plane point {point.tolist()} lies nowhere; give finite numbers")
        with np.errstate(over="ignore"):
            length = length_of(normal)
        if not np.isfinite(length) or length == 0.0:
            raise InputError(f"plane normal {normal.tolist()} has no direction; give a finite, non-zero vector")
        object.__setattr__(self, "point", readonly(self.point, np.float64, (3,), "plane point"))
        object.__setattr__(self, "normal", readonly(normal / length, np.float64, (3,), "plane normal"))
        if self.ring is not None:
            object.__setattr__(self, "ring", readonly(self.ring, np.float64, (None, 3), "ring of a plane"))

    def __repr__(self) -> str:
        place, way = (", ".join(f"{x + 0.0:.4g}" for x in array) for array in (self.point, self.normal))
        return f"Plane(point ({place}) mm, normal ({way}); {self.source})"

    def record(self) -> dict[str, Any]:
        """What there is to tell of it, JSON-ready.

        Examples
        --------
        >>> plane = fp.Plane([0.0, 0.0, 5.0], [0.0, 0.0, 2.0])
        >>> plane.record()["source"]
        'given'
        """
        told = {"point_mm": self.point.tolist(), "normal": self.normal.tolist(), "source": self.source}
        ring = {} if self.ring is None else {"ring_mm": np.round(self.ring, 3).tolist()}
        return {**told, **ring, **({"notices": records(*self.notices)} if self.notices else {})}

    @property
    def offset(self) -> float:
        """The plane is the set of points x with ``normal . x = offset``, mm.

        Examples
        --------
        >>> plane = fp.Plane([0.0, 0.0, 5.0], [0.0, 0.0, 2.0])
        >>> plane.offset
        5.0
        """
        return inner(self.normal, self.point)

    def signed_distance(self, points: npt.ArrayLike) -> FloatArray:
        """Distance of points ``(n, 3)`` from the plane, mm, positive on the side that is cut away.

        Examples
        --------
        >>> plane = fp.Plane([0.0, 0.0, 5.0], [0.0, 0.0, 2.0])
        >>> plane.signed_distance([[0.0, 0.0, 8.0], [9.0, 0.0, 1.0]]).tolist()
        [3.0, -4.0]
        """
        given = floats(points, "points")
        if given.shape[-1:] != (3,):
            raise InputError(f"points have shape {given.shape}, expected (n, 3)")
        return product(given - self.point, self.normal)

    def feet(self, points: FloatArray) -> FloatArray:
        """Points ``(n, 3)`` put onto the plane, straight, mm.

        Examples
        --------
        >>> import numpy as np
        >>> fp.Plane([0.0, 0.0, 5.0], [0.0, 0.0, 1.0]).feet(np.array([[1.0, 2.0, 9.0]])).tolist()
        [[1.0, 2.0, 5.0]]
        """
        return np.asarray(points - self.signed_distance(points)[..., None] * self.normal)


def cutting(facets: str, planes: Mapping[str, Plane]) -> dict[str, Plane]:
    """The planes that cut the surface of some facets: a right ventricle with a base of its own is cut by that one."""
    other = "base" if facets == "endo_rv" else "base_rv"
    return {name: plane for name, plane in planes.items() if "base_rv" not in planes or name != other}
