"""A label map file in, a Segmentation out, and back: NIfTI, NRRD, MetaImage, DICOM SEG (in only); world LPS in mm."""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError, OptionError
from femprep.image.grid import Grid
from femprep.image.reading.affine import choose_spacing, sizes, spacing_warning
from femprep.image.reading.contours import views_beside
from femprep.image.reading.dicom import is_dicom, read_dicom
from femprep.image.reading.files import format_of
from femprep.image.reading.itk import ImageContent, count_frames, read_content, skewed, write_image
from femprep.image.reading.long_axis import read_views, view_files
from femprep.image.reading.nifti_floats import require_finite
from femprep.image.reading.segments import Segment, chosen_segments, merged_layers, require_layers, segments_of
from femprep.image.segmentation import Segmentation, count_labels
from femprep.model import TISSUES, FloatArray, Notice, noted, records
from femprep.options import PRESETS, ImageOptions, choose, likely_preset, takes

#: Numbers this near to whole ones are labels that went through floating point or a scale.
_ROUNDED: Final = 0.01

log = logging.getLogger(__name__)


class NoLabelError(InputError):
    """A label map whose voxels are all 0."""


@takes(ImageOptions)
def read_segmentation(
    path: str | os.PathLike[str],
    structures: Mapping[str, int | str | Sequence[int | str]] | None = None,
    preset: str | None = None,
    options: ImageOptions | None = None,
    **changes: Any,
) -> Segmentation:
    """Read a label map.

    Parameters
    ----------
    path : path
        ``.nii``, ``.nii.gz``, ``.nrrd``, ``.seg.nrrd`` (3D Slicer), ``.mha``, ``.mhd``, or a DICOM SEG, ``.dcm`` or
        without ending (``pip install "femprep[dicom]"``).
    structures : mapping of str to int or several ints, optional
        Label numbers by structure: ``{"lv": 3, "myo": 2, "rv": 1}``. Those of the preset are replaced name by name. Of
        a ``.seg.nrrd`` and a DICOM SEG also the names of segments.
    preset : str, optional
        A known data set, see ``femprep.options.PRESETS``.
    options : ImageOptions, optional
        ``spacing`` replaces the file's voxel sizes.
    **changes
        Options by name.

    Returns
    -------
    Segmentation
        Its ``info`` holds ``file``, ``format``, ``shape``, ``spacing``, ``spacing_source``, ``origin``, ``direction``,
        ``labels`` (voxels by label), ``absent`` (labels asked for that do not occur), ``right_handed`` and ``notices``
        (what was guessed).

    Raises
    ------
    FileError
        The file is missing, damaged or of an unknown format.
    InputError
        It holds no 3-D label map: 2-D, several frames, several components, fractional, negative or no labels.
    OptionError
        The preset is unknown, or there is neither preset nor structures.
    MissingDependencyError
        A DICOM SEG, and highdicom is not installed.

    Examples
    --------
    >>> path = fp.write_segmentation(seg, "heart.nii.gz")
    >>> fp.read_segmentation("heart.nii.gz", structures=dict(seg.structures))
    Segmentation(... voxels of 1.4 x 1.4 x 8 mm: ...)
    """
    chosen = choose(ImageOptions, options, changes)
    file = Path(path)
    array, spacing, origin, direction, header, notes = _read(file, chosen.frame)
    try:
        segments = segments_of(header)
        require_layers(segments, array.shape[0] if array.ndim == 4 else 1)
    except InputError as error:
        raise InputError(f"{file}: {error}") from None
    names = _names(structures, preset, by_name=bool(segments))
    named: dict[str, str] = {}
    if segments:
        known = preset == "slicer" or not names
        array, names, named, said = _of_segments(array, segments, names, float(np.prod(spacing)), known=known)
        notes += said
    labels, said = _labels(array, file)
    notes += said
    spacing, source, found, doubts = _spacing(spacing, header, labels.shape, chosen.spacing)
    notes += found
    for level, lines in ((logging.INFO, notes), (logging.WARNING, doubts)):
        for line in lines:
            log.log(level, "%s: %s", file.name, line)
    try:
        grid = Grid(labels.shape, spacing, origin, direction)
    except InputError as error:
        raise (skewed(file) if "orthonormal" in str(error) else InputError(f"{file}: {error}")) from None
    count = count_labels(labels)
    if set(count) <= {0}:
        raise NoLabelError(f"{file}: holds no label, all {labels.size} voxels are 0; is it a label map?")
    parts, said = _in_wall(names, set(count))
    info = {
        **({"segments": named} if named else {}),
        "file": str(file),
        "format": "DICOM SEG" if is_dicom(file) else format_of(file),
        "shape": list(labels.shape),
        "spacing": [float(s) for s in spacing],
        "spacing_source": source,
        "origin": [float(x) for x in origin],
        "direction": [[float(x) for x in row] for row in direction],
        "labels": {str(n): c for n, c in count.items()},
        "absent": {n: gone for n, v in names.items() if (gone := [i for i in v if i not in count])},
        "right_handed": grid.right_handed,
        "notices": records(*(Notice.of("assumed", line) for line in notes + doubts + said)),
    }
    seg = Segmentation(labels, grid, parts, info)
    if not names:
        why = f"preset {preset!r} takes segments by their names, and {file} has none" if preset else "no structures"
        raise OptionError(
            f"{why}: give a preset ({', '.join(sorted(set(PRESETS) - {preset}))}) or labels by name, as in lv=3 and "
            f"myo=2; labels there: {seg.label_table()}{likely_preset(seg.present)}"
        )
    return _with_views(seg, file, structures, preset, chosen)


def _with_views(
    seg: Segmentation,
    file: Path,
    structures: Mapping[str, int | str | Sequence[int | str]] | None,
    preset: str | None,
    options: ImageOptions,
) -> Segmentation:
    """The segmentation with the long-axis views that were asked for, or that its data set has beside the stack."""
    files, notices = view_files(options.long_axis, file, preset)
    drawn, said = views_beside(options.contours, options.frame)
    if not files and not drawn:
        return seg
    own = _names(structures, None) if preset is None else None
    views = [view for one in files for view in read_views(one.path, one.structures or own, preset, frame=options.frame)]
    return replace(seg, views=(*views, *drawn), info=noted(seg.info, *notices, *said))


def read_frames(
    path: str | os.PathLike[str],
    structures: Mapping[str, int | str | Sequence[int | str]] | None = None,
    preset: str | None = None,
    options: ImageOptions | None = None,
) -> dict[int, Segmentation]:
    """Read all frames of a label map over time that hold labels, as many have them of two phases alone.

    Parameters
    ----------
    path, structures, preset, options
        As for :func:`read_segmentation`.

    Returns
    -------
    dict of int to Segmentation
        By the number of the frame, from 1; each one's ``notices`` tell the frames that are left out.

    Raises
    ------
    FileError, InputError, OptionError
        As for :func:`read_segmentation`; no frame holds a label.

    Examples
    --------
    >>> fp.mesh_sequence(list(fp.read_frames("cine.nii.gz", preset="ukb").values()))  # doctest: +SKIP
    """
    chosen = choose(ImageOptions, options, {})
    file = Path(path)
    found: dict[int, Segmentation] = {}
    empty = []
    count = 1 if is_dicom(file) else count_frames(file)
    for number in range(1, count + 1):
        try:
            found[number] = read_segmentation(file, structures, preset, choose(ImageOptions, chosen, {"frame": number}))
        except NoLabelError:
            empty.append(number)
    if not found:
        raise NoLabelError(f"{file}: holds no label in any of its {count} frames; is it a label map?")
    if not empty:
        return found
    line = f"{len(empty)} of {count} frames hold no label and are left out: " + ", ".join(map(str, empty))
    log.info("%s: %s", file.name, line)
    return {n: replace(seg, info=noted(seg.info, Notice.of("left out", line))) for n, seg in found.items()}


def write_segmentation(seg: Segmentation, path: str | os.PathLike[str]) -> None:
    """Write the label map of a segmentation; the format follows from the ending of the file name.

    Parameters
    ----------
    seg : Segmentation
    path : path
        ``.nii``, ``.nii.gz``, ``.nrrd``, ``.mha`` or ``.mhd``. NIfTI holds origin and directions in single precision.
        Offsets of single slices (of less than a pixel, see :func:`align_slices`) have no place in these formats.

    Raises
    ------
    FileError
        The ending is unknown, or the file cannot be written.
    DiskFullError
        There is no room; an earlier file stays.

    Examples
    --------
    >>> path = fp.write_segmentation(seg, "heart.nrrd")
    """
    write_image(seg.labels, seg.grid, Path(path))


def _read(file: Path, frame: int | None) -> ImageContent:
    """The file by the library that reads its format."""
    if not is_dicom(file):
        content = read_content(file, frame)
        if format_of(file) == "NiftiImageIO":
            require_finite(file, content.array.size, frame)
        return content
    if frame not in (None, 1):
        raise InputError(f"{file}: has no frame {frame}, a DICOM SEG holds one; leave --frame out")
    return read_dicom(file)


def _names(
    structures: Mapping[str, int | str | Sequence[int | str]] | None, preset: str | None, *, by_name: bool = False
) -> dict[str, Any]:
    """Labels by structure: the preset's, those given by hand in their place; or names of segments."""
    if preset is not None and preset not in PRESETS:
        raise OptionError(f"unknown preset {preset!r}; expected one of {', '.join(sorted(PRESETS))}")
    names: dict[str, Any] = dict(PRESETS[preset]) if preset else {}
    for name, numbers in (structures or {}).items():
        own = (numbers,) if isinstance(numbers, int | str) else tuple(numbers)
        if not by_name and (text := [n for n in own if isinstance(n, str)]):
            raise OptionError(
                f"structure {name!r} is {text[0]!r}, a name, which segments of a .seg.nrrd or DICOM SEG have; give the "
                "label's number"
            )
        names[name] = tuple(n if isinstance(n, str) else int(n) for n in own)
    return names


def _in_wall(names: Mapping[str, tuple[int, ...]], there: set[int]) -> tuple[dict[str, tuple[int, ...]], list[str]]:
    """The structures with tissue such as scar as part of the myocardium, and without labels that a map lacks."""
    found, said = dict(names), []
    chambers = {number for name, own in names.items() if name not in TISSUES for number in own}
    tissue = {n: name for name in TISSUES for n in names.get(name, ()) if n in there - chambers}
    if tissue and "myo" in names:
        found["myo"] = (*names["myo"], *tissue)
        said.append(f"{', '.join(dict.fromkeys(tissue.values()))} is taken as part of the myocardium (myo)")
    for name, own in found.items():
        here = tuple(number for number in own if number in there)
        if 0 < len(here) < len(own):
            found[name] = here
            said.append(f"the map holds no label {', '.join(str(n) for n in own if n not in here)} of {name}")
    return found, said


def _of_segments(
    array: npt.NDArray[Any], segments: Sequence[Segment], names: Mapping[str, Any], voxel: float, *, known: bool
) -> tuple[npt.NDArray[np.uint16], dict[str, tuple[int, ...]], dict[str, str], list[str]]:
    """One label map of segments; its labels by structure; what each label is of; what overlapped.

    Segments that no structure names have labels of their own behind those of the structures.
    """
    wanted = {name: (own,) if isinstance(own, int | str) else own for name, own in names.items()}
    layers = array if array.ndim == 4 else array[None]
    volumes = {one: np.count_nonzero(layers[one.layer] == one.label) * voxel / 1e3 for one in segments}
    chosen = chosen_segments(segments, wanted, known=known, volumes=volumes)
    taken = [one for parts in chosen.values() for one in parts]
    others = [one for one in segments if one not in taken and volumes[one]]
    labels, numbers, said = merged_layers(layers, chosen, others)
    parts = [*(",".join(one.name for one in own) for own in chosen.values()), *(one.name for one in others)]
    named = {str(number): name for number, name in enumerate(parts, 1)}
    return labels, numbers, named, said


def _spacing(
    read: FloatArray, header: Mapping[str, str], shape: tuple[int, ...], given: tuple[float, float, float] | None
) -> tuple[FloatArray, str, list[str], list[str]]:
    """Voxel sizes, where they come from, notes and doubts about them."""
    notes: list[str] = []
    doubts: list[str] = []
    found = choose_spacing(read, header)
    if header.get("qform_code") == header.get("sform_code") == "0":
        notes.append("the header has no affine; the axes are taken as they are stored, the origin as 0")
    if given is not None:
        spacing = np.array(given, dtype=np.float64)
        notes.append(f"voxel sizes {sizes(found.spacing)} mm of the file replaced by {sizes(spacing)} mm as given")
        return spacing, "given", notes, doubts
    if found.note:
        (doubts if found.doubtful else notes).append(found.note)
    if unlikely := spacing_warning(found.spacing, shape):
        doubts.append(unlikely)
    return found.spacing, found.source, notes, doubts


def _labels(array: npt.NDArray[Any], file: Path) -> tuple[npt.NDArray[np.integer[Any]], list[str]]:
    """Label numbers in the smallest unsigned type, read-only, and what was rounded; refuses other numbers."""
    said = []
    if np.issubdtype(array.dtype, np.floating):
        with np.errstate(invalid="ignore"):  # NaN of the kind that signals
            rounded = np.rint(array)
            off = np.abs(array - rounded)
            whole = np.isfinite(array) & (off <= _ROUNDED)
        if not whole.all():
            value = float(array[~whole][0])
            wrong = int(array.size - np.count_nonzero(whole))
            some = "1 voxel is no integer" if wrong == 1 else f"{wrong} voxels are no integers"
            raise InputError(
                f"{file}: {some} (the first is {value:.6g}), so that it is no label map; "
                "threshold it, or resample with nearest neighbour"
            )
        if count := int(np.count_nonzero(off)):
            said.append(f"{count} voxels within {float(off.max()):.2g} of whole numbers were rounded to them")
            array = rounded
    low, high = array.min(), array.max()
    if low < 0:
        raise InputError(f"{file}: has negative labels (the lowest is {int(low)}); labels are 0 and above")
    if high > np.iinfo(np.uint32).max:
        raise InputError(f"{file}: has label {high:.6g}, which is too large; is it a label map?")
    labels = array.astype(np.min_scalar_type(int(high)), order="K", copy=False)
    labels.setflags(write=False)
    return labels, said
