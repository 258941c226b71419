"""An XML file in; an error where it declares entities, by which a short text grows without bound, or takes in others.

No format we read needs them. A document type without any, as XDMF has it, is let pass.
"""

from __future__ import annotations

from pathlib import Path
from xml.parsers import expat

from femprep.errors import FileError


class _PrologEndsError(Exception):
    """The first element has been reached: there are no declarations behind it."""


def refuse_entities(path: Path) -> None:
    """Read the prolog of an XML file; what else is wrong with it is left to its reader.

    Raises
    ------
    FileError
        It declares an entity.
    """

    def declared(name: str, *_: object) -> None:
        raise FileError(f"{str(path)!r} declares the XML entity {name!r}, which no such file needs; take it out")

    def ends(*_: object) -> None:
        raise _PrologEndsError

    parser = expat.ParserCreate()
    parser.EntityDeclHandler = declared
    parser.UnparsedEntityDeclHandler = declared
    parser.StartElementHandler = ends
    try:
        with path.open("rb") as file:
            parser.ParseFile(file)
    except (_PrologEndsError, expat.ExpatError, LookupError, ValueError):
        return
