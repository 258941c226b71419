"""A LabelObject and its true surface in, figures of every method of fitting a surface to it out."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Final

from pydantic import Field

from femprep.errors import FemprepError, MissingDependencyError
from femprep.image import LabelObject
from femprep.model import Surface
from femprep.model.record import Record
from femprep.surface.fit import fit_surface
from femprep.surface.measure.distance import surface_distance
from femprep.surface.measure.inslice import label_distance
from femprep.surface.measure.quality import surface_quality
from femprep.surface.measure.sections import end_planes
from femprep.surface.reference import METHODS

#: Vertices of femprep's own surfaces: 2,500 triangles.
VERTICES: Final = 1252

Method = Callable[[LabelObject], Surface]


class MethodFigures(Record):
    """What one method made of an object."""

    method: str
    mean: float | None = Field(None, description="Symmetric mean distance to the true surface, mm; None without one.")
    p95: float | None = Field(None, description="95 % of the surfaces lie nearer, mm.")
    max: float | None = Field(None, description="Greatest distance, mm.")
    normals: float | None = Field(None, description="Mean angle between the normals, degrees.")
    in_slice: float | None = Field(None, description="Mean distance to the labels' contours in the slices, mm.")
    triangles: int | None = None
    q_mean: float | None = Field(None, description="Mean of the triangles' quality Q.")
    q_min: float | None = Field(None, description="Least quality Q.")
    sound: bool | None = Field(
        None, description="Closed, outward, one piece, like a sphere, without self-intersection."
    )
    seconds: float | None = Field(None, description="Of a second call.")
    failure: str | None = Field(None, description="Why there is no surface.")


def all_methods(vertices: int = VERTICES) -> Mapping[str, Method]:
    """The methods in use, the paper's and femprep's own, by name; those of femprep with a number of vertices."""
    own = {
        "femprep, paper": partial(fit_surface, method="paper", vertices=vertices),
        "femprep, even": partial(fit_surface, method="even", vertices=vertices),
        "femprep, smooth": partial(fit_surface, method="smooth", vertices=vertices),
    }
    return MappingProxyType({**METHODS, **own})


def measure_method(obj: LabelObject, truth: Surface | None, name: str, method: Method) -> MethodFigures:
    """Fit a surface by one method, twice for the seconds, and measure it.

    Parameters
    ----------
    obj : LabelObject
    truth : Surface or None
        Its true surface. Distances to it are taken between the first and the last slice centre.
    name : str
        The method's name.
    method : callable
        A LabelObject in, a Surface out.
    """
    try:
        method(obj)
    except (FemprepError, MissingDependencyError) as error:
        return MethodFigures(method=name, failure=str(error))
    start = time.perf_counter()
    surface = method(obj)
    seconds = time.perf_counter() - start
    distance = None if truth is None else surface_distance(surface, truth, between=end_planes(obj))
    quality = surface_quality(surface)
    return MethodFigures(
        method=name,
        mean=None if distance is None else distance.both.mean,
        p95=None if distance is None else distance.both.p95,
        max=None if distance is None else distance.both.max,
        normals=None if distance is None else distance.normals.mean,
        in_slice=label_distance(surface, obj).nearest,
        triangles=len(surface.triangles),
        q_mean=quality.q.mean,
        q_min=quality.q.min,
        sound=quality.sound,
        seconds=seconds,
    )


def compare_methods(
    obj: LabelObject, truth: Surface | None = None, methods: Mapping[str, Method] | None = None
) -> list[MethodFigures]:
    """Every method on the same object, side by side.

    Parameters
    ----------
    obj : LabelObject
    truth : Surface, optional
        Its true surface.
    methods : mapping, optional
        Methods by name; :func:`all_methods` by default.
    """
    chosen = all_methods() if methods is None else methods
    return [measure_method(obj, truth, name, method) for name, method in chosen.items()]
