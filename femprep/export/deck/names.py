"""Tag numbers in, names out, and back: the names under which sets, groups and surfaces stand in files."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from femprep.mesh.elements import FACET_CORNERS
from femprep.model import FACET_TAGS, REGION_TAGS, IntArray, VolumeMesh
from femprep.model.blocks import chosen_rows, nodes_of
from femprep.model.notice import Notice, noted
from femprep.model.tags import FOREIGN, TAKEN


def region_names(mesh: VolumeMesh) -> dict[str, int]:
    """Tags of the regions of a mesh by name, in order of their numbers; each name fit for every format."""
    return _named(mesh.region_names)


def facet_names(mesh: VolumeMesh) -> dict[str, int]:
    """Tags of the facets of a mesh by name, in order of their numbers; each name fit for every format."""
    return _named(mesh.facet_names)


def _named(names: Mapping[str, int]) -> dict[str, int]:
    found: dict[str, int] = {}
    for own, tag in names.items():
        name = label(own)
        # Decks know no case: names that differ in it alone, or became equal, get their number behind them.
        taken = {other.lower() for other in found}
        found[f"{name}_{tag}" if name.lower() in taken else name] = tag
    return found


def label(name: str) -> str:
    """A name as sets, groups and files may be called everywhere: letters, digits and ``_``, a letter first."""
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")[:60]
    return plain if plain[:1].isalpha() else f"set_{plain}".rstrip("_")


def tag_number(name: str) -> int | None:
    """Number of a tag by its name in any case, ``None`` for a name that is not ours."""
    for table in (REGION_TAGS, FACET_TAGS):
        if name.lower() in table:
            return table[name.lower()]
    match = re.fullmatch(r"tag_(-?\d+)", name.lower())
    return int(match[1]) if match else None


class Numbers:
    """Numbers for the names a file brings: ours where we know the name, the file's or a free one where not."""

    def __init__(self) -> None:
        self.foreign: dict[str, int] = {}
        #: Numbers of the file's that have no name.
        self.nameless: set[int] = set()
        #: What got another number than the file's, which is ours of something else.
        self.moved: list[str] = []
        #: Numbers without a name that are ours, and what they are here.
        self.taken: dict[int, str] = {}

    def of(self, name: str, own: int | None = None, *, facet: bool = False) -> int:
        """The number of a set called ``name``, to which the file itself gave the number ``own`` (or none)."""
        known = tag_number(name)
        if known is not None:
            return known
        if name not in self.foreign:
            # Numbers of volumes and of surfaces may be the same in a file; each name has one of its own here.
            used = {*self.foreign.values(), *self.nameless, *REGION_TAGS.values(), *FACET_TAGS.values()}
            free = next(n for n in range(201 if facet else 51, 100_000) if n not in used)
            self.foreign[name] = free if own is None or own <= 0 or own in used else own  # MED's families are below 0
            if own in used:
                self.moved.append(f"{name!r} from {own} to {self.foreign[name]}")
        return self.foreign[name]

    def of_tags(self, tags: IntArray, names: Mapping[int, str], *, facet: bool = False) -> IntArray:
        """The numbers of elements or facets to which the file itself gave numbers, and names to some of these."""
        out, present = tags.copy(), np.unique(tags).tolist()
        nameless = [own for own in present if own not in names]
        self.nameless.update(nameless)
        table = {number: name for name, number in (FACET_TAGS if facet else REGION_TAGS).items()}
        self.taken |= {own: table[own] for own in nameless if own in table}
        # A number of the file's that is ours of another name in it would make one of two.
        ours = {tag_number(names[own]) for own in present if own in names}
        for own in present:
            if own in names:
                out[tags == own] = self.of(names[own], None if own in ours else own, facet=facet)
        return out

    @property
    def info(self) -> dict[str, Any]:
        """What a mesh's ``info`` has to hold so that the names are kept, and what is told of their numbers."""
        told = []
        if self.moved:
            words = f"numbers that are femprep's of something else are changed: {', '.join(self.moved)[:300]}"
            told.append(Notice.of("assumed", words))
        if self.taken:
            taken = ", ".join(f"{own} for {name}" for own, name in self.taken.items())
            told.append(Notice.of("assumed", f"{TAKEN}: {taken}"))
        return noted({FOREIGN: dict(self.foreign)} if self.foreign else {}, *told)


def facet_nodes(mesh: VolumeMesh, tag: int, *, corners: bool = False) -> IntArray:
    """Numbers of the points of all facets with a tag, ascending."""
    chosen = chosen_rows(mesh.facets, mesh.facet_tag == tag)
    return nodes_of({kind: block[:, : FACET_CORNERS[kind] if corners else None] for kind, block in chosen.items()})


def region_nodes(mesh: VolumeMesh, tag: int) -> IntArray:
    """Numbers of the points of all elements of a region, ascending."""
    return nodes_of(chosen_rows(mesh.cells, mesh.region == tag))
