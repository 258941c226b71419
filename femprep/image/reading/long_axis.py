"""A file of one or a few long-axis slices in, PlaneViews out: label maps of two-, three- and four-chamber views."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from femprep.errors import FileError, InputError, OptionError
from femprep.image.reading.itk import count_frames, read_content
from femprep.image.views import PlaneView
from femprep.model import Notice
from femprep.options import PRESETS

#: A file of more slices than this is a stack, not a view.
_MOST: Final = 12
#: ``NAME=LABEL[,NAME=LABEL...]`` behind the name of a file.
_LABELS: Final = re.compile(r"^(?P<file>.+):(?P<labels>\w+=\d+(,\w+=\d+)*)$")
#: Labels of the views of UK Biobank (github.com/baiwenjia/ukbb_cardiac), by what a file's name begins with.
_UKB: Final[Mapping[str, Mapping[str, tuple[int, ...]]]] = {
    "seg4_la_4ch": {"lv": (1,), "myo": (2,), "rv": (3,), "la": (4,), "ra": (5,)},
    "seg_la_4ch": {"la": (1,), "ra": (2,)},
    "label_la_4ch": {"la": (1,), "ra": (2,)},
    "seg_la_2ch": {"la": (1,)},
    "label_la_2ch": {"la": (1,)},
}
#: Files beside a stack that belong to it, by preset: what the stack's name has, and what the views' have in its place.
_COMPANIONS: Final[Mapping[str, tuple[tuple[str, tuple[str, ...]], ...]]] = {
    "mnms2": (("_SA_", ("_LA_",)),),
    "ukb": (
        ("seg_sa", ("seg4_la_4ch", "seg_la_2ch", "seg_la_4ch")),
        ("label_sa", ("label_la_4ch", "label_la_2ch")),
    ),
}


class ViewFile(NamedTuple):
    """A file of long-axis slices, and the labels of its structures where they were given."""

    path: Path
    structures: Mapping[str, tuple[int, ...]] | None = None


def require_one_phase(items: Sequence[str], phases: int) -> None:
    """Refuse views that are named once for several phases: they show one of them.

    Raises
    ------
    OptionError
    """
    if items and phases > 1:
        raise OptionError(
            f"--long-axis and --contours name the views of one phase, and there are {phases}; --preset mnms2 or ukb "
            "finds each one's"
        )


def view_files(items: Sequence[str], stack: Path, preset: str | None) -> tuple[list[ViewFile], list[Notice]]:
    """The files of long-axis slices that belong to a stack.

    Parameters
    ----------
    items : sequence of str
        ``FILE`` or ``FILE:NAME=LABEL[,NAME=LABEL...]``; a name with ``*`` is a pattern in the folder of the stack.
    stack : path
        File of the short-axis stack.
    preset : str, optional
        Its data set, which may know the names of files beside it.

    Returns
    -------
    files : list of ViewFile
    notices : list of Notice
        Which were found by their names.

    Raises
    ------
    FileError
        No file matches a pattern.
    """
    found: list[ViewFile] = []
    notices: list[Notice] = []
    for item in items:
        match = _LABELS.match(item)
        name = match["file"] if match else item
        structures: dict[str, tuple[int, ...]] = {}
        for pair in match["labels"].split(",") if match else ():
            structure, number = pair.split("=")
            structures[structure] = (*structures.get(structure, ()), int(number))
        paths = [Path(name)]
        if "*" in name:
            paths = sorted(path for path in stack.parent.glob(name) if path != stack)
            if not paths:
                raise FileError(f"--long-axis {name!r}: no file beside {stack} matches; check the pattern")
        found += [ViewFile(path, structures or None) for path in paths]
    if items:
        return found, notices
    for old, new in _COMPANIONS.get(preset or "", ()):
        beside = [stack.with_name(stack.name.replace(old, one)) for one in new if old in stack.name]
        files = [path for path in beside if path.is_file()]
        # Of two maps of one view the one with more structures serves.
        files = files[:2] if preset == "ukb" else files
        found += [ViewFile(path) for path in files]
    if found:
        names = ", ".join(file.path.name for file in found)
        notices.append(Notice.of("assumed", f"long-axis views found beside the stack by their names: {names}"))
    return found, notices


def read_views(
    path: Path,
    structures: Mapping[str, Sequence[int]] | None = None,
    preset: str | None = None,
    *,
    frame: int | None = None,
) -> tuple[PlaneView, ...]:
    """Read the slices of a long-axis label map that hold labels.

    Parameters
    ----------
    path : path
        NIfTI, NRRD or MetaImage of one or a few slices in any pose.
    structures : mapping of str to ints, optional
        Label numbers by structure.
    preset : str, optional
        A known data set, where no structures are given.
    frame : int, optional
        Which frame of a file over time, from 1.

    Returns
    -------
    tuple of PlaneView
        Structures that a view does not show are left out of it.

    Raises
    ------
    FileError
        The file is missing, damaged or has no pose.
    InputError
        It is a stack, holds no labels, or shows none of the structures.
    OptionError
        Neither structures nor a known preset.
    """
    content = read_content(path, frame if count_frames(path) > 1 else None, slices=1)
    if content.header.get("qform_code") == content.header.get("sform_code") == "0":
        raise FileError(f"{path}: its header has no pose, so where the view crosses the stack is unknown")
    array = np.asarray(content.array)
    if array.ndim != 3 or min(array.shape) > _MOST:
        raise InputError(
            f"{path}: has {' x '.join(map(str, array.shape))} voxels, expected a view of at most {_MOST} slices"
        )
    labels = np.rint(array).astype(np.int64)
    if np.abs(array - labels).max() > 1e-2 or labels.min() < 0:
        raise InputError(f"{path}: its values are no labels; give a label map, not an image")
    named = dict(structures) if structures else _known(path, preset)
    across = min(range(3), key=lambda axis: (array.shape[axis], -float(content.spacing[axis])))
    flat = [axis for axis in range(3) if axis != across]
    present = set(np.unique(labels).tolist()) - {0}
    shown = {name: tuple(n for n in numbers if n in present) for name, numbers in named.items()}
    shown = {name: numbers for name, numbers in shown.items() if numbers}
    if not shown:
        there = ", ".join(map(str, sorted(present))) or "none"
        wanted = ", ".join(f"{name}={','.join(map(str, numbers))}" for name, numbers in named.items())
        raise InputError(
            f"{path}: shows none of {wanted}; labels there: {there}; name them, as in --long-axis FILE:lv=1,myo=2"
        )
    views = []
    for number in np.flatnonzero(labels.any(axis=tuple(flat))):
        origin = content.origin + number * content.spacing[across] * content.direction[:, across]
        name = _stem(path) if array.shape[across] == 1 else f"{_stem(path)}, slice {number}"
        axes, sizes = content.direction[:, flat], content.spacing[flat]
        one = np.moveaxis(labels, across, 0)[number]
        views.append(PlaneView(name, one, shown, origin, axes, sizes, float(content.spacing[across])))
    return tuple(views)


def _known(path: Path, preset: str | None) -> dict[str, Any]:
    """Labels of a view by its data set, and by its name where numbers differ from view to view."""
    if preset == "ukb":
        for name, own in _UKB.items():
            if path.name.startswith(name):
                return dict(own)
    if preset is None or not PRESETS.get(preset):
        raise OptionError(f"{path.name}: labels of the view are unknown; name them, as in --long-axis FILE:lv=1,myo=2")
    return dict(PRESETS[preset])


def _stem(path: Path) -> str:
    """The name of a file without its ending."""
    name = path.name
    ending = next((e for e in (".nii.gz", ".seg.nrrd", path.suffix) if name.lower().endswith(e)), "")
    return name[: len(name) - len(ending)] if ending else name
