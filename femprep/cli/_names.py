"""Options in, names of the files that a run will write, as far as they are known before it, out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from femprep.export.table import FORMATS
from femprep.report.methods import FILES

#: Files of every mesh, whatever the anatomy and the formats.
_MESH = (
    *("run.json", "quality.json", "report.html", "mesh.vtu", "facets.vtp", "wall.vtp"),
    *("surfaces/lv.vtp", "surfaces/epi.vtp", "cavities/lv.vtp"),
    *FILES,
)


def mesh_names(formats: Sequence[str]) -> list[str]:
    """Files of ``femprep mesh`` for one label map."""
    return [*_MESH, *(name for format in formats for name in FORMATS[format].files)]


def sequence_names(phases: Iterable[str], formats: Sequence[str]) -> list[str]:
    """Files of ``femprep mesh --sequence``, given the names of its phases."""
    own = mesh_names(formats)
    below = [f"phases/{phase}/{name}" for phase in phases for name in own]
    return ["run.json", "report.html", *FILES, "sequence.pvd", "sequence.xdmf", "sequence.h5", *below]


def surface_names(objects: Iterable[str]) -> list[str]:
    """Files of ``femprep surface``, given the names of its objects."""
    return ["run.json", *FILES, *(f"surfaces/{name}.vtp" for name in objects)]


def annotation_names(formats: Sequence[str]) -> list[str]:
    """Files of ``femprep annotate``."""
    own = ("run.json", "quality.json", "report.html", "mesh.vtu", "facets.vtp")
    return [*own, *(name for format in formats for name in FORMATS[format].files)]


def require_file(out: Path, format: str | None) -> None:
    """What can be wrong with the name of a mesh to write is found before anything is computed for it."""
    from femprep.export.files import require_folder
    from femprep.export.table import format_of, require_formats

    if format is None:
        format_of(out)
    else:
        require_formats([format])
    require_folder(out.absolute().parent)


def require_output(
    out: Path, formats: Sequence[str], names: Callable[[Sequence[str]], list[str]] | None = None
) -> None:
    """What can be wrong with formats and folder without any computing is found before anything else."""
    from femprep.export import require_formats
    from femprep.report.folder.output_folder import require_writable

    require_formats(formats)
    require_writable(out, names(formats) if names else ())
