"""A stack of labels with long-axis views in, surfaces by one of many methods out; yours is ``module:function``.

A method is a function of one :class:`femprep.Segmentation` (``labels`` of the stack, ``grid.to_world``, ``structures``,
and ``views`` with labels and pose of their own) that returns surfaces by name (``lv``, ``rv``, ``epi``, ``la``, ``ra``;
others are not measured), each as points ``(n, 3)`` in mm LPS and triangles ``(m, 3)``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np

from femprep.errors import FemprepError
from femprep.image import LabelObject, Segmentation
from femprep.model import FloatArray, IntArray, Surface
from femprep.surface.alignment import align_slices
from femprep.surface.reference.side_by_side import all_methods

Method = Callable[[Segmentation], Mapping[str, Any]]
#: The structures of each surface.
OBJECTS = {"lv": ("lv",), "rv": ("rv",), "epi": ("lv", "myo"), "la": ("la",), "ra": ("ra",)}
#: What is done to displaced slices before: number of views that the correction sees.
CORRECTIONS = {"": None, " + stack": 0, " + 4ch": 1, " + views": 3}
#: Rows of the table where none are named.
DEFAULT = (
    *("marching cubes", "marching cubes, Taubin", "surface nets", "slice-wise distance, Taubin", "femprep, paper"),
    *(
        "femprep, even",
        "femprep, smooth",
        "femprep, smooth + stack",
        "femprep, smooth + 4ch",
        "femprep, smooth + views",
    ),
    *("marching cubes, Taubin + views", "slice-wise distance, Taubin + views", "femprep, paper + views"),
)
VERTICES = 1500


def method_of(name: str) -> Method:
    """A method by its name in the table, or by ``module:function``.

    Raises
    ------
    SystemExit
        It is unknown.
    """
    if ":" in name:
        module, _, function = name.partition(":")
        found: Method = getattr(import_module(module), function)
        return found
    base, plus, _ = name.partition(" + ")
    known, correction = all_methods(VERTICES), name[len(base) :] if plus else ""
    if base not in known or correction not in CORRECTIONS:
        rows = "; ".join([*known, *(f"... {ending.strip()}" for ending in CORRECTIONS if ending)])
        raise SystemExit(f"method {name!r} is unknown; give module:function, or one of: {rows}")
    return partial(_each_object, method=known[base], views=CORRECTIONS[correction])


def _each_object(seg: Segmentation, method: Callable[[LabelObject], Surface], views: int | None) -> dict[str, Surface]:
    """Surfaces of a method that knows one object at a time, of slices as they are or moved together first."""
    seg = replace(seg, views=seg.views[: views or 0])
    if views is not None:
        seg = align_slices(seg)
    found = {}
    for name, parts in OBJECTS.items():
        if set(parts) <= set(seg.structures):
            try:
                found[name] = method(seg.object(*parts, name=name))
            except FemprepError as error:
                print(f"    {name}: {error}")
    return found


def arrays(surfaces: Mapping[str, Any]) -> dict[str, tuple[FloatArray, IntArray]]:
    """Points and triangles of surfaces, given as such or as femprep's, trimesh's or PyVista's."""
    found = {}
    for name, one in surfaces.items():
        if hasattr(one, "regular_faces"):
            one = (one.points, one.regular_faces)
        elif hasattr(one, "triangles") and hasattr(one, "points"):
            one = (one.points, one.triangles)
        elif hasattr(one, "vertices"):
            one = (one.vertices, one.faces)
        found[name] = (np.asarray(one[0], dtype=np.float64), np.asarray(one[1], dtype=np.int64))
    return found
