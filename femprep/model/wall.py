"""The closed boundary of the myocardial wall, and the blood in its cavities."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from femprep.model.arrays import FloatArray, IntArray, TagArray, mapping, readonly, require_points
from femprep.model.convert import Convertible
from femprep.model.immutable import Immutable
from femprep.model.plane import Plane
from femprep.model.tags import tag_name


@dataclass(frozen=True, eq=False)
class Wall(Convertible):
    """The closed boundary of the myocardial wall: triangles, each with its facet tag.

    Attributes
    ----------
    points : (n, 3) array
        mm LPS.
    triangles : (m, 3) array
        Wound out of the wall (out of the tissue: on the endocardium towards the cavity).
    facet_tag : (m,) array
        Numbers of ``FACET_TAGS``.
    template : (n,) array
        Vertex number on the surface it comes from, -1 for a vertex the cut made.
    planes : mapping of str to Plane
        The planes it was cut by, by facet name (``"base"``, ``"apex"``).
    info : mapping
        How it was made: thickness, what was repaired or extrapolated. JSON-ready.

    Examples
    --------
    >>> wall.facet_tag.shape == (len(wall.triangles),)
    True
    >>> list(wall.planes)
    ['base']
    """

    points: FloatArray
    triangles: IntArray
    facet_tag: TagArray
    template: IntArray
    planes: Mapping[str, Plane] = field(default_factory=dict)
    info: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", readonly(self.points, np.float64, (None, 3), "points"))
        object.__setattr__(self, "triangles", readonly(self.triangles, np.int64, (None, 3), "triangles"))
        require_points(self.triangles, len(self.points), "triangles")
        object.__setattr__(self, "facet_tag", readonly(self.facet_tag, np.int32, (len(self.triangles),), "facet_tag"))
        object.__setattr__(self, "template", readonly(self.template, np.int64, (len(self.points),), "template"))
        object.__setattr__(self, "planes", mapping(self.planes, "planes", Plane))
        object.__setattr__(self, "info", mapping(self.info, "info"))

    def __repr__(self) -> str:
        names = ", ".join(tag_name(int(tag)) for tag in np.unique(self.facet_tag))
        return f"Wall({len(self.points)} points, {len(self.triangles)} triangles: {names})"

    @property
    def volume(self) -> float:
        """Volume of the tissue, mm3.

        Examples
        --------
        >>> bool(0.0 < wall.volume < epi.volume)
        True
        """
        a, b, c = (self.points[self.triangles[:, i]] for i in range(3))
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


@dataclass(frozen=True, eq=False)
class BloodPools(Immutable):
    """The blood in the cavities of a wall: closed surfaces that share its points.

    Attributes
    ----------
    points : (n, 3) array
        Those of the wall, then those inside caps, mm LPS.
    outer : (m, 3) array
        Outer boundary of wall and blood together, closed, wound outward.
    outer_tag : (m,) array
        Numbers of ``FACET_TAGS``; caps have that of the plane they lie in.
    cavities : mapping of str to (k, 3) array
        Closed surface of each cavity by name (``"lv"``, ``"rv"``...), wound out of the blood: endocardium and caps.
    caps : mapping of str to Plane
        Plane the cap of a cavity lies in, by facet name (``"cap_lv"``...), where it has a single one.

    Examples
    --------
    >>> list(fp.fill_cavities(wall).caps)
    ['cap_lv']
    """

    points: FloatArray
    outer: IntArray
    outer_tag: TagArray
    cavities: Mapping[str, IntArray]
    caps: Mapping[str, Plane] = field(default_factory=dict)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "points", readonly(self.points, np.float64, (None, 3), "points"))
        put(self, "outer", readonly(self.outer, np.int64, (None, 3), "outer"))
        put(self, "outer_tag", readonly(self.outer_tag, np.int32, (len(self.outer),), "outer_tag"))
        cavities = {
            name: readonly(cells, np.int64, (None, 3), f"cavity {name!r}")
            for name, cells in mapping(self.cavities, "cavities").items()
        }
        for name, cells in {"outer": self.outer, **cavities}.items():
            require_points(cells, len(self.points), f"triangles of {name!r}")
        put(self, "cavities", MappingProxyType(cavities))
        put(self, "caps", mapping(self.caps, "caps", Plane))

    def __repr__(self) -> str:
        return f"BloodPools({len(self.points)} points, {len(self.outer)} outer triangles: {', '.join(self.cavities)})"
