"""A closed wall in, the blood in its cavities out: each closed by flat caps where a plane cuts it open."""

from __future__ import annotations

import numpy as np

from femprep.errors import InputError
from femprep.mesh.topology import border_loops
from femprep.model import FACET_TAGS, BloodPools, IntArray, Plane, Wall, endo_tags, tag_name
from femprep.model.notice import spot
from femprep.wall.joining.planar import flat_cap

#: How far a rim may lie off the plane its cap is in, mm.
_FLAT = 1e-6


def fill_cavities(wall: Wall) -> BloodPools:
    """The blood in the cavities of a wall, closed by flat caps at the planes that cut them.

    Parameters
    ----------
    wall : Wall
        With facets tagged ``endo``, whose blood is ``blood_lv``, or ``endo_lv``, ``endo_rv``...

    Returns
    -------
    BloodPools
        What :func:`~femprep.tetrahedralize` meshes together with the wall.

    Raises
    ------
    InputError
        The wall has no endocardium, or the rim of one lies in no plane of the wall.

    Examples
    --------
    >>> fp.fill_cavities(wall)
    BloodPools(... points, ... outer triangles: lv)
    """
    inner = np.isin(wall.facet_tag, endo_tags())
    if not inner.any():
        raise InputError("the wall has no facets tagged endo..., so there is no cavity for blood; tag its endocardium")
    points, count = [wall.points], len(wall.points)
    outer, tags = [wall.triangles[~inner]], [wall.facet_tag[~inner]]
    cavities, caps = {}, {}
    for tag in np.unique(wall.facet_tag[inner]):
        name = tag_name(int(tag)).removeprefix("endo").removeprefix("_") or "lv"
        own = wall.triangles[wall.facet_tag == tag][:, ::-1]
        parts, planes = [own], []
        for loop in border_loops(own):
            plane_name, plane = _plane_of(wall, loop, name)
            added, cap = flat_cap([wall.points[loop]], plane)
            number = np.concatenate([loop, count + np.arange(len(added))])
            points.append(added)
            count += len(added)
            parts.append(number[cap])
            outer.append(number[cap])
            tags.append(np.full(len(cap), FACET_TAGS[plane_name], dtype=np.int32))
            planes.append(plane)
        cavities[name] = np.concatenate(parts)
        if len(planes) == 1:
            caps[f"cap_{name}"] = planes[0]
    every = np.concatenate(points)
    return BloodPools(every, np.concatenate(outer), np.concatenate(tags), cavities, caps)


def _plane_of(wall: Wall, loop: IntArray, cavity: str) -> tuple[str, Plane]:
    for name, plane in wall.planes.items():
        if np.abs(plane.signed_distance(wall.points[loop])).max() <= _FLAT:
            return name, plane
    raise InputError(
        f"the opening of cavity {cavity!r} near {spot(wall.points[loop].mean(axis=0))} lies in no plane of the wall, "
        "so no flat cap closes it; cut the wall by a plane, or leave blood_pool out"
    )
