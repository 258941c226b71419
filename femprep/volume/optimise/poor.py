"""An angle and the limits a mesh will be judged by in, the quality below which its elements are improved out."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from femprep.options import CheckOptions
from femprep.volume.optimise.quality import REGULAR_SINE


def poor_quality(angle: float, limits: CheckOptions) -> float:
    """Quality from which on an element has no sharper dihedral angle, degrees, and keeps the limits on its shape."""
    least = [angle, limits.minimum_dihedral, limits.maximum_dihedral]
    needs = [float(np.sin(np.radians(value)) / REGULAR_SINE) for value in least if value is not None]
    if limits.minimum_scaled_jacobian is not None:
        needs.append(spire_mean_ratio(limits.minimum_scaled_jacobian))
    return max(*needs, limits.minimum_mean_ratio or 0.0)


def spire_mean_ratio(scaled_jacobian: float) -> float:
    """Mean ratio of a spire, a regular triangle with three longer edges to its top, of a scaled Jacobian up to 1.

    Of all tetrahedra of a mean ratio the spire has the smallest scaled Jacobian; so one of a larger mean ratio than
    this has a larger scaled Jacobian. (Found by drawing two million at random, not proved.)

    Examples
    --------
    >>> round(spire_mean_ratio(0.2), 3)
    0.586
    """

    def six_volumes(base: float) -> float:
        """Of the spire whose long edges are 1, by the squared length of the others."""
        return float(np.sqrt(3.0) / 2.0 * base * np.sqrt(1.0 - base / 3.0))

    base = brentq(lambda base: np.sqrt(2.0) * six_volumes(base) - scaled_jacobian, 0.0, 1.0)
    return float(12.0 * np.cbrt(0.25 * six_volumes(base) ** 2) / (3.0 + 3.0 * base))
