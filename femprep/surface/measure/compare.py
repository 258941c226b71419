"""Two surfaces (and an image's slices) to one record: distances, in-slice distance, volumes, quality of both."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import Field

from femprep.image import Segmentation
from femprep.mesh.topology import is_consistently_wound, is_manifold
from femprep.model import Plane, Surface
from femprep.model.record import Record
from femprep.surface.measure.distance import SAMPLES, NormalDeviation, Spread, surface_distance
from femprep.surface.measure.inslice import InSliceDistance, in_slice_distance
from femprep.surface.measure.quality import SurfaceQuality, surface_quality
from femprep.surface.measure.sections import grid_planes


class VolumeDifference(Record):
    """Enclosed volumes of two closed surfaces."""

    a: float = Field(description="mm3.")
    b: float = Field(description="mm3.")
    difference: float = Field(description="a - b, mm3.")
    difference_percent: float = Field(description="a - b, % of b.")


class Comparison(Record):
    """How two surfaces differ; lengths in mm, angles in degrees."""

    distance: Spread = Field(description="Both directions with equal weight.")
    a_to_b: Spread
    b_to_a: Spread
    normals: NormalDeviation
    in_slice: InSliceDistance | None = Field(description="None where no slices were given.")
    volume: VolumeDifference | None = Field(description="None where a surface is open.")
    a: SurfaceQuality
    b: SurfaceQuality


def compare_surfaces(
    a: Surface,
    b: Surface,
    *,
    slices: Segmentation | Sequence[Plane] | None = None,
    between: Sequence[Plane] = (),
    samples: int = SAMPLES,
) -> Comparison:
    """Compare two surfaces.

    Parameters
    ----------
    a, b : Surface
        In the same coordinates.
    slices : Segmentation or sequence of Plane, optional
        Image whose slices, or planes, the in-slice distance is measured in.
    between : sequence of Plane
        Measure the distance in space on the kept side of these planes alone, such as ``end_planes(obj)``.
    samples : int
        Points on each surface.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        A surface has no area, or no slice cuts both.

    Examples
    --------
    >>> fp.compare_surfaces(endo, epi).distance.mean > 2.0
    True
    """
    planes = grid_planes(slices.grid) if isinstance(slices, Segmentation) else slices
    distance = surface_distance(a, b, between=between, samples=samples)
    return Comparison(
        distance=distance.both,
        a_to_b=distance.a_to_b,
        b_to_a=distance.b_to_a,
        normals=distance.normals,
        in_slice=None if planes is None else in_slice_distance(a, b, planes),
        volume=_volumes(a, b),
        a=surface_quality(a),
        b=surface_quality(b),
    )


def _volumes(a: Surface, b: Surface) -> VolumeDifference | None:
    if not all(is_manifold(s.cells) and is_consistently_wound(s.cells) for s in (a, b)) or b.volume == 0.0:
        return None
    difference = a.volume - b.volume
    return VolumeDifference(
        a=a.volume, b=b.volume, difference=difference, difference_percent=100.0 * difference / b.volume
    )
