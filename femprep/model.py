"""The nouns of femprep: Plane, Surface, Wall, VolumeMesh, and the one table of tag numbers.

All are frozen dataclasses over read-only arrays. Lengths are mm, coordinates LPS (as ITK has them), points
``(n, 3)`` float64, cells int64, tags int32. Surface cells are wound outward, volume cells are positive.
A changed copy comes from ``dataclasses.replace`` or a ``with_...`` method.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Final, Protocol

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
TagArray = npt.NDArray[np.int32]

#: Numbers of volume regions. No number names two things: regions lie below 100, facets above.
REGION_TAGS: Final[Mapping[str, int]] = MappingProxyType(
    {
        "lv": 1,
        "rv": 2,
        "septum": 3,
        "la": 4,
        "ra": 5,
        "aorta": 6,
        "pulmonary_artery": 7,
        "blood_lv": 11,
        "blood_rv": 12,
        "blood_la": 13,
        "blood_ra": 14,
    }
)

#: Numbers of boundary and interface facets.
FACET_TAGS: Final[Mapping[str, int]] = MappingProxyType(
    {
        "endo": 101,
        "epi": 102,
        "base": 103,
        "apex": 104,
        "endo_lv": 111,
        "endo_rv": 112,
        "endo_la": 113,
        "endo_ra": 114,
        "mitral": 121,
        "tricuspid": 122,
        "aortic": 123,
        "pulmonary": 124,
        "veins": 125,
        "cap_lv": 131,
        "cap_rv": 132,
        "cap_la": 133,
        "cap_ra": 134,
    }
)


def tag_name(number: int) -> str:
    """Name of a region or facet tag; ``"tag_<number>"`` for a number that is not in the tables."""
    for table in (REGION_TAGS, FACET_TAGS):
        for name, value in table.items():
            if value == number:
                return name
    return f"tag_{number}"


def is_blood(region: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Whether numbers of regions are those of blood."""
    return np.asarray(np.isin(region, [number for name, number in REGION_TAGS.items() if name.startswith("blood_")]))


def endo_tags() -> list[int]:
    """Numbers of all endocardia."""
    return [number for name, number in FACET_TAGS.items() if name == "endo" or name.startswith("endo_")]


def readonly(array: npt.ArrayLike, dtype: npt.DTypeLike, shape: tuple[int | None, ...], what: str) -> Any:
    """Contiguous read-only copy of an array, with its shape checked (``None`` is any length)."""
    result = np.array(array, dtype=dtype, order="C", copy=True)
    if result.ndim != len(shape) or any(s is not None and s != n for s, n in zip(shape, result.shape)):
        raise InputError(f"{what} has shape {result.shape}, expected {shape}")
    result.setflags(write=False)
    return result


def split_quads(cells: IntArray) -> IntArray:
    """Triangles ``(k, 3)`` of cells: quadrilaterals ``(m, 4)`` are split along their first diagonal."""
    if cells.shape[1] == 3:
        return cells
    return np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])


def _table(values: Mapping[str, Any], length: int, what: str) -> Mapping[str, Any]:
    """Read-only copy of named arrays that all have ``length`` rows."""
    out = {}
    for name, value in values.items():
        array = np.array(value, order="C", copy=True)
        if array.ndim == 0 or array.shape[0] != length:
            raise InputError(f"{what} {name!r} has shape {array.shape}, expected {length} rows")
        array.setflags(write=False)
        out[name] = array
    return MappingProxyType(out)


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane that cuts a surface; its normal points to the side that is cut away.

    Attributes
    ----------
    point : (3,) array
        A point of the plane, mm LPS.
    normal : (3,) array
        Unit normal (normalised here).
    source : str
        Where it comes from, for the run's record: ``"labels"``, ``"given"``...
    """

    point: FloatArray
    normal: FloatArray
    source: str = "given"

    def __post_init__(self) -> None:
        normal = np.asarray(self.normal, dtype=float)
        length = float(np.linalg.norm(normal))
        if not np.isfinite(length) or length == 0.0:
            raise InputError(f"plane normal {normal.tolist()} has no direction; give a finite, non-zero vector")
        object.__setattr__(self, "point", readonly(self.point, np.float64, (3,), "plane point"))
        object.__setattr__(self, "normal", readonly(normal / length, np.float64, (3,), "plane normal"))

    @property
    def offset(self) -> float:
        """The plane is the set of points x with ``normal . x = offset``, mm."""
        return float(self.normal @ self.point)

    def signed_distance(self, points: npt.ArrayLike) -> FloatArray:
        """Distance of points ``(n, 3)`` from the plane, mm, positive on the side that is cut away."""
        return np.asarray((np.asarray(points, dtype=float) - self.point) @ self.normal, dtype=np.float64)


class SphereMap(Protocol):
    """A smooth closed surface given as a map from the unit sphere; a template's vertices are samples of it."""

    def __call__(self, directions: npt.ArrayLike) -> FloatArray:
        """Points of the surface, ``(n, 3)`` mm LPS, for unit vectors ``(n, 3)``."""
        ...


@dataclass(frozen=True, eq=False)
class Surface:
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
        corners = np.asarray(self.cells).shape[-1] if np.asarray(self.cells).ndim == 2 else 0
        if corners not in (3, 4):
            raise InputError(
                f"cells of surface {self.name!r} have shape {np.shape(self.cells)}, expected (m, 3) or (m, 4)"
            )
        object.__setattr__(self, "cells", readonly(self.cells, np.int64, (None, corners), "cells"))
        if self.directions is not None:
            shape = (len(self.points), 3)
            object.__setattr__(self, "directions", readonly(self.directions, np.float64, shape, "directions"))
        object.__setattr__(self, "point_data", _table(self.point_data, len(self.points), "point data"))
        object.__setattr__(self, "info", MappingProxyType(dict(self.info)))

    @property
    def triangles(self) -> IntArray:
        """The cells as triangles ``(k, 3)``: quadrilaterals are split along their first diagonal."""
        return split_quads(self.cells)

    @property
    def volume(self) -> float:
        """Enclosed volume, mm3, negative where the surface is wound inward."""
        a, b, c = (self.points[self.triangles[:, i]] for i in range(3))
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


@dataclass(frozen=True, eq=False)
class Wall:
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
        object.__setattr__(self, "facet_tag", readonly(self.facet_tag, np.int32, (len(self.triangles),), "facet_tag"))
        object.__setattr__(self, "template", readonly(self.template, np.int64, (len(self.points),), "template"))
        object.__setattr__(self, "planes", MappingProxyType(dict(self.planes)))
        object.__setattr__(self, "info", MappingProxyType(dict(self.info)))

    @property
    def volume(self) -> float:
        """Volume of the tissue, mm3."""
        a, b, c = (self.points[self.triangles[:, i]] for i in range(3))
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


@dataclass(frozen=True, eq=False)
class BloodPools:
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
            name: readonly(cells, np.int64, (None, 3), f"cavity {name!r}") for name, cells in self.cavities.items()
        }
        put(self, "cavities", MappingProxyType(cavities))
        put(self, "caps", MappingProxyType(dict(self.caps)))


@dataclass(frozen=True, eq=False)
class VolumeMesh:
    """A volume mesh with tagged regions and tagged boundary facets.

    Attributes
    ----------
    points : (n, 3) array
        mm LPS.
    cells : mapping of str to (k, p) array
        Elements by meshio type name (``"tetra"``, ``"wedge"``, ``"hexahedron"``, ``"tetra10"``...), one block a
        type, in VTK's node order, positive.
    region : (n_cells,) array
        Numbers of ``REGION_TAGS``, over all blocks in their order.
    facets : mapping of str to (f, q) array
        Tagged boundary (and interface) facets: ``"triangle"``, ``"quad"``, ``"triangle6"``, ``"quad8"``, wound outward.
    facet_tag : (n_facets,) array
        Numbers of ``FACET_TAGS``, over all blocks in their order.
    cell_data, point_data, facet_data : mapping of str to array
        Further values, first axis n_cells, n, n_facets.
    planes : mapping of str to Plane
        Planes the facets of that name lie in.
    info : mapping
        How it was made. JSON-ready.
    """

    points: FloatArray
    cells: Mapping[str, IntArray]
    region: TagArray
    facets: Mapping[str, IntArray] = field(default_factory=dict)
    facet_tag: TagArray = field(default_factory=lambda: np.empty(0, dtype=np.int32))
    cell_data: Mapping[str, Any] = field(default_factory=dict)
    point_data: Mapping[str, Any] = field(default_factory=dict)
    facet_data: Mapping[str, Any] = field(default_factory=dict)
    planes: Mapping[str, Plane] = field(default_factory=dict)
    info: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "points", readonly(self.points, np.float64, (None, 3), "points"))
        for name in ("cells", "facets"):
            blocks = {
                key: readonly(value, np.int64, (None, None), f"{name} {key!r}")
                for key, value in getattr(self, name).items()
            }
            for key, value in blocks.items():
                if value.size and (value.min() < 0 or value.max() >= len(self.points)):
                    raise InputError(
                        f"{name} {key!r} name point {value.max()}, but there are {len(self.points)} points"
                    )
            put(self, name, MappingProxyType(blocks))
        put(self, "region", readonly(self.region, np.int32, (self.n_cells,), "region"))
        put(self, "facet_tag", readonly(self.facet_tag, np.int32, (self.n_facets,), "facet_tag"))
        put(self, "cell_data", _table(self.cell_data, self.n_cells, "cell data"))
        put(self, "point_data", _table(self.point_data, len(self.points), "point data"))
        put(self, "facet_data", _table(self.facet_data, self.n_facets, "facet data"))
        put(self, "planes", MappingProxyType(dict(self.planes)))
        put(self, "info", MappingProxyType(dict(self.info)))

    @property
    def n_cells(self) -> int:
        """Number of elements of all types."""
        return sum(len(block) for block in self.cells.values())

    @property
    def n_facets(self) -> int:
        """Number of tagged facets of all types."""
        return sum(len(block) for block in self.facets.values())

    @property
    def region_names(self) -> dict[str, int]:
        """Tags of the regions that occur, by name, in order of their numbers."""
        return {tag_name(int(t)): int(t) for t in np.unique(self.region)}

    @property
    def facet_names(self) -> dict[str, int]:
        """Tags of the facets that occur, by name, in order of their numbers."""
        return {tag_name(int(t)): int(t) for t in np.unique(self.facet_tag)}

    def with_data(
        self,
        *,
        cell: Mapping[str, Any] | None = None,
        point: Mapping[str, Any] | None = None,
        facet: Mapping[str, Any] | None = None,
    ) -> VolumeMesh:
        """Copy with further cell, point and facet data; a name that exists is replaced."""
        return replace(
            self,
            cell_data={**self.cell_data, **(cell or {})},
            point_data={**self.point_data, **(point or {})},
            facet_data={**self.facet_data, **(facet or {})},
        )
