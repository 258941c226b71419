"""A surface to its quality: triangle Q or scaled Jacobian, angles, edges, area, volume, and whether it is sound."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from femprep.mesh.measures.triangles import (
    angles,
    areas,
    aspect_ratio,
    edge_lengths,
    quad_quality,
    scaled_jacobian,
    triangle_quality,
)
from femprep.mesh.search.intersection import self_intersections
from femprep.mesh.topology import (
    euler_characteristic,
    fold_angles,
    is_consistently_wound,
    is_manifold,
    pieces,
    volume,
)
from femprep.model import FloatArray, Surface
from femprep.model.record import Record
from femprep.model.surface import require_cells

__all__ = ["Distribution", "SurfaceQuality", "quad_quality", "scaled_jacobian", "surface_quality", "triangle_quality"]


class Distribution(Record):
    """Mean, spread and extremes of a measure over the cells."""

    mean: float
    std: float
    min: float
    p05: float = Field(description="5 % of the cells lie below.")
    median: float
    max: float

    @classmethod
    def of(cls, values: FloatArray) -> Distribution:
        """Summary of values ``(m,)``; m is at least 1."""
        return cls(
            mean=float(values.mean()),
            std=float(values.std()),
            min=float(values.min()),
            p05=float(np.quantile(values, 0.05)),
            median=float(np.median(values)),
            max=float(values.max()),
        )


class SurfaceQuality(Record):
    """How good a surface is, and whether it can bound a volume."""

    vertices: int
    cells: int = Field(description="Number of triangles or quadrilaterals.")
    cell_type: str = Field(description="triangle or quad.")
    q: Distribution = Field(
        description="Quality index Q of the triangles (Skrinjar & Bistoquet 2009, Eq. 12 with p = (a + b + c) / 2); "
        "of quadrilaterals, of the triangles they are split into."
    )
    scaled_jacobian: Distribution | None = Field(None, description="Of quadrilaterals: 1 for a rectangle.")
    quad_q: Distribution | None = Field(
        None, description="Shape of quadrilaterals, 1 for a square (Knupp 2003, doi 10.1016/S0168-874X(02)00070-7)."
    )
    smallest_angle: float = Field(description="Smallest angle in any cell, degrees.")
    largest_angle: float = Field(description="Largest angle in any cell, degrees.")
    largest_aspect_ratio: float | None = Field(
        description="Greatest ratio of longest side to height on it, 1 if equilateral; none where a triangle is flat."
    )
    edge_length: Distribution = Field(description="Length of the cells' sides, mm.")
    largest_fold: float | None = Field(
        description="Greatest angle between the normals of two neighbours, degrees; none where the winding differs."
    )
    area: float = Field(description="mm2.")
    volume: float | None = Field(description="Enclosed volume, mm3; none where the surface is open.")
    closed: bool = Field(description="Whether it is a closed 2-manifold.")
    consistently_wound: bool
    outward: bool = Field(description="Whether it is closed and its normals point out of the volume.")
    pieces: int
    euler_characteristic: int = Field(description="2 for a surface like a sphere.")
    self_intersections: int = Field(description="Number of pairs of triangles that intersect.")

    @property
    def sound(self) -> bool:
        """Whether it is one closed, outward surface like a sphere that does not intersect itself."""
        return (
            self.closed
            and self.outward
            and self.pieces == 1
            and self.euler_characteristic == 2
            and self.self_intersections == 0
        )


def surface_quality(surface: Surface) -> SurfaceQuality:
    """Measure a surface of triangles or quadrilaterals.

    Parameters
    ----------
    surface : Surface
        With at least one cell.

    Returns
    -------
    SurfaceQuality

    Examples
    --------
    >>> fp.surface_quality(endo).q.mean > 0.9
    True
    """
    require_cells(surface)
    points, cells, triangles = surface.points, surface.cells, surface.triangles
    quad = cells.shape[1] == 4
    corner = np.degrees(angles(points, cells))
    aspect = float(aspect_ratio(points, triangles).max())
    wound = is_consistently_wound(cells)
    folds = fold_angles(points, triangles)[1] if wound else np.empty(0)
    closed = is_manifold(cells)
    inside = volume(points, triangles) if closed and wound else None
    return SurfaceQuality(
        vertices=len(points),
        cells=len(cells),
        cell_type="quad" if quad else "triangle",
        q=Distribution.of(triangle_quality(points, triangles)),
        quad_q=Distribution.of(quad_quality(points, cells)) if quad else None,
        scaled_jacobian=Distribution.of(scaled_jacobian(points, cells)) if quad else None,
        smallest_angle=float(corner.min()),
        largest_angle=float(corner.max()),
        largest_aspect_ratio=aspect if np.isfinite(aspect) else None,
        edge_length=Distribution.of(edge_lengths(points, cells).ravel()),
        largest_fold=float(folds.max()) if len(folds) else None,
        area=float(areas(points, triangles).sum()),
        volume=inside,
        closed=closed,
        consistently_wound=wound,
        outward=inside is not None and inside > 0.0,
        pieces=int(pieces(cells).max()) + 1,
        euler_characteristic=euler_characteristic(cells),
        self_intersections=len(self_intersections(points, triangles)),
    )
