"""A LabelObject in, the share of its convex hull that it fills out."""

from __future__ import annotations

import numpy as np

from femprep.image.object import LabelObject


def hull_share(obj: LabelObject) -> float:
    """Share of the convex hull of an object's voxels that they fill: 1 of a box, about .8 of a left ventricle.

    Parameters
    ----------
    obj : LabelObject

    Returns
    -------
    float
        Of all grids' spacings the same.
    """
    from scipy.spatial import ConvexHull

    corners = np.stack(np.meshgrid(*3 * [[0, 1]], indexing="ij"), axis=-1).reshape(-1, 3)
    mask = obj.mask
    ends = mask.copy()
    for axis in range(3):
        # What lies between two others of its row is at no corner of the hull.
        rows = np.moveaxis(mask, axis, 0)
        np.moveaxis(ends, axis, 0)[1:-1] &= ~(rows[:-2] & rows[2:])
    voxels = np.argwhere(ends)
    hull = ConvexHull(np.unique((voxels[:, None] + corners).reshape(-1, 3), axis=0))
    return float(np.count_nonzero(mask) / hull.volume)
