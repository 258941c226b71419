"""Options in, names of the files that a run will write, as far as they are known before it, out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from femprep.cli._apart import same_file
from femprep.errors import FileError
from femprep.export.table import FORMATS
from femprep.report.methods import FILES

#: Files of every mesh, whatever the anatomy and the formats.
_MESH = (
    *("run.json", "quality.json", "report.html", "mesh.vtu", "facets.vtp", "wall.vtp"),
    *("surfaces/lv.vtp", "surfaces/epi.vtp", "cavities/lv.vtp"),
    *FILES,
)


def mesh_names(formats: Sequence[str], solve: str = "none") -> list[str]:
    """Files of ``femprep mesh`` for one label map."""
    solved = () if solve == "none" else ("solution.vtu",)
    return [*_MESH, *solved, *(name for format in formats for name in FORMATS[format].files)]


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
    own = ("run.json", "quality.json", "report.html", *FILES, "mesh.vtu", "facets.vtp")
    return [*own, *(name for format in formats for name in FORMATS[format].files)]


def require_output(
    out: Path, formats: Sequence[str], names: Callable[[Sequence[str]], list[str]] | None = None
) -> None:
    """What can be wrong with formats and folder without any computing is found before anything else."""
    from femprep.export import require_formats
    from femprep.report.folder.output_folder import require_writable

    require_formats(formats)
    require_writable(out, names(formats) if names else ())


def require_lasting(out: Path, inputs: Iterable[Path]) -> None:
    """Make sure that no input is a file of the earlier run in a folder, which a new one there would replace.

    Raises
    ------
    FileError
        One is.
    """
    from femprep.report.folder.earlier import read_earlier

    earlier = [out / name for name in read_earlier(out).files]
    for path in inputs:
        if any(same_file(path, name) for name in earlier):
            raise FileError(
                f"{str(path)!r} is a file of the run in {str(out)!r}, which the new one would replace; give another "
                "folder with -o"
            )
