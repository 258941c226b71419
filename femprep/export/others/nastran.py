"""A NASTRAN deck in, its mesh out, where points and elements are defined once."""

from __future__ import annotations

from pathlib import Path

from femprep.export.deck.parts import require_once
from femprep.export.foreign import from_meshio
from femprep.export.through_meshio import meshio_mesh
from femprep.model import VolumeMesh


def read(path: Path) -> VolumeMesh:
    """Read the mesh of a deck.

    Raises
    ------
    InputError
        A point or an element is defined more than once: meshio takes the last point, and all elements.
    """
    mesh = meshio_mesh(path)
    require_once(mesh.points_id.tolist(), "GRID")
    require_once((label for labels in mesh.cells_id for label in labels.tolist()), "element")
    return from_meshio(mesh)
