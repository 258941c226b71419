"""Options in, names of the files that a run will write out, as far as they are known before it."""

from __future__ import annotations

from collections.abc import Iterable

from femprep.export.table import FORMATS
from femprep.report.methods import FILES

#: Files of every mesh, whatever the anatomy and the formats.
_MESH = (
    *("run.json", "quality.json", "report.html", "mesh.vtu", "facets.vtp", "wall.vtp"),
    *("surfaces/lv.vtp", "surfaces/epi.vtp", "cavities/lv.vtp"),
    *FILES,
)


def mesh_names(formats: Iterable[str]) -> list[str]:
    """Files of ``femprep mesh`` for one label map."""
    return [*_MESH, *(name for format in formats for name in FORMATS[format].files)]


def sequence_names(phases: Iterable[str], formats: Iterable[str]) -> list[str]:
    """Files of ``femprep mesh --sequence``, given the names of its phases."""
    own = mesh_names(formats)
    below = [f"phases/{phase}/{name}" for phase in phases for name in own]
    return ["run.json", "report.html", *FILES, "sequence.pvd", "sequence.xdmf", "sequence.h5", *below]


def surface_names(objects: Iterable[str]) -> list[str]:
    """Files of ``femprep surface``, given the names of its objects."""
    return ["run.json", *FILES, *(f"surfaces/{name}.vtp" for name in objects)]


def annotation_names(formats: Iterable[str]) -> list[str]:
    """Files of ``femprep annotate``."""
    own = ("run.json", "quality.json", "report.html", "mesh.vtu", "facets.vtp")
    return [*own, *(name for format in formats for name in FORMATS[format].files)]
