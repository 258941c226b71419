"""A run's record in, sentences on where its wall ends and what was done to its thickness out."""

from __future__ import annotations

from typing import Any

from femprep.report.manifest import RunManifest
from femprep.report.methods.surfaces import amounts, listed
from femprep.wall.planes.oblique import ACROSS


def cuts(manifest: RunManifest) -> list[str]:
    """Where the wall ends: base and apex of ventricles, openings of a whole heart."""
    if manifest.options.anatomy == "whole-heart":
        return _openings(manifest)
    wall = manifest.details.get("wall", {})
    if manifest.input.surfaces:
        base = wall.get("planes", {}).get("base")
        if base is None:
            return ["The surfaces are closed, and the wall is closed all round."]
        how = {"given": "a given plane"}.get(base["source"], f"the plane {base['source']}")
        return [f"Surfaces were cut at the base in {how}."]
    lower = amounts(wall.get("planes", {}).get("base_rv", {}).get("notices", []), "amount")
    both = " and the right ventricle is open" if manifest.options.anatomy == "biv" and not lower else ""
    clipped = manifest.options.wall.apex == "clipped"
    apical = ", and at the apex in the plane of the most apical slice with such a ring" if clipped else ""
    base = wall.get("planes", {}).get("base", {})
    if base.get("source") == "given":
        found = [f"Surfaces were cut at the base in a given plane{apical}."]
    else:
        found = [
            "Surfaces were cut at the base in the plane of the most basal slice in which the myocardium closes around "
            f"the left ventricle's cavity{both}{apical} [@skrinjar2009]."
        ]
    if ACROSS in base.get("source", ""):
        found.append(
            "Slices were those of the label map resampled across the left ventricle's long axis, from the end of its "
            "cavity to the centre of its opening."
        )
    moved = amounts(base.get("notices", []), "amount")
    if moved:
        found.append(
            f"In this heart the base lies {sum(moved):.1f} mm nearer to the apex than the most basal closed ring."
        )
    if lower:
        found.append(
            f"The labels of the right ventricle end {sum(lower):.1f} mm nearer to the apex: around it the wall was cut "
            "in the plane of their last slice."
        )
    if manifest.options.wall.base_offset:
        found.append(f"That plane was moved by {manifest.options.wall.base_offset:.1f} mm towards the apex.")
    if not clipped:
        found.append(_apex(wall.get("apex", {})))
    return found


def _apex(apex: dict[str, Any]) -> str:
    length = float(apex.get("extrapolated_mm", 0.0))
    if not length:
        return "At the apex the wall is closed as in the labels."
    if apex.get("uncapped_share", 1.0) > 0.0:
        return (
            "The labels end with the cavity open at the apex: there the epicardium was extrapolated by a dome beyond "
            f"the last slice, {length:.1f} mm beyond the cavity."
        )
    return (
        f"At the apex, where labels of neighbouring slices leave the cavity bare, {length:.1f} mm of wall were added."
    )


def _openings(manifest: RunManifest) -> list[str]:
    cut = [one for one in manifest.details.get("wall", {}).get("openings", []) if "radius_mm" in one]
    start = "The heart is not cut by a plane; its cavities are closed all round"
    if not cut:
        return [f"{start}, valves and openings of vessels by tissue."]
    holes = listed([f"{one['name']} ({one['between'][0]}, radius {one['radius_mm']:.1f} mm)" for one in cut])
    given = sum(one["source"] == "given" for one in cut)
    by = "the labels show them"
    if given:
        by = "planes were given" if given == len(cut) else f"{by} or planes were given"
    return [f"{start} by tissue but for openings that were cut as round holes where {by}: {holes}."]


def thickness(manifest: RunManifest) -> list[str]:
    """What was pushed, thickened, filled or smoothed."""
    wall = manifest.details.get("wall", {})
    records, found = wall.get("repaired", []), []
    least = manifest.options.wall.minimum_thickness
    pushed = amounts([one for one in records if "beside" in one], "farthest_push_mm")
    if pushed:
        found.append(
            f"Where the wall was thinner than {least:g} mm the epicardium was pushed outwards, by up to "
            f"{max(pushed):.1f} mm."
        )
    apart = amounts([one for one in records if "between" in one], "farthest_push_mm")
    if apart:
        found.append(
            f"Cavities nearer to each other than {least:g} mm were pushed apart, by up to {max(apart):.1f} mm."
        )
    if any("thickened" in one for one in records):
        names = listed([one["thickened"] for one in records if "thickened" in one])
        found.append(f"Walls thinner than {least:g} mm (of {names}) were thickened outwards to that.")
    if any("filled" in one for one in records):
        found.append("Narrow grooves of the epicardium were filled up.")
    smoothed = amounts(records, "farthest_off_the_fit_mm")
    if smoothed:
        found.append(f"Folds of the cut surfaces were smoothed, by up to {max(smoothed):.1f} mm.")
    matching = wall.get("matching", manifest.details.get("volume", {}).get("matching", {}))
    push = matching.get("pushed", {})
    if push.get("vertices"):
        found.append(
            f"Where the wall was thinner than {push['least_mm']:g} mm the epicardium was pushed outwards, by up to "
            f"{push['maximum_mm']:.1f} mm."
        )
    if matching.get("softened_mm"):
        found.append(
            "Where they bend too sharply for layers of elements, the surfaces were locally smoothed, by up to "
            f"{matching['softened_mm']:.1f} mm."
        )
    return found
