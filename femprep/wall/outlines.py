"""What the facets of a finished mesh ought to follow: outlines of labels, by facet tag."""

from __future__ import annotations

from dataclasses import dataclass

from femprep.image import LabelObject
from femprep.model import Surface
from femprep.wall.chambers.openings import Opening


@dataclass(frozen=True, eq=False)
class Outline:
    """What facets of one tag ought to follow.

    Attributes
    ----------
    facets : str
        Name of the facets' tag.
    obj : LabelObject
        Its outlines are those of the labels, as they were repaired.
    beside : tuple of Surface
        Neighbours that are joined to it: near them, also below their last slice, its outline is none of the facets'.
    clear : float
        How near, mm.
    openings : tuple of Opening
        Where holes were cut its outline ends: by the rings that the mesh has.
    """

    facets: str
    obj: LabelObject
    beside: tuple[Surface, ...] = ()
    clear: float = 0.0
    openings: tuple[Opening, ...] = ()
