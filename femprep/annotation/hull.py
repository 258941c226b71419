"""Points of a part of the boundary in, their convex hull out."""

from __future__ import annotations

from scipy.spatial import ConvexHull, QhullError

from femprep.annotation.reading import NoReading
from femprep.model import FloatArray


def hull_of(points: FloatArray) -> ConvexHull:
    """Convex hull of points in space or in a plane.

    Raises
    ------
    NoReading
        They lie in a plane, or on a line: a mesh that is flat, or of elements without volume, has such parts.
    """
    try:
        return ConvexHull(points)
    except QhullError:
        raise NoReading(f"{len(points)} points that should enclose something lie in a plane or on a line") from None
