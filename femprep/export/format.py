"""What is known of one file format: its names and files, who writes it, what it carries, who has read it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from femprep.model import VolumeMesh
from femprep.options import ExportOptions

if TYPE_CHECKING:
    from femprep.export.content import Content

#: Writes a mesh as files into a folder that exists: ``writer(mesh, folder, stem, options)``.
Writer = Callable[[VolumeMesh, Path, str, ExportOptions], None]


@dataclass(frozen=True)
class Format:
    """One file format.

    Attributes
    ----------
    name : str
        Its name on the command line.
    endings : tuple of str
        File endings that mean this format; empty where the name has to be given.
    filename : str
        Where it goes in an output folder; the ending is the one ``write_mesh`` takes.
    home : str
        ``module:function`` of ``femprep.export`` that writes it.
    program : str
        For whom it is.
    carries : str
        What of a mesh it holds.
    elements : str
        Which elements it holds, and what becomes of the others.
    units : str
        In which unit of length it is, and whether the file names it.
    read_by : str
        The programs that read it in our tests.
    unread_by : str
        The programs it is meant for that our tests do not run.
    needs : str
        ``module:function`` that refuses what the format cannot hold, by its content; empty where it holds everything.
    folder : bool
        Whether the path names a folder of files instead of one file.
    beside : tuple of str
        Names of the files it always writes beside that one, or into that folder.
    optional : tuple of str
        Names of files in its folder that not every mesh has, ``{stem}`` for that of its own and ``*`` for anything:
        those of an earlier mesh go when another is written there.
    fixed : tuple of str
        Further such names, which are written with the stem alone that it has in an output folder: readers look for
        them there.
    parts : tuple of str
        Names of files that a reader takes for parts of the mesh: others' are not to stand there.
    mark : tuple of str
        The file of every mesh of femprep's, and words in its head, by which the files beside it are known as its own.
    """

    name: str
    endings: tuple[str, ...]
    filename: str
    home: str
    program: str
    carries: str
    elements: str
    units: str
    read_by: str
    unread_by: str = ""
    needs: str = ""
    folder: bool = False
    beside: tuple[str, ...] = ()
    optional: tuple[str, ...] = ()
    fixed: tuple[str, ...] = ()
    parts: tuple[str, ...] = ()
    mark: tuple[str, str] = ("", "")

    def optional_of(self, stem: str) -> tuple[str, ...]:
        """Names of files that a mesh of that stem may have."""
        return self.optional + (self.fixed if stem == PurePosixPath(self.filename).stem else ())

    @property
    def files(self) -> tuple[str, ...]:
        """Files of an output folder that it always writes; tags and data of a mesh may need more."""
        home = PurePosixPath(self.filename)
        if self.folder:
            return tuple(str(home / name) for name in self.beside)
        return (str(home), *(str(home.with_name(name)) for name in self.beside))

    @property
    def writer(self) -> Writer:
        """The function that writes it."""
        writer: Writer = _load(self.home)
        return writer

    def require(self, content: Content, options: ExportOptions) -> None:
        """Make sure that the format can hold a mesh, made or still to be made.

        Raises
        ------
        InputError
            It cannot; the message says what is in the way.
        """
        if self.needs:
            _load(self.needs)(content, options)


def _load(home: str) -> Any:
    module, function = home.split(":")
    return getattr(import_module(f"femprep.export.{module}"), function)
