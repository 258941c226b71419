"""A mesh and the tissues of an image in; the mesh cut along their outlines, and the tissue of each element, out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from femprep.anatomy.tissue.field import TissueField
from femprep.anatomy.tissue.sampled import levels_of, sample, volumes_of
from femprep.image.segmentation import Segmentation
from femprep.mesh.measures.volume_elements import all_volumes
from femprep.model import FloatArray, IntArray, Notice, VolumeMesh, noted
from femprep.volume.conform import Conformed, conform, require_tetrahedra

#: How often an edge is halved to find where an outline crosses it.
_HALVINGS: Final = 6
#: How often a mesh is cut at most, and the share of its volume by which a tissue may then be off.
_ROUNDS: Final = 6
_CLOSE: Final = 0.01


def conformed(mesh: VolumeMesh, image: Segmentation, names: Sequence[str]) -> tuple[VolumeMesh, IntArray]:
    """Cut a mesh along the outline of each tissue, one after the other.

    Parameters
    ----------
    mesh : VolumeMesh
        Of linear tetrahedra, with ventricular coordinates.
    image : Segmentation
    names : sequence of str
        The tissues.

    Returns
    -------
    mesh : VolumeMesh
    tissue : (m,) array
        Number of the tissue of each element, from 0; -1 for none.
    """
    require_tetrahedra(mesh)
    if mesh.purkinje is not None:
        words = "the Purkinje fibres, which end at points of the mesh before it was cut; grow them anew"
        info = {name: entry for name, entry in mesh.info.items() if name != "purkinje"}
        mesh = replace(mesh, purkinje=None, info=noted(info, Notice.of("left out", words)))
    surfaces: tuple[IntArray, ...] = ()
    tissue = np.full(mesh.n_cells, -1)
    for k in range(len(names)):
        cut = _cut(mesh, image, names, k, surfaces)
        if cut is not None:
            mesh, surfaces = cut.mesh, cut.surfaces
            tissue = np.where(cut.inside & (tissue[cut.parent] < 0), k, tissue[cut.parent])
    return mesh, tissue


def _cut(
    mesh: VolumeMesh, image: Segmentation, names: Sequence[str], k: int, surfaces: tuple[IntArray, ...]
) -> Conformed | None:
    """The mesh cut along the outline of one tissue; ``None`` where it has none.

    Plane faces cut bulges off, and what they lose the outline gives way for, once more each time; once it gave way too
    far, by as much as lies between. A thin border zone that is cut along a scar may lose most of itself at first.
    """
    field = TissueField(mesh, image, names)
    sampled = sample(field)
    wanted = volumes_of(field, sampled)
    wall = np.zeros(mesh.n_cells, dtype=np.bool_)
    for part in field.parts:
        wall[part.cells] = True
    at_points, at_middles = field.at_points(), field.at_middles()
    aimed = wanted.copy()
    best, least = None, np.inf
    tried: dict[bool, tuple[float, float]] = {}
    for _ in range(_ROUNDS):
        levels = levels_of(field, sampled, aimed)
        value, middle = (_beyond(scores - levels, k) for scores in (at_points, at_middles))
        if not (value[mesh.cells["tetra"][wall]].max(axis=1) > 0.0).any():
            break
        cut = conform(mesh, value, middle, wall, surfaces, partial(_crossing, field, levels, k, value))
        miss = wanted[k] - float(all_volumes(cut.mesh.points, cut.mesh.cells)[cut.inside].sum())
        if abs(miss) < least:
            best, least = cut, abs(miss)
        if least < _CLOSE * wanted[k]:
            break
        side = miss > 0.0
        if side in tried and (not side) in tried:
            # The end that stays counts half (Illinois' rule), or the way to it shortens by little each time.
            tried[not side] = tried[not side][0], 0.5 * tried[not side][1]
        tried[side] = float(aimed[k]), miss
        if len(tried) == 2:
            (low, small), (high, large) = tried.values()
            aimed[k] = (low * large - high * small) / (large - small)
        else:
            aimed[k] += miss
    return best


def _crossing(field: TissueField, levels: FloatArray, k: int, value: FloatArray, ends: IntArray) -> FloatArray:
    """Where between pairs of points the outline of a tissue lies, by halving: scores jump where tissue ends."""
    low, high = np.zeros(len(ends)), np.ones(len(ends))
    first = value[ends[:, 0]] > 0.0
    for _ in range(_HALVINGS):
        share = 0.5 * (low + high)
        same = (_beyond(field.between(ends, share) - levels, k) > 0.0) == first
        low, high = np.where(same, share, low), np.where(same, high, share)
    return 0.5 * (low + high)


def _beyond(above: FloatArray, k: int) -> FloatArray:
    """How far each point is above the level of a tissue, and above what it is above those of others."""
    return np.asarray(above[:, k] - np.delete(above, k, axis=1).max(axis=1, initial=0.0))
