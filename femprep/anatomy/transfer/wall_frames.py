"""A part of a wall in; at its elements and points the axes that its coordinates grow along out.

Columns are circumferential, longitudinal and transmural: along the angle, the height and the depth of the wall.
"""

from __future__ import annotations

import numpy as np

from femprep.anatomy.frames import make_frames
from femprep.anatomy.wall_parts import WallPart
from femprep.model import FloatArray


def cell_frames(part: WallPart) -> FloatArray:
    """Axes at the elements ``(k, 3, 3)``, orthonormal; left-handed in a mirrored heart."""
    depth, height, angle = part.gradients
    return _handed(make_frames(height, depth)[0], angle, part.space.volume)


def point_frames(part: WallPart) -> FloatArray:
    """Axes at the points ``(n, 3, 3)``, from those of the elements around each; 0 at mid-side nodes of no corner."""
    depth, height, angle = (part.space.to_points(part.space.to_nodes(gradient)) for gradient in part.gradients)
    weight = np.zeros(len(part.mesh.points))
    weight[part.space.nodes] = 1.0
    return _handed(make_frames(height, depth)[0], angle, weight)


def _handed(frames: FloatArray, angle: FloatArray, weight: FloatArray) -> FloatArray:
    """The frames with their first axis the way the angle grows, in all or in none."""
    along = np.sum(frames[:, :, 0] * angle, axis=1)
    sense = 1.0 if float(np.sum(weight * np.sign(along))) >= 0.0 else -1.0
    return np.asarray(frames * np.array([sense, 1.0, 1.0]))
