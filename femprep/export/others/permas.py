"""A PERMAS file in, its mesh out, where it is whole, and nodes and elements are defined once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from femprep.errors import FileError
from femprep.export.deck.parts import require_once
from femprep.export.foreign import from_meshio
from femprep.export.through_meshio import meshio_mesh
from femprep.mesh.elements import ELEMENTS
from femprep.model import VolumeMesh


def read(path: Path) -> VolumeMesh:
    """Read the mesh of a file.

    Raises
    ------
    FileError
        Its structure does not end, or elements have mid-side nodes: PERMAS lists these and corners in turn, and meshio
        takes them as they stand.
    InputError
        A node or an element is defined more than once: meshio takes all of them.
    """
    lines = path.read_text("latin-1").splitlines()
    words = [" ".join(line[1:].split()).upper() for line in lines if line.startswith("$")]
    if words.count("STRUCTURE") > words.count("END STRUCTURE"):
        raise FileError(f"{str(path)!r} is cut short: its $STRUCTURE does not end; copy it again")
    mesh = meshio_mesh(path)
    if turned := [block.type for block in mesh.cells if block.type in ELEMENTS and ELEMENTS[block.type].quadratic]:
        raise FileError(f"{str(path)!r} holds {turned[0]}, whose order of nodes in PERMAS is not known; write another")
    require_once(_labels(lines, "COOR"), "node")
    require_once(_labels(lines, "ELEMENT"), "element")
    return from_meshio(mesh)


def _labels(lines: list[str], keyword: str) -> Iterator[int]:
    """The first number of each row below a keyword; behind ``!`` a row goes on, or is a comment."""
    inside = goes_on = False
    for line in lines:
        if line.startswith("$"):
            inside = line[1:].upper().startswith(keyword)
        elif inside and not goes_on and (first := line.split(maxsplit=1)) and first[0].isdigit():
            yield int(first[0][:18])
        goes_on = line.rstrip().endswith("!") and not line.startswith("!")
