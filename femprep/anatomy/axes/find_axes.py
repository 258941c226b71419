"""VolumeMesh or Segmentation in, VentricularAxes out: long axis, apex, base, where the RV and the front lie, hand."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from femprep.anatomy.axes.landmarks import axes_from_labels
from femprep.anatomy.axes.ventricular_axes import BASE_FACETS, USUAL_RV, VentricularAxes, hand, rv_drift
from femprep.errors import InputError
from femprep.model import FACET_TAGS, FloatArray, VolumeMesh
from femprep.model.blocks import chosen_rows
from femprep.model.facets import centres_and_areas
from femprep.model.products import unit_vectors

if TYPE_CHECKING:
    from femprep.image.segmentation import Segmentation


def ventricular_axes(
    source: VolumeMesh | Segmentation, *, basal_end: str = "auto", mirrored: str = "auto"
) -> VentricularAxes:
    """Find the axes and landmarks of the left ventricle, and whether the heart is mirrored.

    Parameters
    ----------
    source : VolumeMesh or Segmentation
        A mesh with tagged facets (endocardium, epicardium, base), or a label map with the structures ``lv`` and
        ``myo`` and, for the septum and the hand, ``rv``. Axes that a mesh carries in ``info["axes"]`` are taken.
    basal_end : {"auto", "first", "last"}
        Which end of a label map's stack is basal.
    mirrored : {"auto", "yes", "no"}
        Whether the heart is mirrored: found, or said.

    Returns
    -------
    VentricularAxes

    Raises
    ------
    InputError
        A structure or the facets of a surface are missing, or a word is none of those above.

    Examples
    --------
    >>> fp.ventricular_axes(seg).source
    'labels'
    """
    if mirrored not in ("auto", "yes", "no"):
        raise InputError(f"mirrored is {mirrored!r}; expected auto, yes or no")
    found = _found(source, basal_end)
    if mirrored == "auto":
        return found
    info = {
        **found.info,
        "hand": "given",
        "assumed": [name for name in found.info.get("assumed", ()) if name != "hand"],
    }
    # The insertion points are named by the front, which lies on the other side of a heart of the other hand.
    turned = bool(found.mirrored) != (mirrored == "yes")
    names = {"anterior": "inferior", "inferior": "anterior"} if turned else {}
    insertions = {names.get(name, name): point for name, point in found.insertions.items()}
    return replace(found, mirrored=mirrored == "yes", insertions=insertions, info=info)


def _found(source: VolumeMesh | Segmentation, basal_end: str) -> VentricularAxes:
    if isinstance(source, VolumeMesh):
        if source.info.get("axes"):
            return VentricularAxes.from_record(source.info["axes"])
        return axes_from_mesh(source)
    return axes_from_labels(source, basal_end=basal_end)


def facets_of(mesh: VolumeMesh, *names: str) -> tuple[FloatArray, FloatArray]:
    """Centroids and area vectors (outward) of the facets of some names, ``(f, 3)`` each; empty where there are none."""
    tags = [FACET_TAGS[name] for name in names]
    return centres_and_areas(mesh.points, chosen_rows(mesh.facets, np.isin(mesh.facet_tag, tags)))


def axes_from_mesh(mesh: VolumeMesh) -> VentricularAxes:
    """Axes from the tagged facets of a mesh.

    The long axis is the line through the centroids of the LV endocardium at eight heights above the base plane. An RV
    endocardium gives the septal direction and the hand; without one the septum is assumed where it usually lies in a
    patient, which ``info["assumed"]`` says.
    """
    endo, endo_area = facets_of(mesh, "endo", "endo_lv")
    epi, _ = facets_of(mesh, "epi")
    base, base_area = facets_of(mesh, *BASE_FACETS)
    for name, found in (("endo' or 'endo_lv", endo), ("epi", epi), ("base", base)):
        if not len(found):
            have = ", ".join(mesh.facet_names) or "none"
            raise InputError(f"the mesh has no facets tagged {name!r}, so it has no axes; its facets: {have}")
    up = unit_vectors(base_area.sum(axis=0))
    weight = np.linalg.norm(base_area, axis=1)
    middle = np.average(base, axis=0, weights=weight)
    direction, through = _line(endo, np.linalg.norm(endo_area, axis=1), up)
    top = float((middle - through) @ up)
    foot = through + direction * top / float(direction @ up)
    low = float(((epi - foot) @ direction).min())
    apex = foot + low * direction
    rv, rv_area = facets_of(mesh, "endo_rv")
    info: dict[str, Any] = {}
    if not len(rv):
        info["assumed"] = ["septal", "hand"]
        septal = USUAL_RV if abs(USUAL_RV @ direction) < 0.9 else np.array([-1.0, 0.0, 0.0])
        return VentricularAxes(apex, foot, septal, None, source="mesh", info=info)
    size = np.linalg.norm(rv_area, axis=1)
    septal = np.average(rv, axis=0, weights=size) - apex
    axes = VentricularAxes(apex, foot, septal, None, source="mesh")
    height = axes.height(rv)
    drift = rv_drift(axes, rv, size, np.floor(7.999 * (height - height.min()) / max(float(np.ptp(height)), 1e-9)))
    mirrored = hand(drift)
    info.update(drift.record())
    if mirrored is None:
        info["assumed"] = ["hand"]
    return VentricularAxes(apex, foot, septal, mirrored, source="mesh", info=info)


def _line(points: FloatArray, weight: FloatArray, up: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Direction and a point of the line through the centroids at eight heights, refined once along itself."""
    direction, through = up, np.average(points, axis=0, weights=weight)
    for _ in range(2):
        height = (points - through) @ direction
        bins = np.linspace(height.min(), height.max(), 9)
        which = np.clip(np.digitize(height, bins) - 1, 0, 7)
        centres = []
        for k in range(1, 8):  # the lowest, where the apex closes, leans to whichever side is deeper
            at = which == k
            if np.count_nonzero(at) >= 3:
                centres.append(np.average(points[at], axis=0, weights=weight[at]))
        if len(centres) < 3:
            break
        c = np.array(centres)
        through = c.mean(axis=0)
        direction = np.linalg.svd(c - through)[2][0]
        direction = direction if direction @ up > 0 else -direction
    return direction, through
