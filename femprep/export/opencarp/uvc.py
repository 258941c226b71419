"""A mesh with ventricular coordinates in, what openCARP's ``.uvc_*.dat`` files hold out.

Names, ranges and order are those of CARPentry's ``mguvc``, which the scripts around openCARP read: a number per point.

=======  ================================================================================================
z        0 at the apex, 1 at the base
rho      0 on the endocardium, 1 on the epicardium; through the septum from the left to the right one
phi      radians in (-pi, pi]: 0 in the middle of the septum, positive towards the anterior wall
ven      -1 in the left ventricle and the whole septum, 1 in the right ventricle
=======  ================================================================================================

Points of blood alone have ``OUTSIDE`` everywhere. ``mguvc`` is not public: names and ranges are those that public
scripts read; that its ``phi`` grows towards the anterior wall too is not checked.

References
----------
Bayer et al. 2018, doi 10.1016/j.media.2018.01.005
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.export.deck.names import facet_nodes, region_nodes
from femprep.model import FACET_TAGS, REGION_TAGS, BoolArray, VolumeMesh, is_blood

#: A number that no coordinate has.
OUTSIDE: Final = -100
_NEEDED: Final = ("apicobasal", "transmural", "rotational")


def universal(mesh: VolumeMesh) -> dict[str, npt.NDArray[np.float64] | npt.NDArray[np.int64]]:
    """Universal ventricular coordinates of each point by name; empty for a mesh without ventricular coordinates.

    Ours halve the septum, as Cobiveco does; here it belongs to the left ventricle: without that a point of the septum
    and one of the right ventricle's free wall would have the same four numbers. ``phi`` is the angle that ours is:
    the insertions of the right ventricle lie where they lie, not at a quarter of the turn.
    """
    if any(name not in mesh.point_data for name in _NEEDED):
        return {}
    z, depth, turn = (np.array(mesh.point_data[name], dtype=np.float64) for name in _NEEDED)
    phi = 2 * np.pi * np.where(turn > 0.5, turn - 1.0, turn)
    right = np.asarray(mesh.point_data.get("transventricular", np.zeros(len(z)))) > 0.5
    # Scar and other tissue within the wall has the wall's own region beside its own.
    if "wall_region" in mesh.cell_data:
        mesh = replace(mesh, region=mesh.cell_data["wall_region"])
    septum = _points(mesh, REGION_TAGS["septum"])
    septum[region_nodes(mesh, REGION_TAGS["lv"])] = False
    inside = septum.copy()
    inside[facet_nodes(mesh, FACET_TAGS["epi"])] = False
    # Where the septum has no right half, as in a left ventricle alone, it is a wall like any other.
    if right.any():
        depth[inside] = np.where(right, 1.0 - depth / 2, depth / 2)[inside]
    ven = np.where(right & ~septum, 1, -1)
    outside = np.ones(len(z), dtype=bool)
    for tag in np.unique(mesh.region[~is_blood(mesh.region)]):
        outside[region_nodes(mesh, int(tag))] = False
    found = {"z": z, "rho": depth, "phi": phi, "ven": ven}
    return {name: np.where(outside, OUTSIDE, values) for name, values in found.items()}


def _points(mesh: VolumeMesh, tag: int) -> BoolArray:
    flags = np.zeros(len(mesh.points), dtype=bool)
    flags[region_nodes(mesh, tag)] = True
    return flags
