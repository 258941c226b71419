"""Points in a wall between two ellipsoids of revolution in, the analytic fibre field there out: the check of the rules.

The wall is filled with ellipsoids whose semi-axes change linearly with the depth t, as in the benchmark of Land et al.
2015 (doi 10.1098/rspa.2015.0641): x = a(t) sin u cos v, y = a(t) sin u sin v, z = -b(t) cos u. Fibres lie in the
tangent plane of the ellipsoid through the point, at the helix angle from the parallel (constant u) to the meridian.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from femprep.anatomy.frames import make_frames, rotate
from femprep.errors import InputError
from femprep.model import FloatArray


@dataclass(frozen=True)
class EllipsoidWall:
    """A thick ellipsoid about the z axis, apex down, centred at the origin.

    Attributes
    ----------
    endo, epi : pairs of float
        Semi-axes across and along z, mm.
    """

    endo: tuple[float, float]
    epi: tuple[float, float]

    def __post_init__(self) -> None:
        if not 0 < self.endo[0] < self.epi[0] or not 0 < self.endo[1] < self.epi[1]:
            raise InputError(f"semi-axes of endocardium {self.endo} and epicardium {self.epi}: expected 0 < endo < epi")

    def depth(self, points: npt.ArrayLike) -> FloatArray:
        """Relative depth t of points ``(n, 3)``: 0 on the endocardium, 1 on the epicardium; Newton from the middle."""
        points = np.asarray(points, dtype=float)
        rho, z = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
        da, db = self.epi[0] - self.endo[0], self.epi[1] - self.endo[1]
        t = np.full(len(points), 0.5)
        for _ in range(50):
            a, b = self.endo[0] + t * da, self.endo[1] + t * db
            value = (rho / a) ** 2 + (z / b) ** 2 - 1
            step = value / (-2 * (rho**2 / a**3 * da + z**2 / b**3 * db))
            t = t - step
            if np.abs(step).max(initial=0.0) < 1e-14:
                break
        return t

    def frames(self, points: npt.ArrayLike) -> FloatArray:
        """Frames ``(n, 3, 3)`` with columns circumferential, longitudinal (to the base), transmural (outward)."""
        points = np.asarray(points, dtype=float)
        t = self.depth(points)
        a = self.endo[0] + t * (self.epi[0] - self.endo[0])
        b = self.endo[1] + t * (self.epi[1] - self.endo[1])
        normal = points / np.stack([a, a, b], axis=1) ** 2
        upward = np.broadcast_to(np.array([0.0, 0.0, 1.0]), points.shape)
        # The upward vector made tangential is the meridian.
        return make_frames(upward, normal)[0]

    def triads(
        self, points: npt.ArrayLike, endo_angle: float = 60.0, epi_angle: float = -60.0, sheet_angle: float = 0.0
    ) -> FloatArray:
        """Fibre, sheet and normal (columns) at points, the helix angle linear in depth; angles in degrees."""
        t = self.depth(points)
        return rotate(self.frames(points), (1 - t) * endo_angle + t * epi_angle, np.full(len(t), sheet_angle))
