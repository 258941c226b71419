"""A public function in, the same function that first looks at what it is given out.

Where a mesh is asked for and the name of its file is given, one line says so. Only who calls by ``femprep`` comes
through this door: the functions among themselves look at nothing twice.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import cache, wraps
from numbers import Real
from typing import Any, Final, NamedTuple

import numpy as np

from femprep.errors import InputError, quoted

#: The nouns that arguments are annotated with, and where one comes from.
NOUNS: Final = {
    "Annotation": "annotate",
    "BloodPools": "fill_cavities",
    "BoundaryPoints": "boundary_points",
    "Contours": "read_contours",
    "IntensityImage": "read_image",
    "LabelObject": "Segmentation.object",
    "MatchedSurfaces": "match_surfaces",
    "Opening": "find_openings",
    "Plane": "Plane(point, normal)",
    "PlaneView": "PlaneView(name, labels, structures, origin, axes, spacing, thickness)",
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
    "int": ("a whole number", lambda value: _is_number(value) and np.asarray(value).dtype.kind != "f"),
    "str": ("a string", lambda value: isinstance(value, str)),
}


class _Way(NamedTuple):
    """One of the ways to give an argument: as a noun or number, or several of them."""

    words: str
    kind: str
    several: str = ""

    def fits(self, value: Any) -> bool:
        """Whether a value is given in this way."""
        if not self.several:
            return _is(value, self.kind)
        if isinstance(value, Mapping) != (self.several == "Mapping") or isinstance(value, str):
            return False
        each = value.values() if isinstance(value, Mapping) else value
        return isinstance(each, Collection) and all(_is(one, self.kind) for one in each)


@cache
def at_door(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which refuses an argument that is neither noun nor number of the kind its annotation says."""
    names = list(inspect.signature(function).parameters)
    asked = {name: ways for name in names if (ways := _ways(function.__annotations__.get(name, "object")))}

    @wraps(function)
    def checked(*given: Any, **named: Any) -> Any:
        for name, value in (*zip(names, given), *named.items()):
            if name in asked and not any(way.fits(value) for way in asked[name]):
                raise InputError(_refusal(function.__name__, name, asked[name], value))
        return function(*given, **named)

    # Whoever sends it to other processes finds it under the name it is called by.
    checked.__module__ = "femprep"
    return checked


def _ways(annotation: str) -> list[_Way]:
    """What an argument may be; none where something is among it of which the door knows nothing."""
    ways = [_way(node) for node in _alternatives(ast.parse(annotation, mode="eval").body)]
    return [way for way in ways if way is not None] if None not in ways else []


def _alternatives(node: ast.expr) -> Iterator[ast.expr]:
    if isinstance(node, ast.BinOp):
        yield from (*_alternatives(node.left), *_alternatives(node.right))
    else:
        yield node


def _way(node: ast.expr) -> _Way | None:
    name = ast.unparse(node)
    words = f"{'an' if name[0] in 'AIO' else 'a'} {name}"
    if name in _PLAIN:
        return _Way(_PLAIN[name][0], name)
    if name in NOUNS:
        return _Way(words, name)
    several, _, inside = name.partition("[")
    if several not in ("Mapping", "Sequence", "list"):
        return None
    kind = inside.removesuffix("]").rpartition(", ")[2]
    return _Way(words, kind if kind in NOUNS else "", several)


def _is(value: Any, kind: str) -> bool:
    if kind in _PLAIN:
        return _PLAIN[kind][1](value)
    return not kind or any(
        each.__name__ == kind for each in type(value).__mro__ if each.__module__.startswith("femprep.")
    )


def _is_number(value: Any) -> bool:
    if not isinstance(value, Real | np.ndarray):
        return False
    array = np.asarray(value)
    return array.ndim == 0 and array.dtype.kind in "biuf"


def _refusal(function: str, name: str, ways: list[_Way], value: Any) -> str:
    words = " or ".join(way.words for way in ways)
    sources = ", ".join(NOUNS[way.kind] for way in ways if way.kind in NOUNS)
    source = f" (one comes from {sources})" if sources else ""
    return f"{function}() takes {words} as {name!r}{source}, got {quoted(value)}"
