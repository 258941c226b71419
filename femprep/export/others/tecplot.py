"""A Tecplot file in, the mesh of its first zone out, and how many there are."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Final

from femprep.export.foreign import from_meshio
from femprep.export.through_meshio import meshio_mesh
from femprep.model import VolumeMesh
from femprep.model.notice import Notice, noted

_ZONE: Final = re.compile(r"^\s*ZONE\b", re.MULTILINE | re.IGNORECASE)


def read(path: Path) -> VolumeMesh:
    """Read the first zone; where there are more, a notice says so."""
    mesh = from_meshio(meshio_mesh(path))
    zones = len(_ZONE.findall(path.read_text("latin-1")))
    if zones < 2:
        return mesh
    words = "of {amount} zones the first is read"
    return replace(mesh, info=noted(mesh.info, Notice.of("left out", words, amount=zones)))
