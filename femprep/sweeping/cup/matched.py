"""A cup and its two images in space: what lies between is swept. The noun that matching makes and the sweep takes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from femprep.mesh.patches import PatchSurface
from femprep.model import FloatArray, Immutable, Plane, Surface, readonly
from femprep.sweeping.cup.cup import Cup


@dataclass(frozen=True, eq=False)
class MatchedSurfaces(Immutable):
    """An inner and an outer surface on one cup: vertex i of one is joined to vertex i of the other by a straight line.

    The lines do not cross, and those of rim vertices lie in their planes.

    Attributes
    ----------
    cup : Cup
        Connectivity and rims.
    inner, outer : (V, 3) array
        Positions of its vertices on the endocardium and on the epicardium, mm LPS.
    layers : int
        Number of layers of elements the vertices were placed for.
    growth : (V,) array
        Width of the elements on the epicardium over that on the endocardium, near each vertex: layers grow with it.
    inner_surface, outer_surface : PatchSurface
        The smooth closed surfaces they lie on.
    planes : mapping of str to Plane
        ``base`` and, where clipped, ``apex``.
    info : mapping
        How it was made. JSON-ready.
    """

    cup: Cup
    inner: FloatArray
    outer: FloatArray
    layers: int
    growth: FloatArray
    inner_surface: PatchSurface
    outer_surface: PatchSurface
    planes: Mapping[str, Plane]
    info: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = len(self.cup.disk)
        for name in ("inner", "outer"):
            object.__setattr__(self, name, readonly(getattr(self, name), np.float64, (count, 3), f"{name} points"))
        object.__setattr__(self, "growth", readonly(self.growth, np.float64, (count,), "growth"))
        object.__setattr__(self, "planes", MappingProxyType(dict(self.planes)))
        object.__setattr__(self, "info", MappingProxyType(dict(self.info)))

    @property
    def thickness(self) -> FloatArray:
        """Length of the line at each vertex ``(V,)``, mm."""
        return np.asarray(np.linalg.norm(self.outer - self.inner, axis=1))

    @property
    def endo(self) -> Surface:
        """The endocardium below the base as an open surface, wound out of the cavity; thickness per point."""
        return Surface(self.inner, self.cup.cells, name="endo", point_data={"thickness": self.thickness})

    @property
    def epi(self) -> Surface:
        """The epicardium below the base as an open surface, wound outward; thickness per point."""
        return Surface(self.outer, self.cup.cells, name="epi", point_data={"thickness": self.thickness})
