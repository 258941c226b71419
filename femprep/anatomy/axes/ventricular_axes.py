"""The axes and landmarks of a left ventricle, and from the drift of its RV in, the hand of the heart out.

The hand tells an anatomical heart from its mirror image. Looking from the base to the apex with the right ventricle on
the left-hand side, the outflow tract of the RV, and with it the anterior wall, is at the top; so

    (apex to base) x (LV to RV) points to the front,

and it points to the back where the image was stored mirrored. The front is found from the RV itself: towards the base
its cavity drifts to the front, to the outflow tract. Where it does not drift clearly the hand stays open.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.special import stdtrit

from femprep.errors import InputError, quoted
from femprep.model import FloatArray, Immutable, Notice, readonly
from femprep.model.arrays import mapping
from femprep.model.products import unit_vectors

#: Facets that close the ventricles at the base.
BASE_FACETS: Final = ("base", "mitral", "tricuspid", "aortic", "pulmonary")

#: Where the RV lies from the LV in a patient, LPS: to the right and in front. Used only where nothing else tells.
USUAL_RV: Final = np.array([-1.0, -1.0, 0.0]) / np.sqrt(2.0)
#: The right ventricle tells the hand of a heart where it turns by so much from apex to base, degrees.
_LEAST_DRIFT: Final = 5.0


@dataclass(frozen=True, eq=False)
class VentricularAxes(Immutable):
    """Axes and landmarks of the left ventricle.

    Attributes
    ----------
    apex, base : (3,) arrays
        Where the long axis leaves the epicardium at the apex, and where it crosses the base, mm LPS.
    septal : (3,) array
        Unit vector from the LV to the RV, across the long axis; the middle of the septum.
    mirrored : bool or None
        Whether the heart is a mirror image; ``None`` where nothing tells, and an anatomical heart is assumed.
    insertions : mapping of str to (3,) array
        RV insertion points ``"anterior"`` and ``"inferior"`` half-way between apex and base, where labels show them.
    source : str
        ``"labels"``, ``"mesh"``, ``"given"``.
    info : mapping
        Evidence and what was assumed. JSON-ready.

    Examples
    --------
    >>> axes = fp.ventricular_axes(seg)
    >>> float(((axes.base - axes.apex) ** 2).sum() ** 0.5) > 50.0
    True
    """

    apex: FloatArray
    base: FloatArray
    septal: FloatArray
    mirrored: bool | None = None
    insertions: Mapping[str, FloatArray] = field(default_factory=dict)
    source: str = "given"
    info: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name in ("apex", "base", "septal"):
            value = readonly(getattr(self, name), np.float64, (3,), f"axes {name}")
            if not np.all(np.isfinite(value)):
                raise InputError(f"axes: {name} is {value.tolist()}, expected finite numbers")
            put(self, name, value)
        if self.length < 1e-9:
            raise InputError(f"axes: apex and base are the same point {self.apex.tolist()}; give two points")
        along = self.long_axis
        across = self.septal - (self.septal @ along) * along
        if np.linalg.norm(across) < 1e-6 * max(float(np.linalg.norm(self.septal)), 1e-300):
            raise InputError(f"axes: the septal direction {self.septal.tolist()} runs along the long axis")
        if abs(np.linalg.norm(self.septal) - 1) > 1e-12 or abs(self.septal @ along) > 1e-12:  # a record stays as it is
            put(self, "septal", readonly(unit_vectors(across), np.float64, (3,), "axes septal"))
        points = {
            k: readonly(v, np.float64, (3,), f"axes insertion {k!r}")
            for k, v in mapping(self.insertions, "axes insertions").items()
        }
        put(self, "insertions", MappingProxyType(points))
        put(self, "info", mapping(self.info, "info"))

    def __repr__(self) -> str:
        base, apex = (", ".join(f"{x + 0.0:.4g}" for x in array) for array in (self.base, self.apex))
        return f"VentricularAxes({self.length:.1f} mm from apex ({apex}) to base ({base}))"

    @property
    def length(self) -> float:
        """From apex to base, mm.

        Examples
        --------
        >>> axes = fp.ventricular_axes(seg)
        >>> bool(axes.length > 50.0)
        True
        """
        return float(np.linalg.norm(self.base - self.apex))

    @property
    def long_axis(self) -> FloatArray:
        """Unit vector from apex to base.

        Examples
        --------
        >>> axes = fp.ventricular_axes(seg)
        >>> bool(axes.long_axis @ axes.anterior < 1e-12)
        True
        """
        return (self.base - self.apex) / np.linalg.norm(self.base - self.apex)

    @property
    def anterior(self) -> FloatArray:
        """Unit vector to the anterior wall, across the long axis and the septal direction.

        Examples
        --------
        >>> axes = fp.ventricular_axes(seg)
        >>> axes.anterior.shape
        (3,)
        """
        front = np.cross(self.long_axis, self.septal)
        return -front if self.mirrored else front

    def height(self, points: npt.ArrayLike) -> FloatArray:
        """Distance of points ``(n, 3)`` from the apex along the long axis, mm.

        Examples
        --------
        >>> axes = fp.ventricular_axes(seg)
        >>> axes.height([axes.apex]).tolist()
        [0.0]
        """
        return np.asarray((np.asarray(points, dtype=float) - self.apex) @ self.long_axis)

    def angle(self, points: npt.ArrayLike) -> FloatArray:
        """Angle of points ``(n, 3)`` about the long axis, degrees in [0, 360).

        0 is the middle of the septum, 90 anterior, 180 lateral, 270 inferior; in a mirrored heart too.

        Examples
        --------
        >>> axes = fp.ventricular_axes(seg)
        >>> bool((axes.angle(endo.points) < 360.0).all())
        True
        """
        across = np.asarray(points, dtype=float) - self.apex
        turn = np.degrees(np.arctan2(across @ self.anterior, across @ self.septal)) % 360.0
        return np.where(turn >= 360.0, 0.0, turn)  # a tiny negative angle rounds up to 360

    def turn(self, points: npt.ArrayLike) -> FloatArray:
        """The same angle, degrees in [-180, 180).

        Examples
        --------
        >>> axes = fp.ventricular_axes(seg)
        >>> axes.turn([axes.apex + axes.septal]).round(6).tolist()
        [0.0]
        """
        return np.asarray((self.angle(points) + 180.0) % 360.0 - 180.0)

    def across(self, radians: float) -> FloatArray:
        """Unit vector across the long axis at an angle from the septal direction, towards the anterior wall.

        Examples
        --------
        >>> axes = fp.ventricular_axes(seg)
        >>> bool((axes.across(0.0) == axes.septal).all())
        True
        """
        return np.asarray(np.cos(radians) * self.septal + np.sin(radians) * self.anterior)

    def radius(self, points: npt.ArrayLike) -> FloatArray:
        """Distance of points ``(n, 3)`` from the long axis, mm.

        Examples
        --------
        >>> axes = fp.ventricular_axes(seg)
        >>> bool(axes.radius(epi.points).max() > axes.radius(endo.points).max())
        True
        """
        across = np.asarray(points, dtype=float) - self.apex
        along = self.long_axis
        return np.asarray(np.linalg.norm(across - (across @ along)[:, None] * along, axis=1))

    def record(self) -> dict[str, Any]:
        """Plain mapping, for ``VolumeMesh.info["axes"]`` and the run's record.

        Examples
        --------
        >>> axes = fp.ventricular_axes(seg)
        >>> sorted(axes.record())[:2]
        ['apex', 'base']
        """
        return {
            "apex": self.apex.tolist(),
            "base": self.base.tolist(),
            "septal": self.septal.tolist(),
            "mirrored": self.mirrored,
            "insertions": {name: point.tolist() for name, point in self.insertions.items()},
            "source": self.source,
            "info": dict(self.info),
        }

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> VentricularAxes:
        """The axes of which ``record`` is the record.

        Raises
        ------
        InputError
            It is none.

        Examples
        --------
        >>> axes = fp.ventricular_axes(seg)
        >>> bool(fp.VentricularAxes.from_record(axes.record()).length == axes.length)
        True
        """
        try:
            return cls(**record)
        except TypeError:
            raise InputError(f"axes: {quoted(record)} is no record of axes; give what record() makes") from None


def septum_notices(axes: VentricularAxes) -> list[Notice]:
    """That the side of the septum was assumed, where nothing tells it."""
    if "septal" not in axes.info.get("assumed", ()):
        return []
    words = (
        "nothing tells where the right ventricle lies: the septum was assumed where it usually is in a patient, to the "
        "right and in front"
    )
    return [Notice.of("assumed", words)]


def hand_notices(axes: VentricularAxes) -> list[Notice]:
    """That a heart is a mirror image, or that it was taken not to be one where nothing tells; for its fibres."""
    if axes.mirrored:
        words = (
            "the heart is stored mirrored: its fibres were mirrored with it; --flip mirrors the label map first instead"
        )
        return [Notice.of("assumed", words)]
    if "hand" not in axes.info.get("assumed", ()):
        return []
    words = (
        "the right ventricle does not tell whether the heart is stored mirrored: it was taken not to be. If it is, its "
        "fibres turn the wrong way: --flip, or --mirrored yes, mends that"
    )
    return [Notice.of("assumed", words)]


class Drift(NamedTuple):
    """By how much the RV turns about the long axis from its apical to its basal end.

    Attributes
    ----------
    degrees : float
        Positive from the septal direction towards (apex to base) x (LV to RV).
    error : float
        Standard error of it, from how far the levels lie off a straight line; infinite below three levels.
    levels : int
        Number of levels.
    """

    degrees: float
    error: float
    levels: int

    @property
    def clearness(self) -> float:
        """The drift as a multiple of the largest one that chance gives with 95 % confidence."""
        if not np.isfinite(self.error):
            return 0.0
        chance = float(stdtrit(self.levels - 2, 0.95)) * self.error
        return self.degrees / chance if chance > 0.0 else float(np.copysign(np.inf, self.degrees))

    def record(self) -> dict[str, float | None]:
        """Evidence for ``VentricularAxes.info``."""
        known = np.isfinite(self.clearness)  # levels on a straight line without any error know no bounds
        return {
            "rv_drift_degrees": round(self.degrees, 1),
            "rv_drift_clearness": round(self.clearness, 3) if known else None,
        }


def hand(drift: Drift) -> bool | None:
    """Whether a heart is mirrored, from the drift of its RV; ``None`` where that does not tell.

    It tells where the drift differs from zero with 95 % confidence (Student's t, one-sided) and is at least five
    degrees, which is what a slice that lies 5 mm off does to an RV 55 mm away. On the 200 ACDC maps, all of them
    mirrored, 168 are told rightly, none wrongly, and 32 not: slices near the valves that hold only one half of the RV,
    or RVs that hardly turn. The most a map speaks for the wrong hand is half of what it would need
    (``tests/benchmarks/bench_hand.py``).
    """
    if abs(drift.degrees) < _LEAST_DRIFT or abs(drift.clearness) < 1.0:
        return None
    return drift.degrees < 0


def rv_drift(axes: VentricularAxes, points: FloatArray, weight: FloatArray, level: npt.ArrayLike) -> Drift:
    """By how much the RV turns about the long axis from its apical to its basal end, and how surely.

    Per level (slice, or bin of height) the angle of the RV's centroid is taken, positive from the septal direction
    towards (apex to base) x (LV to RV); the drift is the slope of its straight line over the levels, each weighed with
    its size, times their extent.
    """
    which = np.unique(np.asarray(level), return_inverse=True)[1].ravel()
    size = np.bincount(which, weights=weight)
    across = points - axes.apex

    def mean(value: FloatArray) -> FloatArray:
        return np.bincount(which, weights=weight * value) / size

    front = np.cross(axes.long_axis, axes.septal)
    angle = np.degrees(np.arctan2(mean(across @ front), mean(across @ axes.septal)))
    height = mean(axes.height(points))
    count, step = len(height), height - np.average(height, weights=size)
    spread = float(np.sum(size * step**2))
    if count < 2 or spread == 0.0:
        return Drift(0.0, np.inf, count)
    slope, extent = float(np.sum(size * step * angle)) / spread, float(np.ptp(height))
    if count < 3:
        return Drift(slope * extent, np.inf, count)
    off = angle - np.average(angle, weights=size) - slope * step
    variance = float(np.sum(size * off**2)) / (count - 2)
    return Drift(slope * extent, float(np.sqrt(variance / spread)) * extent, count)
