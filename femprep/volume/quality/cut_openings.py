"""An opening of the labels and a finished mesh in, whether it was cut there out: several veins have one name."""

from __future__ import annotations

import numpy as np

from femprep.mesh.tangents import tangents
from femprep.model import VolumeMesh
from femprep.model.facets import facet_triangles
from femprep.wall.chambers.openings import REACH, Opening


def is_cut(opening: Opening, mesh: VolumeMesh) -> bool:
    """Whether facets of its name surround the axis of an opening.

    The sides of a hole lie all round its axis, within the opening's radius and no farther along it than holes are
    looked for; those of another hole of that name lie to one side of it, in less than half a turn.
    """
    if opening.name not in mesh.facet_names:
        return False
    normal = opening.plane.normal
    step = mesh.points[facet_triangles(mesh, opening.name)].mean(axis=1) - opening.plane.point
    x, y = tangents(normal[None])[0] @ step.T
    own = (np.abs(step @ normal) < REACH) & (np.hypot(x, y) < opening.radius)
    angle = np.sort(np.arctan2(y[own], x[own]))
    if len(angle) < 3:
        return False
    gaps = np.append(np.diff(angle), angle[0] + 2.0 * np.pi - angle[-1])
    return bool(gaps.max() < np.pi)
