"""An edge length and the size of a ventricle in, columns, rows and layers of a cup out, and those of coarser ones."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.errors import OptionError
from femprep.model import Surface
from femprep.options import SweepOptions
from femprep.sweeping.cup.cup import SECTORS, Cup, quad_cup, quad_tube, triangle_cup, triangle_tube
from femprep.sweeping.matching.axial import Axial

#: Height of an element over its side that is best, by corners of the template. Tetrahedra split from wedges are best
#: at 0.9.
HEIGHT: Final = {3: 0.9, 4: 1.0}
#: Width of a row over the side of its cells.
_ROW: Final = {3: float(np.sqrt(0.75)), 4: 1.0}
#: A cup with fewer columns than twice this is not halved again.
_COARSEST: Final = 20


def corners_of(options: SweepOptions) -> int:
    """Corners of the template's cells, 3 or 4, for an element type."""
    needed = {"wedge": "triangle", "hexahedron": "quad"}.get(options.element)
    template = options.template or needed or "triangle"
    if needed and template != needed:
        raise OptionError(f"element {options.element!r} needs template {needed!r}, not {template!r}")
    return 3 if template == "triangle" else 4


def check_columns(options: SweepOptions, corners: int, clipped: bool) -> int:
    """What the number of columns of a template is a multiple of.

    Raises
    ------
    OptionError
        The number given is none.
    """
    multiple = _multiple(corners, clipped)
    if options.columns is not None and options.columns % multiple:
        raise OptionError(f"option 'columns' is {options.columns}, expected a multiple of {multiple} for this template")
    return multiple


def _multiple(corners: int, clipped: bool) -> int:
    return 4 if corners == 4 else 1 if clipped else SECTORS


def resolution(
    axial: Axial, endo: Surface, epi: Surface, options: SweepOptions, corners: int, clipped: bool
) -> tuple[int, int, int]:
    """Columns, rows and layers for an edge length, those given in options as they are."""
    edge = options.edge_length
    girth, length, thickness = axial.size(endo.points, epi.points)
    multiple = check_columns(options, corners, clipped)
    least = max(multiple, 6)
    columns = options.columns
    if columns is None:
        columns = max(round(girth / edge / multiple), -(-least // multiple)) * multiple
    rows = options.rows
    if rows is None:
        total = length / (edge * _ROW[corners])
        at_apex = 0.0 if clipped else columns / 5 if corners == 3 else columns / 8
        rows = max(round(total - at_apex), 1)
    layers = options.layers or max(round(thickness / (edge * HEIGHT[corners])), 1)
    return columns, rows, layers


def coarser(columns: int, rows: int, corners: int, clipped: bool) -> list[tuple[int, int]]:
    """Columns and rows of all levels, coarsest first."""
    multiple = _multiple(corners, clipped)
    found = [(columns, rows)]
    while found[0][0] >= 2 * _COARSEST:
        c, r = found[0]
        found.insert(0, (max(round(c / 2 / multiple), 1) * multiple, max(round(r / 2), 1)))
    return found


def make_cup(columns: int, rows: int, corners: int, clipped: bool) -> Cup:
    """The cup, or the tube where the apex is clipped, of triangles or quadrilaterals."""
    make = {(3, False): triangle_cup, (3, True): triangle_tube, (4, False): quad_cup, (4, True): quad_tube}
    return make[corners, clipped](columns, rows)
