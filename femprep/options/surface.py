"""Options of fitting surfaces."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from femprep.options.base import StageOptions


class SurfaceOptions(StageOptions):
    """Fitting a closed template surface to an object.

    Examples
    --------
    >>> fp.SurfaceOptions(vertices=800).method
    'smooth'
    """

    method: Literal["smooth", "even", "paper"] = Field(
        "smooth",
        description="smooth: the surface of least change of curvature that the labels allow, the most accurate one, "
        "with even triangles. paper: the harmonic surface as published, smoothed only where its triangles would cross. "
        "even: that surface, lightly smoothed, and its vertices moved along it until the triangles are even.",
    )
    vertices: int = Field(1500, ge=12, le=20000, description="Number of vertices V of the template sphere.")
    cells: Literal["triangle", "quad"] = Field(
        "triangle",
        description="Cells of the surface: triangles, or quadrilaterals of a cubed sphere, which has 6 n^2 + 2 "
        "vertices for a whole number n, the nearest number to the one asked for. A wall is made of triangles.",
    )
    connectivity: Literal["template", "auto", "free"] = Field(
        "auto",
        description="Which vertices are joined where vertices are moved. template: as in the template. auto: as in the "
        "template, but with edges flipped where a long or branched object leaves no even triangles otherwise. free: "
        "flipped wherever that makes triangles more even. Quadrilaterals stay.",
    )
    curvature_sizing: float = Field(
        0.0,
        ge=0.0,
        le=2.0,
        description="Where vertices are moved, the area of cells goes with the surface's curvature to minus this power "
        "where that is large: 0 the same everywhere, 1 finer where curved.",
    )
    singularities: int | None = Field(
        None,
        ge=4,
        description="Number of singularities M of the harmonic field; from the object where not given. The smooth "
        "surface needs none.",
    )
    control_points: int | None = Field(
        None,
        ge=4,
        description="Number of spline control points K of the harmonic surface; from the object where not given. The "
        "smooth surface needs none.",
    )
    spline_order: int = Field(4, ge=2, le=10, description="Order m of Wahba's spline.")
    sphere_ratio: float = Field(
        1.25,
        gt=1.0,
        le=4.0,
        description="Radius of the sphere over the object's greatest distance from its barycentre.",
    )
    steps: int | None = Field(
        None,
        ge=4,
        le=1000,
        description="Runge-Kutta steps from sphere to surface; as many as an error of 0.002 mm asks for where not "
        "given.",
    )
    memory_limit: float = Field(4.0, gt=0, description="Largest memory a solve may need, GB.")
