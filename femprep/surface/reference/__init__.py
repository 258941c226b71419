"""The other methods in use: a label object in, a Surface out, to compare femprep's own with."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Final

from femprep.image import LabelObject
from femprep.model import Surface
from femprep.surface.reference.contours import marching_cubes, marching_cubes_taubin, surface_nets
from femprep.surface.reference.remeshed import remeshed
from femprep.surface.reference.slice_interpolation import slice_interpolation

#: Methods by the name tables print.
METHODS: Final[Mapping[str, Callable[[LabelObject], Surface]]] = MappingProxyType(
    {
        "marching cubes": marching_cubes,
        "marching cubes, Taubin": marching_cubes_taubin,
        "surface nets": surface_nets,
        "slice-wise distance, Taubin": slice_interpolation,
        "slice-wise distance, Akima, Taubin": partial(slice_interpolation, between="akima"),
        "slice-wise distance, Taubin, remeshed": remeshed,
    }
)

__all__ = [
    "METHODS",
    "marching_cubes",
    "marching_cubes_taubin",
    "remeshed",
    "slice_interpolation",
    "surface_nets",
]
