"""A closed surface of triangles or quadrilaterals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.model.arrays import (
    FARTHEST,
    FloatArray,
    IntArray,
    array_of,
    mapping,
    readonly,
    readonly_table,
    require_points,
)
from femprep.model.convert import Convertible


def split_quads(cells: IntArray) -> IntArray:
    """Triangles ``(k, 3)`` of cells: quadrilaterals ``(m, 4)`` are split along their first diagonal."""
    if cells.shape[1] == 3:
        return cells
    return np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])


def require_cells(surface: Surface) -> None:
    """Refuse a surface without any cell.

    Raises
    ------
    InputError
    """
    if not len(surface.cells):
        raise InputError(f"surface {surface.name!r} has no triangles")


class SphereMap(Protocol):
    """A smooth closed surface given as a map from the unit sphere; a template's vertices are samples of it."""

    def __call__(self, directions: npt.ArrayLike) -> FloatArray:
        """Points of the surface, ``(n, 3)`` mm LPS, for unit vectors ``(n, 3)``."""
        ...


@dataclass(frozen=True, eq=False)
class Surface(Convertible):
    """A closed surface of triangles or quadrilaterals, wound outward.

    Attributes
    ----------
    points : (n, 3) array
        Vertices, mm LPS, in the numbering of the template sphere.
    cells : (m, 3) or (m, 4) array
        Triangles or quadrilaterals, counter-clockwise seen from outside.
    name : str
        Which surface it is (``"lv"``, ``"epi"``...).
    directions : (n, 3) array, optional
        The unit vector on the template sphere each vertex was mapped from.
    shape : SphereMap, optional
        The smooth surface the vertices are samples of: ``shape(directions)`` gives ``points``, and any other
        directions give further points of the same surface.
    point_data : mapping of str to array
        Values per vertex, first axis n.
    info : mapping
        How it was made: parameters, residuals, what was repaired. JSON-ready.

    Examples
    --------
    >>> endo
    Surface('lv': 500 points, 996 triangles)
    >>> endo.volume > 0
    True
    """

    points: FloatArray
    cells: IntArray
    name: str = "surface"
    directions: FloatArray | None = None
    shape: SphereMap | None = None
    point_data: Mapping[str, Any] = field(default_factory=dict)
    info: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", readonly(self.points, np.float64, (None, 3), "points"))
        if len(far := np.flatnonzero(~(np.abs(self.points) < FARTHEST).all(axis=1))):
            raise InputError(
                f"surface {self.name!r}: vertex {far[0]} is {self.points[far[0]].tolist()}, expected coordinates in mm"
            )
        what = f"cells of surface {self.name!r}"
        shape = array_of(self.cells, what).shape
        if len(shape) != 2 or shape[1] not in (3, 4):
            raise InputError(f"{what} have shape {shape}, expected (m, 3) or (m, 4)")
        object.__setattr__(self, "cells", readonly(self.cells, np.int64, shape, what))
        require_points(self.cells, len(self.points), what)
        if self.directions is not None:
            shape = (len(self.points), 3)
            object.__setattr__(self, "directions", readonly(self.directions, np.float64, shape, "directions"))
        object.__setattr__(self, "point_data", readonly_table(self.point_data, len(self.points), "point data"))
        object.__setattr__(self, "info", mapping(self.info, "info"))

    def __repr__(self) -> str:
        kind = "triangles" if self.cells.shape[1] == 3 else "quadrilaterals"
        return f"Surface({self.name!r}: {len(self.points)} points, {len(self.cells)} {kind})"

    @property
    def triangles(self) -> IntArray:
        """The cells as triangles ``(k, 3)``: quadrilaterals are split along their first diagonal.

        Examples
        --------
        >>> endo.triangles.shape[1]
        3
        """
        return split_quads(self.cells)

    @property
    def volume(self) -> float:
        """Enclosed volume, mm3, negative where the surface is wound inward.

        Examples
        --------
        >>> bool(epi.volume > endo.volume > 0.0)
        True
        """
        a, b, c = (self.points[self.triangles[:, i]] for i in range(3))
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)
