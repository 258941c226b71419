"""Tag numbers in, names out, and back: the names under which sets, groups and surfaces stand in files."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

import numpy as np

from femprep.mesh.elements import FACET_CORNERS
from femprep.model import FACET_TAGS, REGION_TAGS, IntArray, VolumeMesh
from femprep.model.blocks import chosen_rows, nodes_of
from femprep.model.notice import Notice, noted
from femprep.model.tags import FOREIGN, FOREIGN_FACETS, TAKEN

#: How many characters of a name are written: Abaqus and CalculiX take 80, less what is put around it.
_LONGEST: Final = 60
#: How many changed names are told.
_SHOWN: Final = 10


def region_names(mesh: VolumeMesh) -> dict[str, int]:
    """Tags of the regions of a mesh by name, in order of their numbers; each name fit for every format."""
    return {written: tag for written, tag, _, facet in _named(mesh) if not facet}


def facet_names(mesh: VolumeMesh) -> dict[str, int]:
    """Tags of the facets of a mesh by name, in order of their numbers; each name fit for every format."""
    return {written: tag for written, tag, _, facet in _named(mesh) if facet}


def renamed(mesh: VolumeMesh) -> list[Notice]:
    """What is told of regions and facets whose names no deck could hold, and which are written under others."""
    changed = [f"{own!r} as {written!r}" for written, _, own, _ in _named(mesh) if written != own]
    if not changed:
        return []
    more = f" and {len(changed) - _SHOWN} more" if len(changed) > _SHOWN else ""
    words = f"names are changed to such as every format holds: {', '.join(changed[:_SHOWN])}{more}"
    return [Notice.of("repaired", words)]


def _named(mesh: VolumeMesh) -> Iterator[tuple[str, int, str, bool]]:
    """Of each region, then of each kind of facets: its name in files, number, own name, and whether it is of facets."""
    taken: set[str] = set()
    for names, facet in ((mesh.region_names, False), (mesh.facet_names, True)):
        here: set[str] = set()
        for own, tag in names.items():
            name = label(own, tag)
            # Decks know no case, and some have one table for regions and facets: names that differ in case alone, or
            # became equal, get their number behind them. What has no name is called by its number in either.
            end = f"_{tag}".replace("-", "_")
            while name.lower() in (here if own == f"tag_{tag}" else taken):
                name = name[: _LONGEST - len(end)] + end
                end += "_"
            here.add(name.lower())
            taken |= here
            yield name, tag, own, facet


def label(name: str, number: int) -> str:
    """A name as sets, groups and files may be called everywhere: letters, digits and ``_``, a letter first.

    Letters lose their accents; a name of none but other letters has its number instead.
    """
    bare = unicodedata.normalize("NFKD", name.replace("ß", "ss"))
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", "".join(c for c in bare if not unicodedata.combining(c))).strip("_")
    plain = plain[:_LONGEST].rstrip("_") or str(number).replace("-", "")
    return plain if plain[0].isalpha() else f"set_{plain}"


def tag_number(name: str, facet: bool) -> int | None:
    """Number of a region's or of facets' name in any case, ``None`` for a name that is not ours."""
    table = FACET_TAGS if facet else REGION_TAGS
    if name.lower() in table:
        return table[name.lower()]
    match = re.fullmatch(r"tag_(-?\d+)", name.lower())
    return int(match[1]) if match else None


class Numbers:
    """Numbers for the names a file brings: ours where we know the name, the file's or a free one where not.

    Regions and facets may have the same name in a file. They do not have the same number here.
    """

    def __init__(self) -> None:
        self.regions: dict[str, int] = {}
        self.facets: dict[str, int] = {}
        #: Numbers of the file's that have no name.
        self.nameless: set[int] = set()
        #: What got another number than the file's, which is ours of something else.
        self.moved: list[str] = []
        #: Numbers without a name that are ours, and what they are here.
        self.taken: dict[int, str] = {}

    def of(self, name: str, own: int | None = None, *, facet: bool = False) -> int:
        """The number of a set called ``name``, to which the file itself gave the number ``own`` (or none)."""
        known, foreign = tag_number(name, facet), self.facets if facet else self.regions
        if known is not None:
            return known
        if name not in foreign:
            # Numbers of volumes and of surfaces may be the same in a file; each name has one of its own here.
            used = {*self.regions.values(), *self.facets.values(), *self.nameless}
            used |= {*REGION_TAGS.values(), *FACET_TAGS.values()}
            free = next(n for n in range(201 if facet else 51, 100_000) if n not in used)
            foreign[name] = free if own is None or own <= 0 or own in used else own  # MED's families are below 0
            if own in used:
                self.moved.append(f"{name!r} from {own} to {foreign[name]}")
        return foreign[name]

    def of_tags(self, tags: IntArray, names: Mapping[int, str], *, facet: bool = False) -> IntArray:
        """The numbers of elements or facets to which the file itself gave numbers, and names to some of these."""
        out, present = tags.copy(), np.unique(tags).tolist()
        nameless = [own for own in present if own not in names]
        self.nameless.update(nameless)
        table = {number: name for name, number in (FACET_TAGS if facet else REGION_TAGS).items()}
        self.taken |= {own: table[own] for own in nameless if own in table}
        # A number of the file's that is ours of another name in it would make one of two.
        ours = {tag_number(names[own], facet) for own in present if own in names}
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
        shared = {name: number for name, number in self.facets.items() if name in self.regions}
        names = {FOREIGN: {**self.facets, **self.regions}, FOREIGN_FACETS: shared}
        return noted({key: own for key, own in names.items() if own}, *told)


def facet_nodes(mesh: VolumeMesh, tag: int, *, corners: bool = False) -> IntArray:
    """Numbers of the points of all facets with a tag, ascending."""
    chosen = chosen_rows(mesh.facets, mesh.facet_tag == tag)
    return nodes_of({kind: block[:, : FACET_CORNERS[kind] if corners else None] for kind, block in chosen.items()})


def region_nodes(mesh: VolumeMesh, tag: int) -> IntArray:
    """Numbers of the points of all elements of a region, ascending."""
    return nodes_of(chosen_rows(mesh.cells, mesh.region == tag))


def held(names: Iterable[str]) -> list[str]:
    """Facets that a step holds: the base, and that of the right ventricle where it has its own."""
    own = set(names)
    return [name for name in ("base", "base_rv") if name in own]
