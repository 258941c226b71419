"""Limits with what was found in, the lines of the page's table of checks out: a light, what was asked, what to do."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

from femprep.errors import Advice, alternatives
from femprep.options import Options
from femprep.options.advice import LONGER_EDGES, MORE_VERTICES, SHIFTS, SHORTER_EDGES, followable
from femprep.options.run import SWEEP, TETWILD
from femprep.volume.quality.report import LimitRecord

#: A limit that is met by less than this share of it is amber.
_NEAR: Final = 0.1
_OTHER_EDGES: Final = "choose another --edge-length"
_EVEN: Final = "choose even edge lengths: no sizing field, or a smaller gradation"
#: What to do where a check is missed, by the beginning or end of its name.
_REMEDIES: Final[tuple[tuple[str, tuple[Advice | str, ...]], ...]] = (
    ("label_distance", ("mend the labels where the slices show red dots", SHIFTS)),
    ("surface_distance", (MORE_VERTICES, SHORTER_EDGES, "smooth sharp edges of the surface given")),
    ("wall_volume_difference", ("compare the outlines and mend the labels",)),
    ("off_plane", (_OTHER_EDGES,)),
    ("time_step", (LONGER_EDGES, "look at the smallest elements")),
    ("edge_by_space_constant", (SHORTER_EDGES,)),
    ("size_ratio", (_EVEN,)),
    ("volume_ratio", (_EVEN,)),
)
_SHAPE: Final[dict[str, tuple[Advice | str, ...]]] = {
    "tetwild": (Advice("choose --quality best", "volume.quality", "best"), _OTHER_EDGES, SWEEP),
    "sweep": (_OTHER_EDGES, "choose more --layers", TETWILD),
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
_FAULT: Final = "choose another --edge-length, and report this fault of femprep"


def check_lines(limits: Iterable[LimitRecord], options: Options) -> list[dict[str, Any]]:
    """A line for each limit, missed ones first.

    Parameters
    ----------
    limits : iterable of LimitRecord
    options : Options
        Of the run that made the mesh: what they rule out is not advised.
    """
    lines = [
        {
            "light": _light(item),
            "name": item.name.replace("_", " "),
            "asked": f"{item.kind} {item.limit:g}",
            "unit": next((unit for name, unit in _UNITS if item.name.endswith(name)), ""),
            "value": item.value,
            "remedy": _remedy(item, options),
        }
        for item in limits
    ]
    return sorted(lines, key=lambda line: ("red", "amber", "green").index(str(line["light"])))


def _light(item: LimitRecord) -> str:
    if not item.passed:
        return "red"
    near = item.kind != "exactly" and abs(item.value - item.limit) < _NEAR * abs(item.limit)
    return "amber" if near else "green"


def _remedy(item: LimitRecord, options: Options) -> str:
    if item.kind == "exactly":
        return _FAULT
    advice = next((found for name, found in _REMEDIES if name in item.name), _SHAPE[options.volume.mesher])
    return alternatives(followable(advice, options, {}))
