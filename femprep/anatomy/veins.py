"""Mesh of a whole heart in, which of the openings of its atria are which veins out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from femprep.errors import InputError
from femprep.mesh.topology import components
from femprep.model import FloatArray, IntArray, VolumeMesh
from femprep.model.facets import facet_triangles
from femprep.model.notice import spot
from femprep.options.fibres import Vein

#: What an atrium's openings can be; the first two it needs.
VEINS: Final[Mapping[str, tuple[Vein, ...]]] = {
    "la": ("left_pulmonary", "right_pulmonary", "left_appendage"),
    "ra": ("superior_cava", "inferior_cava", "right_appendage"),
}
#: Pulmonary veins this near to the middle between left and right are asked about, mm; a rim smaller than this share of
#: the largest one is a shred.
_MIDDLE, _SHRED = 3.0, 0.05


def name_veins(
    mesh: VolumeMesh,
    atria: Sequence[str],
    told: Mapping[Vein, Sequence[tuple[float, float, float]]],
    centres: Sequence[FloatArray] = (),
) -> dict[Vein, IntArray]:
    """Points of the mesh on the rims of each kind of vein.

    Pulmonary veins are right ones on the side of the right atrium, the superior cava is the one nearest to them. Of
    three left ones the one furthest towards the right ventricle is the appendage; of two, where it alone lies that way.

    Raises
    ------
    InputError
        A vein that an atrium needs is not found, or may be another one.
    """
    points = mesh.points
    middle = {name: _middle(mesh, name) for name in ("la", "ra", "rv")}
    triangles = facet_triangles(mesh, "veins")
    side = [cKDTree(points[np.unique(facet_triangles(mesh, f"endo_{name}"))]) for name in atria]
    found: dict[Vein, IntArray] = {}
    for k, name in enumerate(atria):
        near = np.stack([tree.query(points[triangles].mean(axis=1))[0] for tree in side]) if len(triangles) else None
        own = triangles[near.argmin(axis=0) == k] if near is not None else triangles
        given = [(vein, place) for vein in VEINS[name] for place in told.get(vein, ())]
        if given:
            at = np.array([place for _, place in given])
            nearest = np.asarray(cKDTree(at).query(points[own].mean(axis=1))[1])
            named = [(vein, own[nearest == j]) for j, (vein, _) in enumerate(given)]
        else:
            rims = _rims(points, own, centres)
            centre = [points[rim].mean(axis=(0, 1)) for rim in rims]
            kinds = _sides(centre, middle) if name == "la" else _cavae(centre, points, found)
            named = list(zip(kinds, rims))
        for vein, rim in named:
            found[vein] = np.unique(np.concatenate([found.get(vein, np.empty(0, dtype=np.int64)), rim.ravel()]))
        for vein in VEINS[name][:2]:
            if not len(found.get(vein, ())):
                where = ", ".join(spot(points[rim].mean(axis=(0, 1))) for rim in _rims(points, own, centres)) or "none"
                line = f"{_line(vein)} (openings that are not named lie near: {where})"
                raise InputError(f"fibres of the atria need {vein}, which is not found; {line}")
    return found


def _line(vein: str) -> str:
    return f"name it by a point near its rim: fibres.veins = {{ {vein} = [[x, y, z]] }}"


def _middle(mesh: VolumeMesh, name: str) -> FloatArray | None:
    triangles = facet_triangles(mesh, f"endo_{name}")
    return mesh.points[np.unique(triangles)].mean(axis=0) if len(triangles) else None


def _rims(points: FloatArray, triangles: IntArray, centres: Sequence[FloatArray]) -> list[IntArray]:
    """Triangles of each rim: by the nearest of some centres, or pieces of the surface."""
    if not len(triangles):
        return []
    if len(centres):
        number = np.asarray(cKDTree(np.array(centres)).query(points[triangles].mean(axis=1))[1], dtype=np.int64)
    else:
        count = len(triangles)
        number = components(np.repeat(np.arange(count), 3), count + triangles.ravel(), count + len(points))[:count]
    rims = [triangles[number == k] for k in np.unique(number)]
    largest = max(len(rim) for rim in rims)
    return [rim for rim in rims if len(rim) > _SHRED * largest]


def _sides(at: list[FloatArray], middle: Mapping[str, FloatArray | None]) -> list[Vein]:
    """Names of the left atrium's openings; none where there is no right atrium."""
    left, right, beyond = middle["la"], middle["ra"], middle["rv"]
    if left is None or right is None:
        return []
    way = (left - right) / np.linalg.norm(left - right)
    along = [float((each - left) @ way) for each in at]
    for each, place in zip(along, at):
        if abs(each) < _MIDDLE:
            words = f"the vein near {spot(place)} may be a left or a right one"
            raise InputError(f"fibres of the atria: {words}; {_line('left_pulmonary')}")
    kinds: list[Vein] = ["left_pulmonary" if each > 0 else "right_pulmonary" for each in along]
    lefts = [k for k, each in enumerate(along) if each > 0]
    if len(lefts) > 1 and beyond is not None:
        ahead = [float((at[k] - left) @ (beyond - left)) for k in lefts]
        first = int(np.argmax(ahead))
        if len(lefts) > 2 or (ahead[first] > 0.0 > min(ahead)):
            kinds[lefts[first]] = "left_appendage"
    return kinds


def _cavae(at: list[FloatArray], points: FloatArray, found: Mapping[Vein, IntArray]) -> list[Vein]:
    """Names of the right atrium's openings; none unless there are two, and right pulmonary veins to tell by."""
    if len(at) != 2 or "right_pulmonary" not in found:
        return []
    near = points[found["right_pulmonary"]].mean(axis=0)
    upper = int(np.argmin([np.linalg.norm(each - near) for each in at]))
    return ["superior_cava", "inferior_cava"] if upper == 0 else ["inferior_cava", "superior_cava"]
