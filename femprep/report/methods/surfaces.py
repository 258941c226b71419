"""A run's record in, sentences on its image and on the closed surfaces fitted to it out."""

from __future__ import annotations

import math
from typing import Any, Final

from femprep.report.manifest import RunManifest

#: How a template is put on an object's surface, by method.
_METHODS: Final = {
    "smooth": "by estimating the surface whose mean curvature varies least among those that the labels allow, each "
    "face between voxels weighted by how precisely it locates the surface (between slices by shape-based interpolation "
    "[@raya1990]) and the smoothing chosen as that under which the labels are most likely [@wahba1985; @mackay1992]; "
    "on it {template} was placed evenly by way of a conformal map [@kazhdan2012]",
    "paper": "by carrying {template} along the gradient of a harmonic field to the surface that fits the boundary of "
    "the voxels in the least squares sense [@skrinjar2009]",
    "even": "by carrying {template} along the gradient of a harmonic field to the surface that fits the boundary of "
    "the voxels in the least squares sense [@skrinjar2009], and moving its vertices along that surface until its "
    "cells are even, by way of a conformal map [@kazhdan2012]",
}
#: Of surfaces that were given.
_READY: Final = (
    "Template surfaces made by femprep before were used without change: {what}, with {vertices} vertices{each}."
)
_GIVEN: Final = (
    "{template} was placed evenly on {what}, with {vertices} vertices{each}, by way of a conformal map [@kazhdan2012], "
    "on average {mean:.2f} mm and at most {greatest:.1f} mm from the triangles given."
)
_TEMPLATES: Final = {
    "triangle": "a pre-meshed sphere of evenly spread vertices [@glasser1992]",
    "quad": "a cubed sphere [@ronchi1996]",
}
#: What surfaces are called.
_NAMES: Final = {
    "lv": "the left ventricle's cavity",
    "rv": "the right ventricle's cavity",
    "la": "the left atrium's cavity",
    "ra": "the right atrium's cavity",
    "lv_epi": "the left ventricle with its wall",
    "rv_epi": "the right ventricle with its wall",
    "la_epi": "the left atrium with its wall",
    "ra_epi": "the right atrium with its wall",
}
CHAMBERS: Final = {"lv": "left ventricle", "rv": "right ventricle", "la": "left atrium", "ra": "right atrium"}


def listed(items: list[str]) -> str:
    """Items in running text."""
    return items[0] if len(items) == 1 else ", ".join(items[:-1]) + " and " + items[-1]


def image(manifest: RunManifest) -> list[str]:
    """What was done to the label map itself."""
    found = []
    if manifest.options.flip:
        found.append("The label map was mirrored first.")
    if out := manifest.options.image.leave_out:
        drawn = manifest.input.notes.get("left_out", {}).get("drawn_anew", [])
        anew = (
            f"; {listed([str(k) for k in drawn])} were interpolated from their neighbours [@raya1990]" if drawn else ""
        )
        found.append(f"Labels of slices {listed([str(k) for k in out])} were left out{anew}.")
    moved = manifest.input.notes.get("slice_shifts", {})
    if not manifest.options.image.correct_shifts and not moved:
        return found
    most = max((math.hypot(*one["shift"]) for one in moved.get("slices", [])), default=0.0)
    did = f"slices were moved back in their planes by up to {most:.1f} mm" if most else "none were found"
    views = [one["view"] for one in moved.get("views", [])]
    also = f" and of {len(views)} long-axis view{'s' if len(views) > 1 else ''} ({listed(views)})" if views else ""
    if left_out := [*moved.get("left_out", []), *(f"slice {k}" for k in moved.get("slices_left_out", []))]:
        did += (
            f"; {listed(left_out)} contradicted the other planes and {'was' if len(left_out) == 1 else 'were'} left out"
        )
    how = (
        "as those with which smooth surfaces of all structures agree best with all planes, the surfaces eliminated "
        "from the normal equations and the scales of the shifts estimated from the data [@mackay1992]"
    )
    second = (
        ", or from the centroids of all structures by a linear mixed model [@wahba1985; @lange1989], whichever leaves "
        "the smaller expected residual"
    )
    left = f" (expected residual {moved['expected']:.1f} mm rms)" if "expected" in moved else ""
    found.append(
        f"Shifts of slices{also} between breath-holds were estimated {how}{'' if views else second}; {did}{left}."
    )
    return found


def fitting(manifest: RunManifest) -> list[str]:
    """How closed surfaces were fitted, each method with the surfaces made by it."""
    fitted: dict[tuple[str, str, int], list[str]] = {}
    surfaces = manifest.details.get("surfaces", {})
    objects = [name for name in manifest.details.get("objects", surfaces) if name != "epi" or not _enclosed(manifest)]
    if manifest.input.surfaces:
        objects = list(surfaces)
    for name in objects:
        # A body that the epicardium encloses is no file of its own, but is fitted as the others are.
        info = surfaces.get(name, {})
        options = manifest.options.surface
        method, cells = info.get("method", options.method), info.get("cells", options.cells)
        if manifest.input.surfaces:
            method = _GIVEN if "distance_mean_mm" in info else _READY
        fitted.setdefault((method, cells, info.get("vertices", options.vertices)), []).append(name)
    found = []
    for (method, cells, vertices), names in fitted.items():
        what = listed([_named(manifest, name) for name in names])
        each = " each" if len(names) > 1 else ""
        if method not in _METHODS:
            text = method.format(
                template=_TEMPLATES[cells],
                what=what,
                vertices=vertices,
                each=each,
                mean=max(surfaces[name].get("distance_mean_mm", 0.0) for name in names),
                greatest=max(surfaces[name].get("distance_greatest_mm", 0.0) for name in names),
            )
            found.append(text[0].upper() + text[1:])
            continue
        how = _METHODS[method].replace("{template}", _TEMPLATES[cells])
        found.append(f"Closed surfaces of {what}, with {vertices} vertices{each}, were generated {how}.")
    again = [name for name in objects if surfaces.get(name, {}).get("redrawn")]
    if again:
        what = listed([_named(manifest, name) for name in again])
        found.append(f"The triangles of {what} were remeshed.")
    return found


def _named(manifest: RunManifest, name: str) -> str:
    if manifest.input.surfaces:
        outer = "the epicardium" if manifest.options.anatomy == "lv" else "the common epicardium"
        return outer if name == "epi" else f"the endocardium of the {CHAMBERS[name]}"
    return _NAMES["lv_epi"] if name == "epi" and "volume" in manifest.details else _NAMES.get(name, name)


def _enclosed(manifest: RunManifest) -> bool:
    """Whether the epicardium is that of an envelope rather than fitted to labels."""
    return "volume" in manifest.details and manifest.options.anatomy != "lv" and not manifest.input.surfaces


def epicardium(manifest: RunManifest) -> list[str]:
    """How the common epicardium of several chambers was made, and which walls were assumed."""
    if not _enclosed(manifest):
        return []
    wall, objects = manifest.options.wall, manifest.details.get("objects", {})
    chambers = ["rv"] if manifest.options.anatomy == "biv" else ["rv", "la", "ra"]
    thickness = {name: wall.rv_wall_thickness if name == "rv" else wall.atrial_wall_thickness for name in chambers}
    labelled = [name for name in chambers if f"{name}_epi" in objects]
    assumed = [name for name in chambers if name not in labelled]
    bodies = ["the left ventricle with its labelled wall"]
    bodies += [f"the {CHAMBERS[name]} with its labelled wall" for name in labelled]
    bodies += [f"the cavity of the {CHAMBERS[name]} grown by {thickness[name]:g} mm" for name in assumed]
    text = (
        f"The common epicardium is the surface of the union of {listed(bodies)}, and of all cavities grown by "
        f"{wall.minimum_thickness:g} mm, joined with rounded grooves by a smooth minimum of distances [@quilez]."
    )
    if assumed:
        whose = listed([CHAMBERS[name] for name in assumed])
        text += f" The labels have no wall of the {whose}: its thickness was assumed."
    return [text]


def amounts(records: Any, key: str) -> list[float]:
    """The figures of some name in a list of records, where they have one."""
    return [float(one[key]) for one in records if one.get(key) is not None]
