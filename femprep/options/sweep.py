"""Options of the sweep mesher."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from femprep.options.thickness import LeastThickness


class SweepOptions(LeastThickness):
    """Matching both surfaces and sweeping the wall between them in layers.

    Examples
    --------
    >>> fp.SweepOptions(element="wedge", layers=3)
    SweepOptions(element='wedge', layers=3)
    """

    element: Literal["tetra", "wedge", "hexahedron"] = Field(
        "tetra", description="Elements: tetrahedra, wedges of triangles, or hexahedra of quadrilaterals."
    )
    template: Literal["triangle", "quad"] | None = Field(
        None,
        description="What the surfaces are meshed with; tetrahedra may come from either, wedges need triangles and "
        "hexahedra quadrilaterals.",
    )
    edge_length: float = Field(2.5, gt=0, description="Edge length half-way through the wall, mm.")
    layers: int | None = Field(
        None, ge=1, le=200, description="Layers of elements through the wall; from the edge length where not given."
    )
    columns: int | None = Field(
        None, ge=4, le=4000, description="Elements around the base; from the edge length where not given."
    )
    rows: int | None = Field(
        None,
        ge=1,
        le=4000,
        description="Rows of elements of constant number around, that end at the base; from the edge length where not "
        "given. Equal columns, rows and layers give equal connectivity.",
    )
    grading: float | None = Field(
        None,
        gt=0.01,
        lt=100,
        description="Height of the outermost layer over that of the innermost; above 1 is finer inside. Where not "
        "given, layers grow with the width of the elements, from place to place.",
    )
    order: Literal[1, 2] = Field(1, description="Order of the elements; 2 adds mid-side nodes on the smooth surfaces.")
    toward: tuple[float, float, float] | None = Field(
        None,
        description="Direction (LPS) in which the first column of elements lies, seen from the long axis; to the right "
        "ventricle, as the labels show it, where not given.",
    )
