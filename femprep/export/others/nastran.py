"""A NASTRAN deck in, its mesh out, where points and elements are defined once."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import Final

import numpy as np

from femprep.errors import FileError
from femprep.export.deck.parts import require_once
from femprep.export.foreign import from_meshio
from femprep.export.through_meshio import meshio_mesh
from femprep.model import VolumeMesh

#: What meshio passes over: other files, and the axes of all points that name none.
_OTHER: Final = re.compile(r"^\s*(INCLUDE|GRDSET)\b", re.MULTILINE | re.IGNORECASE)

#: The D of a number such as 1.0D+01.
_FORTRAN: Final = re.compile(r"(?<=[\d.])D(?=[-+]?\d)")


def read(path: Path) -> VolumeMesh:
    """Read the mesh of a deck.

    Raises
    ------
    FileError
        Points are in axes of their own, or the deck takes in other files.
    InputError
        A point or an element is defined more than once: meshio takes the last point, and all elements.
    """
    text = path.read_text("latin-1")
    if other := _OTHER.search(text):
        raise FileError(f"{str(path)!r}: {other[1].upper()} is not read; write the deck without it")
    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder) / "mesh.bdf"
        plain.write_text(_FORTRAN.sub("E", text.upper()), "ascii", "replace")  # meshio knows capitals and E alone
        mesh = meshio_mesh(plain, path)
    if np.any(mesh.point_data.pop("nastran:ref", 0)):  # what meshio calls the number of the axes
        raise FileError(f"{str(path)!r} has points in axes of their own (CP of GRID); write them in the basic ones")
    require_once(mesh.points_id.tolist(), "GRID")
    require_once((label for labels in mesh.cells_id for label in labels.tolist()), "element")
    return from_meshio(mesh)
