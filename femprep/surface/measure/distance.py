"""Two surfaces to how far apart they lie: mean, rms, 95 % and greatest distance, each way and both, and normals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from femprep.errors import InputError
from femprep.mesh.measures.triangles import normals
from femprep.mesh.measures.weighted import weighted_percentile
from femprep.mesh.sampling import sample_surface
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import BoolArray, FloatArray, Plane, Surface
from femprep.model.record import Record
from femprep.options import require_number

#: Samples on each surface: on a heart about one in every 0.4 mm square.
SAMPLES = 50_000


class Spread(Record):
    """Distribution of distances, mm."""

    mean: float = Field(description="Mean, mm.")
    rms: float = Field(description="Root of the mean square, mm.")
    p95: float = Field(description="95 % of the area lies closer than this, mm.")
    max: float = Field(description="Greatest, mm; over both directions the Hausdorff distance.")


class NormalDeviation(Record):
    """Angle between the normal of a surface and that of the other at the closest point, degrees."""

    mean: float = Field(description="Mean over both surfaces, degrees.")
    p95: float = Field(description="95 % of the area deviates by less than this, degrees.")


class SurfaceDistance(Record):
    """Distance of two surfaces in space."""

    both: Spread = Field(description="Both directions with equal weight; its mean is the symmetric mean distance.")
    a_to_b: Spread = Field(description="From points of a to the nearest point of b.")
    b_to_a: Spread = Field(description="From points of b to the nearest point of a.")
    normals: NormalDeviation


@dataclass(frozen=True)
class _OneWay:
    distance: FloatArray
    greatest: float
    angle: FloatArray


def surface_distance(
    a: Surface, b: Surface, *, between: Sequence[Plane] = (), samples: int = SAMPLES
) -> SurfaceDistance:
    """Measure how far two surfaces lie apart.

    Points spread evenly over either surface are measured to the nearest point of the other one. The greatest
    distance also takes every vertex into account.

    Parameters
    ----------
    a, b : Surface
        Triangles, or quadrilaterals split into triangles.
    between : sequence of Plane
        Measure only points on the kept side of all these planes (their normals point away from it); the nearest
        point may lie anywhere on the other surface.
    samples : int
        Points on each surface before that restriction.

    Returns
    -------
    SurfaceDistance

    Raises
    ------
    InputError
        A surface has no area, or no point of it lies between the planes.
    OptionError
        ``samples`` is less than one.

    Examples
    --------
    >>> fp.surface_distance(endo, endo).both.mean < 1e-9
    True
    """
    require_number("samples", samples, 1)
    there = _one_way(a, b, between, samples)
    back = _one_way(b, a, between, samples)
    pooled = np.concatenate([there.distance, back.distance])
    angle = np.concatenate([there.angle, back.angle])
    weight = np.concatenate([np.full(len(x.distance), 1.0 / len(x.distance)) for x in (there, back)])
    return SurfaceDistance(
        both=_spread(pooled, max(there.greatest, back.greatest), weight),
        a_to_b=_spread(there.distance, there.greatest),
        b_to_a=_spread(back.distance, back.greatest),
        normals=NormalDeviation(
            mean=float(np.average(angle, weights=weight)), p95=weighted_percentile(angle, weight, 95.0)
        ),
    )


def _one_way(source: Surface, target: Surface, between: Sequence[Plane], samples: int) -> _OneWay:
    spread = sample_surface(source.points, source.triangles, samples)
    kept = _between(spread.points, between)
    if not kept.any():
        raise InputError(f"no point of surface {source.name!r} lies between the planes; are they of the same heart?")
    finder = ClosestFinder(target.points, target.triangles)
    found = finder(spread.points[kept])
    own = normals(source.points, source.triangles)[spread.triangle[kept]]
    other = normals(target.points, target.triangles)[found.triangle]
    sine = np.linalg.norm(np.cross(own, other), axis=1)
    angle = np.degrees(np.arctan2(sine, np.einsum("ij,ij->i", own, other)))
    greatest = float(found.distance.max())
    used = np.unique(source.triangles)
    vertices = source.points[used[_between(source.points[used], between)]]
    if len(vertices):
        greatest = max(greatest, float(finder(vertices).distance.max()))
    return _OneWay(found.distance, greatest, angle)


def _between(points: FloatArray, planes: Sequence[Plane]) -> BoolArray:
    kept = np.ones(len(points), dtype=bool)
    for plane in planes:
        kept &= plane.signed_distance(points) <= 0.0
    return kept


def _spread(distance: FloatArray, greatest: float, weight: FloatArray | None = None) -> Spread:
    weight = np.ones_like(distance) if weight is None else weight
    return Spread(
        mean=float(np.average(distance, weights=weight)),
        rms=float(np.sqrt(np.average(distance**2, weights=weight))),
        p95=weighted_percentile(distance, weight, 95.0),
        max=greatest,
    )
