"""VolumeMesh or Segmentation in, VentricularAxes out: long axis, apex, base, where the RV and the front lie, the hand.

The hand tells an anatomical heart from its mirror image. Looking from the base to the apex with the right ventricle on
the left-hand side, the outflow tract of the RV, and with it the anterior wall, is at the top; so

    (apex to base) x (LV to RV) points to the front,

and it points to the back where the image was stored mirrored. The front is found from the RV itself: towards the base
its cavity drifts to the front, to the outflow tract. Where it does not drift clearly the hand stays open.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.special import stdtrit

from femprep.anatomy.frames import normalise
from femprep.errors import InputError
from femprep.model import FACET_TAGS, FloatArray, Notice, VolumeMesh, readonly

if TYPE_CHECKING:
    from femprep.image.segmentation import Segmentation

logger = logging.getLogger(__name__)

#: Facets that close the ventricles at the base.
BASE_FACETS: Final = ("base", "mitral", "tricuspid", "aortic", "pulmonary")

#: Where the RV lies from the LV in a patient, LPS: to the right and in front. Used only where nothing else tells.
USUAL_RV: Final = np.array([-1.0, -1.0, 0.0]) / np.sqrt(2.0)


@dataclass(frozen=True, eq=False)
class VentricularAxes:
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
            put(self, "septal", readonly(normalise(across), np.float64, (3,), "axes septal"))
        points = {k: readonly(v, np.float64, (3,), f"axes insertion {k!r}") for k, v in self.insertions.items()}
        put(self, "insertions", MappingProxyType(points))
        put(self, "info", MappingProxyType(dict(self.info)))

    @property
    def length(self) -> float:
        """From apex to base, mm."""
        return float(np.linalg.norm(self.base - self.apex))

    @property
    def long_axis(self) -> FloatArray:
        """Unit vector from apex to base."""
        return (self.base - self.apex) / np.linalg.norm(self.base - self.apex)

    @property
    def anterior(self) -> FloatArray:
        """Unit vector to the anterior wall, across the long axis and the septal direction."""
        front = np.cross(self.long_axis, self.septal)
        return -front if self.mirrored else front

    def height(self, points: npt.ArrayLike) -> FloatArray:
        """Distance of points ``(n, 3)`` from the apex along the long axis, mm."""
        return np.asarray((np.asarray(points, dtype=float) - self.apex) @ self.long_axis)

    def angle(self, points: npt.ArrayLike) -> FloatArray:
        """Angle of points ``(n, 3)`` about the long axis, degrees in [0, 360).

        0 is the middle of the septum, 90 anterior, 180 lateral, 270 inferior; in a mirrored heart too.
        """
        across = np.asarray(points, dtype=float) - self.apex
        turn = np.degrees(np.arctan2(across @ self.anterior, across @ self.septal)) % 360.0
        return np.where(turn >= 360.0, 0.0, turn)  # a tiny negative angle rounds up to 360

    def radius(self, points: npt.ArrayLike) -> FloatArray:
        """Distance of points ``(n, 3)`` from the long axis, mm."""
        across = np.asarray(points, dtype=float) - self.apex
        along = self.long_axis
        return np.asarray(np.linalg.norm(across - (across @ along)[:, None] * along, axis=1))

    def record(self) -> dict[str, Any]:
        """Plain mapping, for ``VolumeMesh.info["axes"]`` and the run's record."""
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
        """The axes of which ``record`` is the record."""
        return cls(**record)


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


def ventricular_axes(
    source: VolumeMesh | Segmentation, *, basal_end: str = "auto", mirrored: str = "auto"
) -> VentricularAxes:
    """Find the axes and landmarks of the left ventricle, and whether the heart is mirrored.

    Parameters
    ----------
    source : VolumeMesh or Segmentation
        A mesh with tagged facets (endocardium, epicardium, base), or a label map with the structures ``lv`` and
        ``myo`` and, for the septum and the hand, ``rv``. Axes that a mesh carries in ``info["axes"]`` are taken.
    basal_end : {"auto", "first", "last"}
        Which end of a label map's stack is basal.
    mirrored : {"auto", "yes", "no"}
        Whether the heart is mirrored: found, or said.

    Returns
    -------
    VentricularAxes

    Raises
    ------
    InputError
        A structure or the facets of a surface are missing, or a word is none of those above.
    """
    if mirrored not in ("auto", "yes", "no"):
        raise InputError(f"mirrored is {mirrored!r}; expected auto, yes or no")
    found = _found(source, basal_end)
    if mirrored == "auto":
        return found
    info = {
        **found.info,
        "hand": "given",
        "assumed": [name for name in found.info.get("assumed", ()) if name != "hand"],
    }
    # The insertion points are named by the front, which lies on the other side of a heart of the other hand.
    turned = bool(found.mirrored) != (mirrored == "yes")
    names = {"anterior": "inferior", "inferior": "anterior"} if turned else {}
    insertions = {names.get(name, name): point for name, point in found.insertions.items()}
    return replace(found, mirrored=mirrored == "yes", insertions=insertions, info=info)


def _found(source: VolumeMesh | Segmentation, basal_end: str) -> VentricularAxes:
    if isinstance(source, VolumeMesh):
        if source.info.get("axes"):
            return VentricularAxes.from_record(source.info["axes"])
        return axes_from_mesh(source)
    from femprep.anatomy.landmarks import axes_from_labels

    return axes_from_labels(source, basal_end=basal_end)


def facets_of(mesh: VolumeMesh, *names: str) -> tuple[FloatArray, FloatArray]:
    """Centroids and area vectors (outward) of the facets of some names, ``(f, 3)`` each; empty where there are none."""
    tags = [FACET_TAGS[name] for name in names]
    centres, areas, first = [np.empty((0, 3))], [np.empty((0, 3))], 0
    for kind, block in mesh.facets.items():
        chosen = block[np.isin(mesh.facet_tag[first : first + len(block)], tags)]
        corner = mesh.points[chosen[:, : 3 if kind.startswith("triangle") else 4]]
        one, other = ((1, 0), (2, 0)) if corner.shape[1] == 3 else ((2, 0), (3, 1))
        centres.append(corner.mean(axis=1))
        areas.append(np.cross(corner[:, one[0]] - corner[:, one[1]], corner[:, other[0]] - corner[:, other[1]]) / 2)
        first += len(block)
    return np.concatenate(centres), np.concatenate(areas)


def axes_from_mesh(mesh: VolumeMesh) -> VentricularAxes:
    """Axes from the tagged facets of a mesh.

    The long axis is the line through the centroids of the LV endocardium at eight heights above the base plane. An RV
    endocardium gives the septal direction and the hand; without one the septum is assumed where it usually lies in a
    patient, which ``info["assumed"]`` says.
    """
    endo, endo_area = facets_of(mesh, "endo", "endo_lv")
    epi, _ = facets_of(mesh, "epi")
    base, base_area = facets_of(mesh, *BASE_FACETS)
    for name, found in (("endo' or 'endo_lv", endo), ("epi", epi), ("base", base)):
        if not len(found):
            have = ", ".join(mesh.facet_names) or "none"
            raise InputError(f"the mesh has no facets tagged {name!r}, so it has no axes; its facets: {have}")
    up = normalise(base_area.sum(axis=0))
    weight = np.linalg.norm(base_area, axis=1)
    middle = np.average(base, axis=0, weights=weight)
    direction, through = _line(endo, np.linalg.norm(endo_area, axis=1), up)
    top = float((middle - through) @ up)
    foot = through + direction * top / float(direction @ up)
    low = float(((epi - foot) @ direction).min())
    apex = foot + low * direction
    rv, rv_area = facets_of(mesh, "endo_rv")
    info: dict[str, Any] = {}
    if not len(rv):
        info["assumed"] = ["septal", "hand"]
        septal = USUAL_RV if abs(USUAL_RV @ direction) < 0.9 else np.array([-1.0, 0.0, 0.0])
        return VentricularAxes(apex, foot, septal, None, source="mesh", info=info)
    size = np.linalg.norm(rv_area, axis=1)
    septal = np.average(rv, axis=0, weights=size) - apex
    axes = VentricularAxes(apex, foot, septal, None, source="mesh")
    height = axes.height(rv)
    drift = rv_drift(axes, rv, size, np.floor(7.999 * (height - height.min()) / max(float(np.ptp(height)), 1e-9)))
    mirrored = hand(drift)
    info.update(drift.record())
    if mirrored is None:
        info["assumed"] = ["hand"]
    return VentricularAxes(apex, foot, septal, mirrored, source="mesh", info=info)


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


def hand(drift: Drift, least: float = 5.0) -> bool | None:
    """Whether a heart is mirrored, from the drift of its RV; ``None`` where that does not tell.

    It tells where the drift differs from zero with 95 % confidence (Student's t, one-sided) and is at least ``least``
    degrees, which is what a slice that lies 5 mm off does to an RV 55 mm away. On the 200 ACDC maps, all of them
    mirrored, 168 are told rightly, none wrongly, and 32 not: slices near the valves that hold only one half of the RV,
    or RVs that hardly turn. The most a map speaks for the wrong hand is half of what it would need
    (``tests/benchmarks/bench_hand.py``).
    """
    if abs(drift.degrees) < least or abs(drift.clearness) < 1.0:
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


def _line(points: FloatArray, weight: FloatArray, up: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Direction and a point of the line through the centroids at eight heights, refined once along itself."""
    direction, through = up, np.average(points, axis=0, weights=weight)
    for _ in range(2):
        height = (points - through) @ direction
        bins = np.linspace(height.min(), height.max(), 9)
        which = np.clip(np.digitize(height, bins) - 1, 0, 7)
        centres = []
        for k in range(1, 8):  # the lowest, where the apex closes, leans to whichever side is deeper
            at = which == k
            if np.count_nonzero(at) >= 3:
                centres.append(np.average(points[at], axis=0, weights=weight[at]))
        if len(centres) < 3:
            break
        c = np.array(centres)
        through = c.mean(axis=0)
        direction = np.linalg.svd(c - through)[2][0]
        direction = direction if direction @ up > 0 else -direction
    return direction, through
