"""What of a mesh, made or still to be made, decides whether a format can hold it."""

from __future__ import annotations

from dataclasses import dataclass

from femprep.errors import InputError
from femprep.export.deck.names import facet_names
from femprep.model import VolumeMesh, is_blood


@dataclass(frozen=True)
class Content:
    """Kinds of things a mesh has.

    Attributes
    ----------
    elements : tuple of str
        Element types.
    facets : tuple of str
        Names of facet tags.
    fibres, blood : bool
        Whether it has fibres; blood pools.
    """

    elements: tuple[str, ...]
    facets: tuple[str, ...]
    fibres: bool = False
    blood: bool = False


def content_of(mesh: VolumeMesh) -> Content:
    """What a mesh has."""
    blood = bool(is_blood(mesh.region).any())
    return Content(tuple(mesh.cells), tuple(facet_names(mesh)), "fiber" in mesh.cell_data, blood)


def require_elements(mesh: VolumeMesh) -> None:
    """Refuse a mesh of no elements.

    Raises
    ------
    InputError
    """
    if not mesh.n_cells:
        raise InputError("the mesh has no volume elements; give one of tetrahedra, wedges or hexahedra")
