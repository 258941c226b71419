"""Contours of two surfaces in the slices of an image to the in-slice distance of the paper's section 2.8."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydantic import Field
from scipy.spatial import cKDTree

from femprep.errors import InputError
from femprep.image import LabelObject
from femprep.mesh.plane_sections import plane_sections
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import BoolArray, FloatArray, Plane, Surface
from femprep.model.record import Record
from femprep.options import require_number
from femprep.surface.measure.sections import label_contours

#: Distance of neighbouring samples along a contour, mm. Two equal contours measure at most half of it apart. The pairs
#: depend on it: the finer the samples, the more nearly parallel two contours must be to be each other's nearest.
STEP = 0.1
#: Least such distance, mm.
_LEAST_STEP = 1e-3


class InSliceDistance(Record):
    """In-slice distance of two surfaces: pairs of points that are each other's nearest in the cross-sections."""

    mean: float = Field(description="Mean over the slices of each slice's mean, mm.")
    std: float = Field(description="Standard deviation over the slices of each slice's mean, mm.")
    pair_mean: float = Field(description="Mean over all pairs of all slices, mm.")
    pair_std: float = Field(description="Standard deviation over all pairs of all slices, mm.")
    max: float = Field(description="Greatest distance of a pair, mm.")
    nearest: float = Field(
        description="Mean distance of all samples, paired or not, to the nearest of the other contour, both ways, mm: "
        "free of the choice of pairs."
    )
    farthest: float = Field(
        description="Greatest distance of any sample, paired or not, to the nearest of the other contour, mm."
    )
    slices: int = Field(description="Number of slices that cut both surfaces.")
    skipped: int = Field(description="Number of slices that cut one of the two only.")
    slice_means: tuple[float, ...] = Field(description="Mean in each of the slices, in their order, mm.")


def in_slice_distance(a: Surface, b: Surface, planes: Sequence[Plane], *, step: float = STEP) -> InSliceDistance:
    """Measure two surfaces against each other in slice planes.

    Both cross-sections are sampled densely; a point of one and a point of the other are a pair where each is the
    nearest sample to the other (section 2.8 of [1]_).

    Parameters
    ----------
    a, b : Surface
    planes : sequence of Plane
        Slice planes, such as ``slice_planes(obj)``.
    step : float
        Distance of neighbouring samples, mm.

    Returns
    -------
    InSliceDistance

    Raises
    ------
    InputError
        No plane cuts both surfaces.
    OptionError
        ``step`` is less than a thousandth of a millimetre.

    References
    ----------
    .. [1] Skrinjar & Bistoquet, Generation of myocardial wall surface meshes from segmented MRI, Int. J. Biomed.
       Imaging, 2009. doi:10.1155/2009/313517

    Examples
    --------
    >>> fp.in_slice_distance(endo, endo, [fp.Plane(cavity.barycentre, [0.0, 0.0, 1.0])]).mean < 0.05
    True
    """
    require_number("step", step, _LEAST_STEP)
    return _measure(
        plane_sections(a.points, a.triangles, planes),
        plane_sections(b.points, b.triangles, planes),
        step,
        f"surfaces {a.name!r} and {b.name!r}",
    )


def label_distance(surface: Surface, obj: LabelObject, *, step: float = STEP) -> InSliceDistance:
    """Measure a surface against the label contours of the object it was made from, in the object's slices.

    Parameters
    ----------
    surface : Surface
    obj : LabelObject
        Its contours run through the midpoints between neighbouring pixels.
    step : float
        Distance of neighbouring samples, mm.

    Returns
    -------
    InSliceDistance

    Raises
    ------
    InputError
        The surface reaches no slice of the object.
    """
    planes, contours = label_contours(obj)
    sections = plane_sections(surface.points, surface.triangles, planes)
    return _measure(sections, contours, step, f"surface {surface.name!r} and object {obj.name!r}")


def missed_distance(surface: Surface, obj: LabelObject) -> float:
    """Greatest distance, mm, of contours from a surface that does not reach their slices; 0 where there are none."""
    planes, contours = label_contours(obj)
    sections = plane_sections(surface.points, surface.triangles, planes)
    missed = [contour for section, loops in zip(sections, contours) if not section for contour in loops]
    if not missed:
        return 0.0
    return float(ClosestFinder(surface.points, surface.triangles)(np.concatenate(missed)).distance.max())


def _measure(
    first: Sequence[list[FloatArray]], second: Sequence[list[FloatArray]], step: float, what: str
) -> InSliceDistance:
    found = [nearest_distances(dense(a, step), dense(b, step)) for a, b in zip(first, second) if a and b]
    if not found:
        raise InputError(f"no slice cuts both {what}; do they lie in the same place and the same coordinates?")
    means = np.array([there[mutual].mean() for there, _, mutual in found])
    pairs = np.concatenate([there[mutual] for there, _, mutual in found])
    nearest = [np.concatenate([distances[way] for distances in found]).mean() for way in (0, 1)]
    return InSliceDistance(
        mean=float(means.mean()),
        std=float(means.std()),
        pair_mean=float(pairs.mean()),
        pair_std=float(pairs.std()),
        max=float(pairs.max()),
        nearest=float(np.mean(nearest)),
        farthest=float(max(max(there.max(), back.max()) for there, back, _ in found)),
        slices=len(found),
        skipped=sum(bool(a) != bool(b) for a, b in zip(first, second)),
        slice_means=tuple(float(m) for m in means),
    )


def nearest_distances(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Nearest neighbours between two sets of points.

    Parameters
    ----------
    a, b : (n, 3) and (m, 3) arrays

    Returns
    -------
    there : (n,) array
        Distance from each point of a to the nearest of b.
    back : (m,) array
        Distance from each point of b to the nearest of a.
    mutual : (n,) bool array
        Whether that nearest point of b has the point of a as its nearest; it has for at least one.
    """
    there, nearest = (np.asarray(found) for found in cKDTree(b).query(a))
    back, nearest_back = (np.asarray(found) for found in cKDTree(a).query(b))
    return there, back, nearest_back[nearest] == np.arange(len(a))


def dense(contours: Sequence[FloatArray], step: float) -> FloatArray:
    """Samples at equal steps of at most ``step`` along contours."""
    out = []
    for contour in contours:
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(contour, axis=0), axis=1))])
        count = max(2, int(np.ceil(along[-1] / step)) + 1)
        at = np.linspace(0.0, along[-1], count)
        closed = np.array_equal(contour[0], contour[-1])
        out.append(np.stack([np.interp(at[: count - closed], along, contour[:, k]) for k in range(3)], axis=1))
    return np.concatenate(out)
