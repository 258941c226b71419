"""Names that the file or the user gives in, their places on the boundary out."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from femprep.annotation.reading import Name, Reading
from femprep.annotation.shell import Shell
from femprep.errors import OptionError
from femprep.mesh.elements import FACET_CORNERS
from femprep.mesh.numbering import set_numbers
from femprep.model import FACET_TAGS, REGION_TAGS, Notice, TagArray, VolumeMesh, tag_name
from femprep.model.blocks import block_rows
from femprep.model.tags import endo_tags, foreign_names, names_of

#: Names that other programs give to the same things, in small letters without anything between them.
SYNONYMS: Final[Mapping[str, str]] = {
    **dict.fromkeys(("top", "basal", "basering", "endobase"), "base"),
    **dict.fromkeys(
        ("endocardium", "inner", "lvendocardium", "endolv", "lvendo", "leftventricleendocardium"), "endo_lv"
    ),
    **dict.fromkeys(
        ("endorv", "rvendo", "rvendocardium", "rightventricleendocardium", "rightventricleseptum", "rvseptum"),
        "endo_rv",
    ),
    **dict.fromkeys(("epicardium", "outer", "leftventricleepicardium", "rightventricleepicardium"), "epi"),
    **dict.fromkeys(("leftatriumepicardium", "rightatriumepicardium"), "epi"),
    **dict.fromkeys(("endola", "laendo", "leftatriumendocardium"), "endo_la"),
    **dict.fromkeys(("endora", "raendo", "rightatriumendocardium"), "endo_ra"),
    **dict.fromkeys(("leftventricle",), "lv"),
    **dict.fromkeys(("rightventricle",), "rv"),
    **dict.fromkeys(("leftatrium",), "la"),
    **dict.fromkeys(("rightatrium",), "ra"),
    **dict.fromkeys(("pulmonaryartery",), "pulmonary_artery"),
    **dict.fromkeys(("aortawall",), "aorta_wall"),
    **dict.fromkeys(("pulmonaryarterywall",), "pulmonary_artery_wall"),
    **dict.fromkeys(("mv", "mitralvalve"), "mitral"),
    **dict.fromkeys(("av", "aorticvalve"), "aortic"),
    **dict.fromkeys(("tv", "tricuspidvalve"), "tricuspid"),
    **dict.fromkeys(("pv", "pulmonaryvalve"), "pulmonary"),
}


#: Words in longer names, in the same writing; the first that fits. Rims of vessels have no name of their own.
WORDS: Final = (
    (r"interface.*mitralvalve", "mitral"),
    (r"interface.*tricuspidvalve", "tricuspid"),
    (r"interface.*aorticvalve", "aortic"),
    (r"interface.*pulmonaryvalve", "pulmonary"),
    (r"interface.*(inlet|border)|.*(vein|cava|appendage)border", "veins"),
)
#: Names that are taken for each other.
_ALIKE: Final = (("base", "apex"), ("endo", "endo_lv", "endo_rv", "endo_la", "endo_ra"))


def check_names(mesh: VolumeMesh, names: Mapping[str, str]) -> list[Notice]:
    """Refuse names given for what the file does not have; what is said of those in the place of its own.

    Raises
    ------
    OptionError
        A name or number is that of no facets and no region.
    """
    changed = []
    unknown = dict(names)
    for tag, table in ((mesh.facet_tag, FACET_TAGS), (mesh.region, REGION_TAGS)):
        there = names_of(tag, mesh.info, table)
        for theirs in (*there, *map(str, there.values())):
            unknown.pop(theirs, None)
        tags = list(there.values())
        own, now = _numbers(mesh, tags, {}, table), _numbers(mesh, tags, names, table)
        for theirs, number in there.items():
            if number in own and number in now and own[number] != now[number]:
                changed.append(f"{theirs} is {tag_name(now[number])}")
    for theirs, ours in unknown.items():
        have = ", ".join([*mesh.facet_names, *mesh.region_names]) or "none"
        raise OptionError(f"--name {theirs}={ours}: the file has no facets or regions {theirs!r}; its names are {have}")
    words = f"the names given were taken to be right, not the file's own: {', '.join(changed)}"
    return [Notice.of("assumed", words)] if changed else []


def given_facets(mesh: VolumeMesh, shell: Shell, names: Mapping[str, str]) -> TagArray:
    """Numbers of ``FACET_TAGS`` on the boundary that the file's own facets carry, by our names or given ones."""
    found = np.zeros(len(shell), dtype=np.int32)
    ours = _numbers(mesh, np.unique(mesh.facet_tag).tolist(), names, FACET_TAGS)
    if not ours:
        return found
    own = np.zeros(len(mesh.facet_tag), dtype=np.int32)
    for theirs, wanted in ours.items():
        own[mesh.facet_tag == theirs] = wanted
    for kind, block, rows in block_rows(mesh.facets):
        if kind not in shell.facets:
            continue
        first = next(rows_ for kind_, _, rows_ in block_rows(shell.facets) if kind_ == kind)
        corners = FACET_CORNERS[kind]
        have = shell.facets[kind][:, :corners]
        number = set_numbers(have, block[:, :corners])
        place = np.full(int(number.max(initial=-1)) + 1, -1, dtype=np.int64)
        place[number[: len(have)]] = np.arange(len(have)) + first.start
        row = place[number[len(have) :]]
        named = (row >= 0) & (own[rows] > 0)
        found[row[named]] = own[rows][named]
    return found


def given_regions(mesh: VolumeMesh, names: Mapping[str, str]) -> dict[int, int]:
    """Numbers of ``REGION_TAGS`` by the file's own, as far as our names or given ones tell."""
    return _numbers(mesh, np.unique(mesh.region).tolist(), names, REGION_TAGS)


def _numbers(mesh: VolumeMesh, tags: list[int], names: Mapping[str, str], table: Mapping[str, int]) -> dict[int, int]:
    foreign = foreign_names(mesh.info)
    shown = {number: name for name, number in names_of(tags, mesh.info, table).items()}
    known = {number: name for name, number in table.items()}
    found = {}
    for tag in tags:
        label = foreign.get(tag)
        chosen = names.get(str(tag)) or names.get(shown[tag])
        if chosen is None and label is not None:
            plain = "".join(c for c in label.lower() if c.isalnum())
            chosen = SYNONYMS.get(plain) or next((own for words, own in WORDS if re.match(words, plain)), None)
        if chosen is None and label is None and is_ours(mesh):
            chosen = known.get(tag)
        if chosen is None and table is FACET_TAGS and _named_by_chamber(mesh):
            name = (label or tag_name(tag)).lower()
            chosen = f"endo_{name}" if name in REGION_TAGS else name
        if chosen is not None and chosen in table:
            found[tag] = table[chosen]
    return found


def is_ours(mesh: VolumeMesh) -> bool:
    """Whether the numbers of a mesh are those of our tables: an endocardium is among its facets."""
    return bool(set(endo_tags()) & set(np.unique(mesh.facet_tag).tolist()))


def _named_by_chamber(mesh: VolumeMesh) -> bool:
    """Whether facets bear the names epi and base beside those of chambers, which then are their endocardia."""
    foreign = foreign_names(mesh.info)
    own = {(foreign.get(tag) or tag_name(tag)).lower() for tag in np.unique(mesh.facet_tag).tolist()}
    return {"epi", "base"} <= own and bool({"lv", "rv"} & own)


def with_places(shell: Shell, reading: Reading, at: Mapping[str, tuple[float, float, float]]) -> Reading:
    """A reading with the names that places were given for, each exchanged with the name found there.

    Raises
    ------
    OptionError
        Two places lie on the same facets, or one is nowhere near any.
    """
    tag, names = reading.tag.copy(), dict(reading.names)
    before = reading.tag
    taken: dict[int, str] = {}
    for name, place in at.items():
        # A point in the middle of a cavity, or of a base, is nearer to other facets than to those that are alike.
        alike = next((group for group in _ALIKE if name in group), tuple(FACET_TAGS))
        rows = np.flatnonzero(np.isin(before, [FACET_TAGS[each] for each in alike]))
        rows = rows if len(rows) else np.arange(len(before))
        row = int(cKDTree(shell.centre[rows]).query(np.asarray(place))[1])
        if row == len(rows):  # so far away that its distance is no number
            raise OptionError(f"--at {name} lies at {', '.join(f'{x:.6g}' for x in place)} mm, nowhere near the mesh")
        nearest = int(rows[row])
        there = int(before[nearest])
        if there in taken:
            raise OptionError(f"--at {name} and --at {taken[there]} lie on the same facets; give a point on each")
        taken[there] = name
        wanted = FACET_TAGS[name]
        now = int(tag[nearest])
        if now != wanted:
            tag = np.where(tag == now, wanted, np.where(tag == wanted, now, tag)).astype(np.int32)
            other = names.pop(tag_name(now), None)
            if wanted in np.unique(before) and other is not None:
                names[tag_name(now)] = other
        names[name] = Name(1.0, "the place that was given")
    left = tuple(question for question in reading.questions if not any(f" {name} =" in question.line for name in at))
    # One of two cavities named leaves no question about the other one.
    if {"endo_lv", "endo_rv"} & set(at):
        left = tuple(question for question in left if "endo_lv" not in question.line)
        for ventricle in ("endo_lv", "endo_rv"):
            if ventricle in names and "endo_la" not in names:
                names[ventricle] = Name(1.0, "the place that was given")
    if {"base", "apex"} & set(at):
        left = tuple(question for question in left if " base =" not in question.line)
    return replace(reading, tag=tag, names=names, questions=left)
