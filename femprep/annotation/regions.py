"""Named facets in, the region of each element out: by what it lies between, and by the file's own regions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from femprep.annotation.reading import Name, Question
from femprep.model import REGION_TAGS, FloatArray, TagArray, VolumeMesh, tag_name
from femprep.model.blocks import block_rows, nodes_of
from femprep.model.facets import facet_triangles
from femprep.volume.ventricles import tidy_regions

#: What an element is that lies between the two surfaces nearest to it.
_BETWEEN = {
    frozenset(("endo_lv", "epi")): "lv",
    frozenset(("endo_rv", "epi")): "rv",
    frozenset(("endo_lv", "endo_rv")): "septum",
    frozenset(("endo_la", "epi")): "la",
    frozenset(("endo_ra", "epi")): "ra",
}
_ALONE = {
    "endo_lv": "lv",
    "endo_rv": "rv",
    "endo_la": "la",
    "endo_ra": "ra",
    "aorta_wall": "aorta",
    "pulmonary_artery_wall": "pulmonary_artery",
    "epi": "lv",
}
#: A region of the file's of which a smaller share lies where its name says is asked about.
_DOUBTFUL = 0.3


def regions_by_place(mesh: VolumeMesh) -> TagArray:
    """Regions of a mesh by the two of its named surfaces that are nearest to each element."""
    names = [name for name in mesh.facet_names if name in _ALONE]
    if not any(name.startswith("endo_") for name in names):
        return np.full(mesh.n_cells, REGION_TAGS["lv"], dtype=np.int32)
    # Nearest nodes are enough to tell which two surfaces are nearest, in a tenth of the time of nearest triangles; and
    # distances of the nodes, of which there is one for five elements, tell those of their elements.
    used = nodes_of(mesh.cells)
    far = np.empty((mesh.n_cells, len(names)))
    for k, name in enumerate(names):
        own = np.full(len(mesh.points), np.nan)
        own[used] = cKDTree(mesh.points[np.unique(facet_triangles(mesh, name))]).query(mesh.points[used])[0]
        for _, block, rows in block_rows(mesh.cells):
            far[rows, k] = own[block].mean(axis=1)
    order = np.argsort(far, axis=1, kind="stable")
    region = np.zeros(mesh.n_cells, dtype=np.int32)
    for i, one in enumerate(names):
        for j, other in enumerate(names):
            if i == j:
                continue
            vessel = next((name for name in (one, other) if name.endswith("_wall")), None)
            outer = vessel is not None and one in (vessel, "epi")
            name = _ALONE[vessel] if outer and vessel else _BETWEEN.get(frozenset((one, other)), _ALONE[one])
            region[(order[:, 0] == i) & (order[:, 1] == j)] = REGION_TAGS[name]
    if len(names) == 1:
        region[:] = REGION_TAGS[_ALONE[names[0]]]
    return tidy_regions(replace(mesh, region=region), region)


def match_regions(
    theirs: TagArray, ours: TagArray, volume: FloatArray, given: dict[int, int]
) -> tuple[TagArray, dict[str, Name], list[Question]]:
    """The file's regions, each named after most of what geometry finds in it, where it was not given a name."""
    out, names, questions = ours.copy(), {}, []
    tags = np.unique(theirs).tolist()
    free = [tag for tag in tags if tag not in given]
    share = np.zeros((len(free), int(ours.max()) + 1))
    for row, tag in enumerate(free):
        own = theirs == tag
        share[row] = np.bincount(ours[own], weights=volume[own], minlength=share.shape[1]) / volume[own].sum()
    best = share.argmax(axis=1) if len(free) else np.empty(0, dtype=np.int64)
    if 2 < len(free) == np.count_nonzero(share.any(axis=0)):
        # As many as geometry finds: each has one of its own, so that a small one is named though it is found in part.
        best = linear_sum_assignment(share, maximize=True)[1]
    for tag in tags:
        if tag in given:
            out[theirs == tag] = given[tag]
            names[tag_name(given[tag])] = Name(1.0, f"the file's region {tag} has this name")
    for row, tag in enumerate(free):
        name, sure = tag_name(int(best[row])), float(share[row, best[row]])
        out[theirs == tag] = best[row]
        names[name] = Name(sure, f"{100 * sure:.0f} % of the file's region {tag} lie there")
        if sure < _DOUBTFUL:
            words = f"the file's region {tag} may be {name} or another"
            questions.append(Question(words, f'names = {{ "{tag}" = "{name}" }}'))
    return out, names, questions
