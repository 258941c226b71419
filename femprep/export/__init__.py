"""Meshes, walls and surfaces in, files for solvers out, and back: one table, a folder per format."""

from __future__ import annotations

from femprep.export.format import Format
from femprep.export.reading import read_mesh
from femprep.export.table import FORMATS, require_formats
from femprep.export.writing import write_facets, write_format, write_mesh, write_purkinje, write_surface, write_wall

__all__ = [
    "FORMATS",
    "Format",
    "read_mesh",
    "require_formats",
    "write_facets",
    "write_format",
    "write_mesh",
    "write_purkinje",
    "write_surface",
    "write_wall",
]
