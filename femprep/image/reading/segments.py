"""What 3D Slicer's ``.seg.nrrd`` or a DICOM SEG says of its segments in, one label map of the structures asked for out.

A file holds one or more layers, each a label map of its own, so that segments may overlap; names, label value and layer
of each segment stand in its header [1]_.

References
----------
.. [1] 3D Slicer user guide, Segmentation file format (.seg.nrrd).
   https://slicer.readthedocs.io/en/latest/developer_guide/modules/segmentations.html
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError, OptionError, did_you_mean
from femprep.model import BoolArray

#: Names that segments have, in small letters without anything between them, by structure: what preset "slicer" takes.
SLICER: Final[Mapping[str, tuple[str, ...]]] = {
    "lv": (
        "lv",
        "leftventricle",
        "lvcavity",
        "lvbloodpool",
        "lvblood",
        "leftventriclebloodpool",
        "leftventriclecavity",
        "heartventricleleft",
    ),
    "myo": ("myo", "myocardium", "lvmyo", "lvmyocardium", "leftventriclemyocardium", "lvwall", "heartmyocardium"),
    "rv": (
        "rv",
        "rightventricle",
        "rvcavity",
        "rvbloodpool",
        "rvblood",
        "rightventriclebloodpool",
        "heartventricleright",
    ),
    "rv_wall": ("rvwall", "rvmyo", "rvmyocardium", "rightventriclemyocardium", "rightventriclewall"),
    "la": ("la", "leftatrium", "lacavity", "labloodpool", "heartatriumleft"),
    "ra": ("ra", "rightatrium", "racavity", "rabloodpool", "heartatriumright"),
}


#: So many characters are told of a header's text that is no number.
_SHOWN: Final = 40


@dataclass(frozen=True)
class Segment:
    """A segment: its name, and the label and layer its voxels have."""

    name: str
    label: int
    layer: int


def segments_of(header: Mapping[str, str]) -> list[Segment]:
    """The segments that a header tells of, in its order; none where it is no ``.seg.nrrd``'s.

    Raises
    ------
    InputError
        A label or a layer is no number.
    """
    found = []
    matches = filter(None, (re.fullmatch(r"Segment([0-9]{1,9})_LabelValue", key) for key in header))
    for match in sorted(matches, key=lambda match: int(match[1])):
        own = f"Segment{match[1]}_"
        name = header.get(own + "Name", header.get(own + "ID", f"Segment_{match[1]}"))
        label, layer = (_number(header.get(own + field, "0"), own + field) for field in ("LabelValue", "Layer"))
        found.append(Segment(name, label, layer))
    return found


def _number(text: str, field: str) -> int:
    """A whole number of a header, from 0."""
    if not re.fullmatch(r"\s*[0-9]{1,9}\s*", text):
        shown = text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."
        raise InputError(f"its header has {field} {shown!r}, expected a whole number from 0; save the segments again")
    return int(text)


def require_layers(segments: Sequence[Segment], count: int) -> None:
    """Make sure that every segment's layer is one of those that the file has.

    Raises
    ------
    InputError
        A header names a layer that is not there.
    """
    for one in segments:
        if one.layer >= count:
            raise InputError(
                f"segment {one.name!r} is in layer {one.layer} by its header, and the layers are 0 to {count - 1}; "
                "save the segments again"
            )


def header_of(segments: Sequence[Segment]) -> dict[str, str]:
    """A header that tells of segments as 3D Slicer's does, for other files that hold such."""
    header: dict[str, str] = {}
    for k, one in enumerate(segments):
        header |= {f"Segment{k}_Name": one.name, f"Segment{k}_LabelValue": str(one.label)}
        header[f"Segment{k}_Layer"] = str(one.layer)
    return header


def plain(name: str) -> str:
    """A name in small letters, with nothing between them: as names are compared."""
    return re.sub(r"[^a-z0-9]+", "", name.lower())


def chosen_segments(
    segments: Sequence[Segment],
    wanted: Mapping[str, Sequence[int | str]],
    *,
    known: bool,
    volumes: Mapping[Segment, float] | None = None,
) -> dict[str, list[Segment]]:
    """The segments of each structure, by name or label; ``known`` takes names that are usual where none is given.

    ``volumes``, mL, are for the message.

    Raises
    ------
    OptionError
        A name is none of the file's, or none is known; the message lists them all.
    """
    found: dict[str, list[Segment]] = {}
    sizes = {one: f" ({volume:.3g} mL)" for one, volume in (volumes or {}).items()}
    listed = ", ".join(f"{one.label} {one.name!r}{sizes.get(one, '')}" for one in segments) or "none"
    usual = {name for name, names in SLICER.items() if any(plain(one.name) in names for one in segments)}
    if {"lv", "myo"} <= usual and not known:
        listed += "; --preset slicer takes those with usual names"
    for structure, names in wanted.items():
        own = found.setdefault(structure, [])
        for name in names:
            fits = [one for one in segments if name in (one.label, one.name)]
            fits = fits or [one for one in segments if plain(one.name) == plain(str(name))]
            if not fits:
                near = did_you_mean(get_close_matches(str(name), [one.name for one in segments], n=1))
                raise OptionError(f"structure {structure!r}: no segment {name!r} in the file{near}; it holds {listed}")
            own += fits[:1]
    if known:
        for structure, names in SLICER.items():
            if structure not in found and (fits := [one for one in segments if plain(one.name) in names]):
                found[structure] = fits[:1]
    if not found:
        raise OptionError(
            f"no segment has a usual name, such as LV or Myocardium; the file holds {listed}: name them, as in "
            f"lv={(segments[0].name if segments else 'Blood')!r}"
        )
    return found


def merged_layers(
    layers: npt.NDArray[Any], chosen: Mapping[str, Sequence[Segment]], others: Sequence[Segment] = ()
) -> tuple[npt.NDArray[np.uint16], dict[str, tuple[int, ...]], list[str]]:
    """One label map of the chosen segments of layers ``(l, i, j, k)``; its labels by structure; what overlapped.

    Labels of ``others`` follow, where nothing chosen is.
    """
    masks = {name: np.any([layers[one.layer] == one.label for one in own], axis=0) for name, own in chosen.items()}
    labels, numbers, said = merged_masks(masks)
    # What was not asked for is named, and takes nothing of what was: a scar in the wall, a segment around all.
    for number, one in enumerate(others, len(masks) + 1):
        labels[(layers[one.layer] == one.label) & (labels == 0)] = number
    return labels, numbers, said


def merged_masks(
    masks: Mapping[str, BoolArray],
) -> tuple[npt.NDArray[np.uint16], dict[str, tuple[int, ...]], list[str]]:
    """One label map of several masks; where they overlap a voxel is the smaller one's, which is said.

    Raises
    ------
    InputError
        A mask is empty, or lies within others altogether.
    """
    size = {name: int(np.count_nonzero(mask)) for name, mask in masks.items()}
    for name, count in size.items():
        if not count:
            raise InputError(f"mask {name!r} is empty; check its file, or leave it out")
    first = next(iter(masks.values()))
    said: list[str] = []
    labels = np.zeros(first.shape, dtype=np.uint16)
    number = {name: k + 1 for k, name in enumerate(masks)}
    by_size = sorted(masks, key=lambda name: -size[name])
    for i, name in enumerate(by_size):
        shared = {other: int(np.count_nonzero(masks[name] & masks[other])) for other in by_size[:i]}
        said += [
            ("1 voxel is" if count == 1 else f"{count} voxels are")
            + f" both {other} and {name}: taken as {name}, which is the smaller one"
            for other, count in shared.items()
            if count
        ]
        labels[masks[name]] = number[name]
    for name in masks:
        if not np.any(labels == number[name]):
            raise InputError(f"mask {name!r} lies within the others altogether, so that nothing is left of it")
    return labels, {name: (k,) for name, k in number.items()}, said
