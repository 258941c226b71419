"""A JSON file of contours, as Contours.save or any other program writes it, in, Contours out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydantic import ValidationError

from femprep.errors import FileError, InputError, OptionError
from femprep.image.contour_file import FORMAT, ContourFile
from femprep.image.contours import Contour, ContourPlane, Contours


def read(path: Path, phase: int | None, images: Path | None) -> Contours:
    """Read one phase; see :func:`femprep.read_contours`.

    Raises
    ------
    FileError, InputError, OptionError
    """
    if phase is not None or images is not None:
        raise OptionError(f"{path}: a file of {FORMAT} holds one phase in world points; leave phase and images out")
    try:
        found = ContourFile.model_validate_json(path.read_bytes())
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"])) or "file"
        raise FileError(f"{path}: {where}: {first['msg']}; femprep schema writes the schema, contours.json") from None
    try:
        planes = [
            ContourPlane(p.name, np.array(p.origin), np.array(p.axes).T, np.array(p.spacing), p.thickness, p.short_axis)
            for p in found.planes
        ]
        contours = [Contour(c.surface, np.reshape(c.points, (-1, 3)), c.plane, c.closed) for c in found.contours]
        return Contours(tuple(planes), tuple(contours), found.source or str(path), found.notices)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
