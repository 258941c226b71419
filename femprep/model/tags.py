"""Numbers and names of the regions of a mesh and of its facets: the one table of them."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.model.arrays import BoolArray

#: Numbers of volume regions. No number names two things: regions lie below 100, facets above.
REGION_TAGS: Final[Mapping[str, int]] = MappingProxyType(
    {
        "lv": 1,
        "rv": 2,
        "septum": 3,
        "la": 4,
        "ra": 5,
        "aorta": 6,
        "pulmonary_artery": 7,
        "blood_lv": 11,
        "blood_rv": 12,
        "blood_la": 13,
        "blood_ra": 14,
        "scar": 21,
        "border": 22,
        "fat": 23,
        "edema": 24,
        "hypoperfused": 25,
        "no_reflow": 26,
    }
)

#: Regions of tissue that a second image shows within the wall; ``wall_region`` tells the wall's own region there.
TISSUES: Final = ("scar", "border", "fat", "edema", "hypoperfused", "no_reflow")

#: Numbers of boundary and interface facets.
FACET_TAGS: Final[Mapping[str, int]] = MappingProxyType(
    {
        "endo": 101,
        "epi": 102,
        "base": 103,
        "apex": 104,
        "endo_lv": 111,
        "endo_rv": 112,
        "endo_la": 113,
        "endo_ra": 114,
        "mitral": 121,
        "tricuspid": 122,
        "aortic": 123,
        "pulmonary": 124,
        "veins": 125,
        "aorta_wall": 126,
        "pulmonary_artery_wall": 127,
        "cap_lv": 131,
        "cap_rv": 132,
        "cap_la": 133,
        "cap_ra": 134,
    }
)


#: Key of a mesh's ``info`` for the names of tags that a foreign file brought along: ``{name: number}``.
FOREIGN: Final = "tag_names"
#: The same of facets whose name a region has as well.
FOREIGN_FACETS: Final = "facet_tag_names"
#: How a notice begins of a file's numbers without names that are ours of something.
TAKEN: Final = "numbers to which the file gives no names are taken for femprep's"


def tag_name(number: int) -> str:
    """Name of a region or facet tag; ``"tag_<number>"`` for a number that is not in the tables."""
    for table in (REGION_TAGS, FACET_TAGS):
        for name, value in table.items():
            if value == number:
                return name
    return f"tag_{number}"


def foreign_names(info: Mapping[str, Any]) -> dict[int, str]:
    """Names by number that a foreign file brought along."""
    return {int(number): name for key in (FOREIGN, FOREIGN_FACETS) for name, number in info.get(key, {}).items()}


def names_of(tags: npt.ArrayLike, info: Mapping[str, Any], table: Mapping[str, int]) -> dict[str, int]:
    """Tags that occur by name, in order of their numbers: a file's own names, those of a table, ``tag_<number>``."""
    foreign = foreign_names(info)
    known = {number: name for name, number in table.items()}
    return {foreign.get(tag) or known.get(tag) or f"tag_{tag}": tag for tag in np.unique(np.asarray(tags)).tolist()}


def is_blood(region: npt.ArrayLike) -> BoolArray:
    """Whether numbers of regions are those of blood."""
    return np.asarray(np.isin(region, [number for name, number in REGION_TAGS.items() if name.startswith("blood_")]))


def endocardium(chamber: str, alone: bool = False) -> str:
    """Name of the facets of a chamber's endocardium; one that is the mesh's only one is plainly ``endo``."""
    return "endo" if alone else f"endo_{chamber}"


def endo_tags() -> list[int]:
    """Numbers of all endocardia."""
    return [number for name, number in FACET_TAGS.items() if name == "endo" or name.startswith("endo_")]
