"""A file of contours in, Contours out: a table of readers by kind of file, one file each in this folder."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from glob import glob
from importlib import import_module
from pathlib import Path
from typing import Final, NamedTuple

from femprep.errors import FileError, InputError, OptionError
from femprep.image.contours import Contours
from femprep.image.views import PlaneView
from femprep.model import Notice


class ContourReader(NamedTuple):
    """One kind of file.

    Attributes
    ----------
    name : str
        Kind of file as messages name it.
    recognise : callable
        Path and the first bytes of the file in; whether it is of this kind out.
    module : str
        Module of this folder with ``read(path, phase, images)``: the phase is counted from 0, None where the user gave
        none; ``images`` is the folder of DICOM images that belong to the contours, or None. It returns Contours and
        raises a FemprepError.
    named : bool
        Whether names of structures differ from file to file; its ``read`` takes ``structures`` then.
    """

    name: str
    recognise: Callable[[Path, bytes], bool]
    module: str
    named: bool = False


#: Kinds of files, in the order in which they are tried.
READERS: Final = (
    ContourReader("biv-me GPFile", lambda path, head: b"contour type" in head.partition(b"\n")[0], "gpfile"),
    ContourReader("JSON file", lambda path, head: head.lstrip()[:1] == b"{", "own_file"),
    ContourReader("Segment study", lambda path, head: path.suffix == ".mat" or head[:7] == b"MATLAB ", "segment"),
    ContourReader("cvi42 workspace", lambda path, head: path.suffix.startswith(".cvi42ws"), "cvi42"),
    ContourReader("DICOM structure set", lambda path, head: head[128:132] == b"DICM", "rtstruct", named=True),
)
#: How much of a file tells its kind.
_HEAD: Final = 4096
#: ``SURFACE=NAME[,SURFACE=NAME...]`` behind the name of a file.
_NAMED: Final = re.compile(r"^(?P<file>.+?):(?P<names>\w+=[^,=]+(,\w+=[^,=]+)*)$")


def read_contours(
    path: str | os.PathLike[str],
    *,
    phase: int | None = None,
    images: str | os.PathLike[str] | None = None,
    structures: Mapping[str, str] | None = None,
) -> Contours:
    """Read contours, of any known kind of file.

    Parameters
    ----------
    path : path
        A GPFile of biv-me, with its ``SliceInfoFile.txt`` beside it; a study of Medviso Segment (``.mat``); a
        workspace of Circle cvi42 (``.cvi42wsx``); a DICOM structure set (RTSTRUCT); a JSON file as
        :meth:`Contours.save` writes it.
    phase : int, optional
        Which phase of a file that holds several, from 0.
    images : path, optional
        Folder of the DICOM images that a cvi42 workspace was drawn on; by default the folder of the file.
    structures : mapping of str to str, optional
        Name of the structure of each surface in a DICOM structure set, ``{"lv": "LV_ENDO"}``.

    Returns
    -------
    Contours

    Raises
    ------
    FileError
        The file is missing, damaged, of an unknown kind, or what belongs to it is missing.
    InputError
        It holds no contours.
    OptionError
        It holds several phases and none was chosen, or not that one.

    Examples
    --------
    >>> contours = fp.read_contours("GPFile_000.txt")  # doctest: +SKIP
    >>> contours  # doctest: +SKIP
    Contours(5 short-axis planes, 4 long-axis planes: 8 lv, ...)
    """
    path = Path(path)
    try:
        with path.open("rb") as stream:
            head = stream.read(_HEAD)
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror})") from None
    for reader in READERS:
        if reader.recognise(path, head):
            if structures and not reader.named:
                raise OptionError(f"{path}: a {reader.name} has fixed names of structures; leave structures out")
            module = import_module(f"{__name__}.{reader.module}")
            more = {"structures": structures} if structures else {}
            found: Contours = module.read(path, phase, None if images is None else Path(images), **more)
            return found
    known = ", ".join(reader.name for reader in READERS)
    raise FileError(f"{path}: is no file of contours that femprep reads ({known})")


def contour_files(items: Sequence[str], frame: int | None = None) -> Iterator[tuple[Path, Contours]]:
    """Files of contours as options name them, each with what it holds.

    Parameters
    ----------
    items : sequence of str
        ``FILE`` or ``FILE:SURFACE=NAME[,SURFACE=NAME...]``; a name with ``*`` is a pattern.
    frame : int, optional
        Which phase of files that hold several, from 1.

    Raises
    ------
    FileError, InputError, OptionError
        As for :func:`read_contours`; no file matches a pattern.
    """
    for item in items:
        match = _NAMED.match(item)
        name = match["file"] if match else item
        pairs = dict(pair.split("=") for pair in match["names"].split(",")) if match else None
        files = sorted(glob(name)) if "*" in name else [name]
        if not files:
            raise FileError(f"--contours {name!r}: no file matches; check the pattern")
        for file in files:
            yield Path(file), read_contours(file, phase=None if frame is None else frame - 1, structures=pairs)


def views_beside(items: Sequence[str], frame: int | None = None) -> tuple[list[PlaneView], list[Notice]]:
    """Long-axis views of the contours that options name beside a label map, and what reading them assumed.

    Raises
    ------
    FileError, InputError, OptionError
        As for :func:`contour_files`; a file has no long-axis contours.
    """
    views: list[PlaneView] = []
    notices: list[Notice] = []
    for path, contours in contour_files(items, frame):
        if not (found := contours.views()):
            raise InputError(f"{path}: has no long-axis contours, which alone add to a label map")
        views += found
        notices += contours.notices
    return views, notices
