"""Regions told from the file's own numbers in, facets that follow from them out: walls of vessels, rings of valves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from femprep.annotation.reading import Name
from femprep.annotation.shell import Shell
from femprep.annotation.vein_ends import plane_along
from femprep.model import FACET_TAGS, REGION_TAGS, BoolArray, TagArray, VolumeMesh

#: What vessels told from the file's own numbers name: their wall, the ring they begin at; and the cavity below.
_VESSELS = {
    "aorta": ("aorta_wall", "aortic", "endo_lv"),
    "pulmonary_artery": ("pulmonary_artery_wall", "pulmonary", "endo_rv"),
}
#: Rings of valves between regions told so: the ventricle and the atrium whose tissue meets there.
_ANNULI = {"mitral": ("lv", "la"), "tricuspid": ("rv", "ra")}
#: A ring reaches so far below the plane in which the vessel's wall begins, and from where atrium and ventricle meet,
#: mm.
_RIM, _ANNULUS = 2.0, 1.75
#: No ring of a vessel's valve reaches further from its wall, mm.
_BESIDE = 8.0
#: What was taken for a vessel's wall, but belongs to the heart, is its ring so near to it, mm.
_STRAY = 5.0


def facets_of_regions(mesh: VolumeMesh, shell: Shell, names: dict[str, Name]) -> VolumeMesh:
    """Where the file's own regions tell vessels, their whole boundary is theirs; rings are where regions meet."""
    tag = mesh.facet_tag.copy()
    element_region = mesh.region[shell.element]
    for region, (facet, ring, endo) in _VESSELS.items():
        if region not in names or "region" not in names[region].because:
            continue
        own = element_region == REGION_TAGS[region]
        nodes = np.unique(shell.triangles[own[shell.facet_of]])
        near = np.full(len(shell), np.inf)
        if len(nodes):
            near = np.asarray(cKDTree(mesh.points[nodes]).query(shell.centre)[0])
        # What was taken for the vessel, but belongs to the heart, is the ring it begins at, or the outside.
        stray = (tag == FACET_TAGS[facet]) & ~own
        tag[stray] = np.where(near[stray] < _STRAY, FACET_TAGS[ring], FACET_TAGS["epi"])
        inner = np.isin(tag, [FACET_TAGS[ring], FACET_TAGS[endo]]) & ~own & ~stray
        tag[inner] = np.where(_below(shell, own, inner) & (near[inner] < _BESIDE), FACET_TAGS[ring], FACET_TAGS[endo])
        tag[own] = FACET_TAGS[facet]
    for ring, (ventricle, atrium) in _ANNULI.items():
        if all(name in names and "region" in names[name].because for name in (ventricle, atrium)):
            _annulus(tag, shell, element_region, ring, ventricle, atrium)
    return replace(mesh, facet_tag=tag)


def _below(shell: Shell, vessel: BoolArray, inner: BoolArray) -> BoolArray:
    """Which inner facets lie closely below the plane in which a vessel's wall begins: its valve's ring is flat."""
    one, other = shell.pairs.T
    begin = shell.pairs[(vessel[one] & inner[other]) | (inner[one] & vessel[other])].ravel()
    if not len(begin):
        return np.zeros(np.count_nonzero(inner), dtype=bool)
    up = shell.centre[begin[vessel[begin]]].mean(axis=0) - shell.centre[begin[~vessel[begin]]].mean(axis=0)
    centre, normal = plane_along(shell.centre[begin], up)
    return np.asarray((shell.centre[inner] - centre) @ normal > -_RIM)


def _annulus(tag: TagArray, shell: Shell, region: TagArray, ring: str, ventricle: str, atrium: str) -> None:
    """The ring of an atrioventricular valve lies in the cavities, where the atrium's tissue meets the ventricle's."""
    inner = np.isin(tag, [FACET_TAGS[name] for name in (ring, f"endo_{ventricle}", f"endo_{atrium}")])
    above = region == REGION_TAGS[atrium]
    below = np.isin(region, [REGION_TAGS[name] for name in (ventricle, "septum")])
    one, other = shell.pairs.T
    meet = inner[one] & inner[other] & ((above[one] & below[other]) | (below[one] & above[other]))
    if not meet.any():
        return
    own = tag == FACET_TAGS[ring]
    tag[own & above] = FACET_TAGS[f"endo_{atrium}"]
    tag[own & ~above] = FACET_TAGS[f"endo_{ventricle}"]
    tag[inner & (shell.along(shell.pairs[meet].ravel(), _ANNULUS, inner) <= _ANNULUS)] = FACET_TAGS[ring]
