"""A mesh of several chambers in, each element's region out: lv, rv, septum, la, ra."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.mesh.elements import FACET_CORNERS, element_faces
from femprep.mesh.measures.volume_elements import all_centroids
from femprep.mesh.numbering import twins
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import components
from femprep.model import REGION_TAGS, BoolArray, FloatArray, IntArray, Surface, TagArray, VolumeMesh, is_blood
from femprep.model.facets import facet_triangles

#: An element with at least this many faces to one other region joins it: interfaces become smoother.
_SURROUNDED: Final = 3
#: Rounds of smoothing.
_ROUNDS: Final = 6


def label_ventricles(mesh: VolumeMesh, body: Surface | None = None) -> VolumeMesh:
    """Divide the wall of both ventricles into the regions ``lv``, ``rv`` and ``septum``.

    Distances are those of an element's centre from the endocardia and the epicardium; the septum is the part of the
    left ventricle's wall whose other side is the right ventricle:

    - within the left ventricle (``body``): ``septum`` where the RV endocardium is nearer than the epicardium, else
      ``lv``;
    - outside it: ``rv`` where the epicardium is nearer than the LV endocardium, else ``septum`` (tissue that fills a
      gap between the fitted surfaces on the septum's right side).

    Without ``body`` an element lies between the two boundaries that are nearest to it: ``lv`` between the LV
    endocardium and the epicardium, ``rv`` between the RV endocardium and the epicardium, ``septum`` between the
    endocardia. Afterwards elements that are surrounded by another region join it, and pieces cut off from the rest of
    their region join their neighbours, so that each region is in one piece.

    Parameters
    ----------
    mesh : VolumeMesh
        With facets ``endo_lv``, ``endo_rv`` and ``epi``.
    body : Surface, optional
        Closed outer surface of the left ventricle, cavity and myocardium, as the labels give it.

    Returns
    -------
    VolumeMesh
        The same mesh with its regions.

    Raises
    ------
    InputError
        Facets are missing.
    """
    centre = all_centroids(mesh.points, mesh.cells)
    left, right, outer = (_distance(mesh, name, centre) for name in ("endo_lv", "endo_rv", "epi"))
    if body is None:
        choice = np.argmax(np.stack([right, left, outer]), axis=0)
    else:
        inside = ClosestFinder(body.points, body.triangles).signed(centre) < 0.0
        choice = np.where(inside, np.where(right < outer, 2, 0), np.where(outer <= left, 1, 2))
    region = np.array([REGION_TAGS[name] for name in ("lv", "rv", "septum")], dtype=np.int32)[choice]
    return _with_regions(mesh, region)


def label_chambers(mesh: VolumeMesh, body: Surface) -> VolumeMesh:
    """Divide the wall of the whole heart into the regions ``lv``, ``rv``, ``septum``, ``la`` and ``ra``.

    Within the left ventricle (``body``) an element is ``septum`` where the RV endocardium is nearer than the epicardium
    and than the LA's and RA's endocardia, else ``lv``. Outside it, it belongs to the chamber, other than the left
    ventricle, whose endocardium is nearest. Then regions are made smooth and whole as by :func:`label_ventricles`.

    Parameters
    ----------
    mesh : VolumeMesh
        With facets ``endo_lv``, ``endo_rv``, ``endo_la``, ``endo_ra`` and ``epi``.
    body : Surface
        Closed outer surface of the left ventricle, cavity and myocardium.

    Returns
    -------
    VolumeMesh
        The same mesh with its regions.

    Raises
    ------
    InputError
        Facets are missing.
    """
    centre = all_centroids(mesh.points, mesh.cells)
    right, la, ra, outer = (_distance(mesh, name, centre) for name in ("endo_rv", "endo_la", "endo_ra", "epi"))
    inside = ClosestFinder(body.points, body.triangles).signed(centre) < 0.0
    septum = right < np.minimum(outer, np.minimum(la, ra))
    outside = np.argmin(np.stack([right, la, ra]), axis=0) + 2
    choice = np.where(inside, np.where(septum, 1, 0), outside)
    region = np.array([REGION_TAGS[name] for name in ("lv", "septum", "rv", "la", "ra")], dtype=np.int32)[choice]
    return _with_regions(mesh, region)


def _with_regions(mesh: VolumeMesh, region: TagArray) -> VolumeMesh:
    """The mesh with these regions of its wall, tidied; blood stays as it is."""
    return replace(mesh, region=tidy_regions(mesh, np.where(is_blood(mesh.region), mesh.region, region)))


def _distance(mesh: VolumeMesh, name: str, points: FloatArray) -> FloatArray:
    """Distance of points ``(q, 3)`` from the facets of one tag, mm."""
    triangles = facet_triangles(mesh, name)
    if not len(triangles):
        have = ", ".join(mesh.facet_names) or "none"
        raise InputError(f"the mesh has no facets tagged {name!r}, which its regions are told by; its facets: {have}")
    return ClosestFinder(mesh.points, triangles)(points).distance


def tidy_regions(mesh: VolumeMesh, region: TagArray) -> TagArray:
    """Regions of the wall with smoother interfaces, each in one piece; those of blood stay.

    Parameters
    ----------
    mesh : VolumeMesh
    region : (n_cells,) array

    Returns
    -------
    (n_cells,) array
    """
    region = region.copy()
    blood = is_blood(region)
    pairs = neighbours(mesh)
    pairs = pairs[~blood[pairs].any(axis=1)]
    tags = np.unique(region[~blood])
    for _ in range(_ROUNDS):
        beside = _beside(region, pairs, tags)
        most = beside.argmax(axis=1)
        turn = ~blood & (tags[most] != region) & (beside[np.arange(len(region)), most] >= _SURROUNDED)
        if not turn.any():
            break
        region[turn] = tags[most[turn]]
    for _ in range(_ROUNDS):
        stray = _strays(region, pairs, tags) & ~blood
        if not stray.any():
            break
        beside = _beside(region, pairs[~stray[pairs].all(axis=1)], tags)
        walls = np.flatnonzero(~blood)
        beside[walls, np.searchsorted(tags, region[walls])] = 0
        turn = stray & beside.any(axis=1)
        region[turn] = tags[beside[turn].argmax(axis=1)]
    return region


def neighbours(mesh: VolumeMesh) -> IntArray:
    """Pairs of elements that share a face, ``(k, 2)``."""
    found = [np.empty((0, 2), dtype=np.int64)]
    for kind, faces in element_faces(mesh.cells).items():
        found.append(np.stack([faces.element[own] for own in twins(faces.nodes[:, : FACET_CORNERS[kind]])], axis=1))
    return np.concatenate(found)


def _beside(region: TagArray, pairs: IntArray, tags: TagArray) -> IntArray:
    """How many neighbours of each region each element has, ``(n, t)``."""
    number = np.searchsorted(tags, region)  # blood has none, but is in no pair
    one, other = pairs.T
    at = np.concatenate([one * len(tags) + number[other], other * len(tags) + number[one]])
    return np.bincount(at, minlength=len(region) * len(tags)).reshape(len(region), len(tags))


def _strays(region: TagArray, pairs: IntArray, tags: TagArray) -> BoolArray:
    """Elements that are cut off from the largest piece of their region."""
    same = pairs[region[pairs[:, 0]] == region[pairs[:, 1]]]
    label = components(same[:, 0], same[:, 1], len(region))
    count = np.bincount(label)
    stray = np.ones(len(region), dtype=bool)
    for tag in tags:
        own = np.unique(label[region == tag])
        if len(own):
            stray[label == own[np.argmax(count[own])]] = False
    return stray
