"""A public function in, the same function that first looks at what it is given out.

Where a mesh is asked for and the name of its file is given, one line says so. Only who calls by ``femprep`` comes
through this door: the functions among themselves look at nothing twice.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Collection, Mapping
from functools import cache, wraps
from typing import Any, Final

import numpy as np

from femprep.errors import InputError, quoted

#: The nouns that arguments are annotated with, and where one comes from.
NOUNS: Final = {
    "Annotation": "annotate",
    "BloodPools": "fill_cavities",
    "BoundaryPoints": "boundary_points",
    "IntensityImage": "read_image",
    "LabelObject": "Segmentation.object",
    "MatchedSurfaces": "match_surfaces",
    "Opening": "find_openings",
    "Plane": "Plane(point, normal)",
    "Run": "mesh_segmentation",
    "Segmentation": "read_segmentation",
    "SequenceRun": "mesh_sequence",
    "SliceShifts": "estimate_shifts",
    "Surface": "read_surface",
    "Surfaces": "fit_surfaces",
    "VentricularAxes": "ventricular_axes",
    "VolumeMesh": "read_mesh",
    "Wall": "build_wall",
    "WallFields": "WallFields(mesh)",
}
#: What else is looked at: in words, and whether a value is one.
_PLAIN: Final[Mapping[str, tuple[str, Callable[[Any], bool]]]] = {
    "None": ("None", lambda value: value is None),
    "bool": ("True or False", lambda value: isinstance(value, bool | np.bool_)),
    "float": ("a finite number", lambda value: _is_number(value) and bool(np.isfinite(value))),
    "int": ("a whole number", lambda value: _is_number(value) and float(value).is_integer()),
    "str": ("a string", lambda value: isinstance(value, str)),
}
_SEVERAL: Final = re.compile(r"(Mapping|Sequence|list)\[(?:str, )?(\w+)\]")


@cache
def at_door(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which refuses an argument that is neither noun nor number of the kind its annotation says."""
    names = list(inspect.signature(function).parameters)
    asked = {name: ways for name in names if (ways := _ways(function.__annotations__.get(name, "")))}

    @wraps(function)
    def checked(*given: Any, **named: Any) -> Any:
        for name, value in (*zip(names, given), *named.items()):
            if name in asked and not any(_fits(value, way) for way in asked[name]):
                raise InputError(_refusal(function.__name__, name, asked[name], value))
        return function(*given, **named)

    # Whoever sends it to other processes finds it under the name it is called by.
    checked.__module__ = "femprep"
    return checked


def _ways(annotation: str) -> list[str]:
    """What an argument may be; none where something else is among it, of which the door knows nothing."""
    ways = annotation.split(" | ")
    single = [found[2] if (found := _SEVERAL.fullmatch(way)) else way for way in ways]
    return ways if all(each in NOUNS or (each in _PLAIN and each == way) for each, way in zip(single, ways)) else []


def _fits(value: Any, way: str) -> bool:
    if several := _SEVERAL.fullmatch(way):
        if several[1] == "Mapping":
            return isinstance(value, Mapping) and all(_fits(each, several[2]) for each in value.values())
        return isinstance(value, Collection) and all(_fits(each, several[2]) for each in value)
    if way in _PLAIN:
        return _PLAIN[way][1](value)
    return any(kind.__name__ == way for kind in type(value).__mro__ if kind.__module__.startswith("femprep."))


def _is_number(value: Any) -> bool:
    return np.ndim(value) == 0 and np.asarray(value).dtype.kind in "biuf"


def _refusal(function: str, name: str, ways: list[str], value: Any) -> str:
    words = [_PLAIN[way][0] if way in _PLAIN else f"a {way}" for way in ways]
    nouns = [noun for noun in NOUNS if any(noun in re.findall(r"\w+", way) for way in ways)]
    source = f" (one comes from {', '.join(NOUNS[noun] for noun in nouns)})" if nouns else ""
    return f"{function}() takes {' or '.join(words)} as {name!r}{source}, got {quoted(value)}"
