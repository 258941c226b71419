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
    voxels = np.argwhere(obj.mask)
    return float(len(voxels) / ConvexHull(np.unique((voxels[:, None] + corners).reshape(-1, 3), axis=0)).volume)
