"""What was repaired, guessed or extrapolated in a run, as lines of text gathered from what each stage reports."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

#: Keys under which stages list what they did unasked.
KEYS = frozenset({"notices", "notes"})


def gather(*reports: Any) -> list[str]:
    """Every line listed under a ``notices`` or ``notes`` key of nested mappings, once each, in order."""
    return list(dict.fromkeys(line for report in reports for line in _lines(report)))


def _lines(value: Any) -> Iterator[str]:
    if not isinstance(value, Mapping):
        return
    for key, item in value.items():
        if key in KEYS and isinstance(item, list | tuple):
            yield from (str(line) for line in item)
        else:
            yield from _lines(item)


def object_notices(name: str, report: Mapping[str, Any]) -> list[str]:
    """What was repaired in one object of the label map."""
    lines = []
    if report.get("removed_voxels"):
        lines.append(
            f"object {name}: {report['removed_voxels']} voxels in {report['pieces'] - 1} smaller pieces were left out"
        )
    if report.get("filled_voxels"):
        lines.append(f"object {name}: {report['filled_voxels']} voxels in {report['voids']} voids were filled")
    if report.get("tunnels"):
        lines.append(f"object {name} has {report['tunnels']} tunnels; its surface, a mapped sphere, has none")
    return lines
