"""Limits with what was found in, the lines of the page's table of checks out: a light, what was asked, what to do."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

from femprep.volume.quality.report import LimitRecord

#: A limit that is met by less than this share of it is amber.
_NEAR: Final = 0.1
#: What to do where a check is missed, by the beginning or end of its name.
_REMEDIES: Final = (
    ("label_distance", "mend the labels where the slices show red dots, or --correct-shifts"),
    ("surface_distance", "more --vertices, a smaller --edge-length, or smooth sharp edges of the surface given"),
    ("wall_volume_difference", "compare the outlines; mend the labels"),
    ("off_plane", "another --edge-length"),
    ("time_step", "a larger edge length, or look at the smallest elements"),
    ("edge_by_space_constant", "a smaller --edge-length"),
    ("size_ratio", "even edge lengths: no sizing field, or a smaller gradation"),
    ("volume_ratio", "even edge lengths: no sizing field, or a smaller gradation"),
)
_SHAPE: Final = {
    "tetwild": "--quality best, another --edge-length, or --mesher sweep",
    "sweep": "another --edge-length, more --layers, or --mesher tetwild",
}
#: Units of what is asked, by the end of a check's name.
_UNITS: Final = (
    ("dihedral", "degrees"),
    ("label_distance", "pixels"),
    ("surface_distance", "mm"),
    ("off_plane", "mm"),
    ("volume_difference", "%"),
    ("time_step", "microseconds"),
)
_FAULT: Final = "another --edge-length; it should not happen, tell us"


def check_lines(limits: Iterable[LimitRecord], mesher: str = "tetwild") -> list[dict[str, Any]]:
    """A line for each limit, missed ones first.

    Parameters
    ----------
    limits : iterable of LimitRecord
    mesher : str
        That made the mesh, and is not advised again.
    """
    lines = [
        {
            "light": _light(item),
            "name": item.name.replace("_", " "),
            "asked": f"{item.kind} {item.limit:g}",
            "unit": next((unit for name, unit in _UNITS if item.name.endswith(name)), ""),
            "value": item.value,
            "remedy": _remedy(item, mesher),
        }
        for item in limits
    ]
    return sorted(lines, key=lambda line: ("red", "amber", "green").index(str(line["light"])))


def _light(item: LimitRecord) -> str:
    if not item.passed:
        return "red"
    near = item.kind != "exactly" and abs(item.value - item.limit) < _NEAR * abs(item.limit)
    return "amber" if near else "green"


def _remedy(item: LimitRecord, mesher: str) -> str:
    if item.kind == "exactly":
        return _FAULT
    return next((words for name, words in _REMEDIES if name in item.name), _SHAPE.get(mesher, _SHAPE["tetwild"]))
