"""The file of names that PyAnsys Heart puts beside a ``.vtu`` in, names of surfaces and volumes by number out."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Final

from femprep.errors import FileError
from femprep.export.foreign import ForeignMesh

#: Its two tables, and the dimension of what each names.
_TABLES: Final = {"_surface_id_to_name": 2, "_volume_id_to_name": 3}


def with_namemap(mesh: ForeignMesh, path: Path) -> ForeignMesh:
    """A mesh with the names that ``NAME.namemap.json`` beside it holds, where it is there.

    Raises
    ------
    FileError
        The file of names is no table of numbers and names.
    """
    names = path.with_suffix(".namemap.json")
    if not names.is_file():
        return mesh
    try:
        tables = json.loads(names.read_text(encoding="utf-8"))
        found = {
            dimension: {int(number): str(name) for number, name in tables.get(key, {}).items()}
            for key, dimension in _TABLES.items()
        }
    except (ValueError, AttributeError) as error:
        raise FileError(f"{str(names)!r} is no table of numbers and names ({error}); mend it or move it away") from None
    return replace(mesh, names=found)
