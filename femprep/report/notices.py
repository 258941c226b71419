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


def wall_notices(info: Mapping[str, Any]) -> list[str]:
    """What was extrapolated or pushed apart in the wall."""
    lines = []
    apex = info.get("apex", {})
    if apex.get("extrapolated"):
        lines.append(
            f"the labels leave {100 * apex['uncapped_share']:.0f} % of the cavity uncapped at the apex: the epicardium "
            f"was extrapolated by {apex['extrapolated_mm']:.1f} mm beyond the cavity"
        )
    lines.extend("wall: " + _sentence(repair) for repair in info.get("repaired", ()))
    for opening in info.get("openings", ()):
        between = " and ".join(opening["between"])
        cut = f"the {opening['name']} opening between {between} is cut with a radius of {opening.get('radius_mm')} mm"
        lines.append(opening.get("left_closed") or cut)
    return lines


def mesh_notices(info: Mapping[str, Any]) -> list[str]:
    """Which runs of the mesher failed before the one that was kept, and whether it reached its quality."""
    attempts = list(info.get("attempts", ()))
    lines = [f"fTetWild run {i + 1} of {len(attempts)}: {run['outcome']}" for i, run in enumerate(attempts[:-1])]
    if not info.get("quality_reached", True):
        lines.append("the mesher did not reach the quality asked of it; the best of its runs was kept")
    if info.get("straightened"):
        lines.append(
            f"{info['straightened']} edges of the template were made straight in all layers of quadratic elements, so "
            "that no element is inverted"
        )
    lines.extend(_anatomy_notices(info))
    return lines


def _anatomy_notices(info: Mapping[str, Any]) -> list[str]:
    axes = info.get("axes", {})
    lines = []
    if axes.get("mirrored"):
        lines.append(
            "the heart is stored mirrored: its fibres were mirrored with it; --flip mirrors the label map first instead"
        )
    assumed = axes.get("info", {}).get("assumed", ())
    if "septal" in assumed:
        lines.append(
            "nothing tells where the right ventricle lies: the septum was assumed where it usually is in a patient, "
            "to the right and in front"
        )
    if "hand" in assumed:
        lines.append(
            "the right ventricle does not tell whether the heart is stored mirrored: it was taken not to be. If it is, "
            "its fibres turn the wrong way: --flip, or --mirrored yes, mends that"
        )
    return lines


def _sentence(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{key.replace('_', ' ')} {_short(value)}" for key, value in values.items())


def _short(value: Any) -> str:
    if isinstance(value, list | tuple):
        return "(" + ", ".join(_short(item) for item in value) + ")"
    return f"{value:.3g}" if isinstance(value, float) else str(value)
