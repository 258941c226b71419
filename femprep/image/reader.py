"""A label map file in, a Segmentation out, and back: NIfTI, NRRD, MetaImage through SimpleITK, world LPS in mm.

The only file that imports SimpleITK, and late.
"""

from __future__ import annotations

import logging
import math
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.errors import DiskFullError, FileError, InputError, OptionError, ResourceError, cannot_write
from femprep.image.affine import choose_spacing, spacing_warning
from femprep.image.files import format_of, require_whole
from femprep.image.grid import Grid
from femprep.image.native import captured_stderr, memory
from femprep.image.segmentation import Segmentation, count_labels
from femprep.model import FloatArray, Notice, records
from femprep.options import PRESETS, ImageOptions, choose, takes

log = logging.getLogger(__name__)

#: Memory that reading a label map and taking its objects apart needs, bytes per voxel, at the least.
_BYTES_PER_VOXEL: Final = 4
#: A disk with less room than this is full, bytes.
_FULL: Final = 2**16


@takes(ImageOptions)
def read_segmentation(
    path: str | os.PathLike[str],
    structures: Mapping[str, int | Sequence[int]] | None = None,
    preset: str | None = None,
    options: ImageOptions | None = None,
    **changes: Any,
) -> Segmentation:
    """Read a label map.

    Parameters
    ----------
    path : path
        ``.nii``, ``.nii.gz``, ``.nrrd``, ``.mha`` or ``.mhd``.
    structures : mapping of str to int or several ints, optional
        Label numbers by structure: ``{"lv": 3, "myo": 2, "rv": 1}``. Those of the preset are replaced name by name.
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

    Examples
    --------
    >>> path = fp.write_segmentation(seg, "heart.nii.gz")
    >>> fp.read_segmentation("heart.nii.gz", structures=dict(seg.structures))
    Segmentation(... voxels of 1.4 x 1.4 x 8 mm: ...)
    """
    chosen = choose(ImageOptions, options, changes)
    names = _names(structures, preset)
    file = Path(path)
    array, spacing, origin, direction, header, notes = _read(file)
    labels = _labels(array, file)
    spacing, source, found, doubts = _spacing(spacing, header, labels.shape, chosen.spacing)
    notes += found
    for level, lines in ((logging.INFO, notes), (logging.WARNING, doubts)):
        for line in lines:
            log.log(level, "%s: %s", file.name, line)
    try:
        grid = Grid(labels.shape, spacing, origin, direction)
    except InputError as error:
        raise (_skewed(file) if "orthonormal" in str(error) else InputError(f"{file}: {error}")) from None
    count = count_labels(labels)
    if set(count) <= {0}:
        raise InputError(f"{file}: holds no label, all {labels.size} voxels are 0; is it a label map?")
    info = {
        "file": str(file),
        "format": format_of(file),
        "shape": list(labels.shape),
        "spacing": [float(s) for s in spacing],
        "spacing_source": source,
        "origin": [float(x) for x in origin],
        "direction": [[float(x) for x in row] for row in direction],
        "labels": {str(n): c for n, c in count.items()},
        "absent": {n: gone for n, v in names.items() if (gone := [i for i in v if i not in count])},
        "right_handed": grid.right_handed,
        "notices": records(*(Notice.of("assumed", line) for line in notes + doubts)),
    }
    return Segmentation(labels, grid, names, info)


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
    import SimpleITK as sitk

    file = Path(path)
    kind = format_of(file)
    kept = np.min_scalar_type(int(seg.labels.max(initial=0)))
    image = sitk.GetImageFromArray(np.ascontiguousarray(seg.labels.T, dtype=kept))
    image.SetSpacing([float(s) for s in seg.grid.spacing])
    image.SetOrigin([float(x) for x in seg.grid.origin])
    image.SetDirection([float(x) for x in seg.grid.direction.ravel()])
    writer = sitk.ImageFileWriter()
    writer.SetImageIO(kind)
    writer.SetUseCompression(True)
    try:
        partial = Path(tempfile.mkdtemp(prefix=".femprep-", dir=file.absolute().parent))
    except OSError as error:
        raise cannot_write(str(file), error, "write elsewhere") from None
    try:
        writer.SetFileName(str(partial / file.name))
        with _quiet() as said:
            writer.Execute(image)
            # On a full disk some of ITK's writers end early and say nothing.
            written = sitk.GetArrayFromImage(sitk.ReadImage(str(partial / file.name), imageIO=kind))
        if not np.array_equal(written, seg.labels.T):
            raise OSError("it is cut short")
        for made in sorted(partial.iterdir()):
            os.replace(made, file.absolute().parent / made.name)
    except (RuntimeError, OSError) as error:
        if shutil.disk_usage(partial).free < _FULL:
            raise DiskFullError(f"{file}: cannot be written whole, no room is left; free some space") from None
        reason = error.strerror or str(error) if isinstance(error, OSError) else _reason(error, said)
        raise FileError(f"{file}: cannot be written ({reason})") from None
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def _names(structures: Mapping[str, int | Sequence[int]] | None, preset: str | None) -> dict[str, tuple[int, ...]]:
    """Labels by structure: the preset's, those given by hand in their place."""
    if preset is not None and preset not in PRESETS:
        raise OptionError(f"unknown preset {preset!r}; expected one of {', '.join(sorted(PRESETS))}")
    names = dict(PRESETS[preset]) if preset else {}
    for name, numbers in (structures or {}).items():
        names[name] = (numbers,) if isinstance(numbers, int) else tuple(int(n) for n in numbers)
    if not names:
        raise OptionError(
            f"no structures: give a preset ({', '.join(sorted(PRESETS))}) or labels by name, as in lv=3 and myo=2"
        )
    return names


def _read(file: Path) -> tuple[npt.NDArray[Any], FloatArray, FloatArray, FloatArray, dict[str, str], list[str]]:
    """Array ``[i, j, k]``, spacing, origin, direction, NIfTI header fields and notes of a file."""
    import SimpleITK as sitk

    reader = sitk.ImageFileReader()
    reader.SetImageIO(require_whole(file))
    reader.SetFileName(str(file))
    notes: list[str] = []
    said: list[str] = []
    try:
        with _quiet() as said:
            reader.ReadImageInformation()
            size = list(reader.GetSize())
            _require_volume(file, size, reader.GetNumberOfComponents(), reader.GetPixelID() in _complex(sitk))
            _require_memory(file, size[:3])
            if len(size) > 3:
                reader.SetExtractSize(size[:3] + [0] * (len(size) - 3))
                notes.append(f"the image has {len(size)} dimensions with a single frame; that frame was taken")
            image = reader.Execute()
            # Other formats have no such fields, and ITK stumbles over keys that are no text.
            keys = reader.GetMetaDataKeys() if format_of(file) == "NiftiImageIO" else ()
            header = {key: reader.GetMetaData(key) for key in keys if key.isascii()}
    except RuntimeError as error:
        if "orthonormal" in str(error):
            raise _skewed(file) from None
        raise FileError(f"{file}: damaged or not readable ({_reason(error, said)})") from None
    array = sitk.GetArrayFromImage(image).T
    return (
        array,
        np.array(image.GetSpacing()),
        np.array(image.GetOrigin()),
        np.array(image.GetDirection()).reshape(3, 3),
        header,
        notes,
    )


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
        notes.append(f"voxel sizes {_sizes(found.spacing)} mm of the file replaced by {_sizes(spacing)} mm as given")
        return spacing, "given", notes, doubts
    if found.note:
        (doubts if found.doubtful else notes).append(found.note)
    if unlikely := spacing_warning(found.spacing, shape):
        doubts.append(unlikely)
    return found.spacing, found.source, notes, doubts


def _skewed(file: Path) -> InputError:
    return InputError(
        f"{file}: the axes of its affine are not at right angles, or not finite; resample the image onto a rectangular "
        "grid, or mend the header"
    )


def _require_volume(file: Path, size: list[int], components: int, complex_values: bool) -> None:
    """Refuse what is no single 3-D image of scalars."""
    shown = " x ".join(map(str, size))
    if components > 1 or complex_values:
        raise InputError(f"{file}: has {max(components, 2)} values per voxel, expected one label")
    if len(size) < 3 or min(size[:3]) < 2:
        raise InputError(f"{file}: is a 2-D image ({shown}), expected a stack of at least two slices")
    if any(n > 1 for n in size[3:]):
        raise InputError(
            f"{file}: is a {len(size)}-D image ({shown}), expected 3-D; write one frame to a file of its own"
        )


def _require_memory(file: Path, size: list[int]) -> None:
    """Refuse what does not fit into the memory of the machine, before it is asked for."""
    need, there = _BYTES_PER_VOXEL * math.prod(size), memory()
    if there is not None and need > there:
        shown = " x ".join(map(str, size))
        raise ResourceError(
            f"{file}: its {shown} voxels need about {need / 1e9:.3g} GB, and there are {there / 1e9:.3g} GB; crop or "
            "resample the image"
        )


def _complex(sitk: Any) -> tuple[int, ...]:
    return (sitk.sitkComplexFloat32, sitk.sitkComplexFloat64)


def _labels(array: npt.NDArray[Any], file: Path) -> npt.NDArray[np.integer[Any]]:
    """Label numbers in the smallest unsigned type, read-only; refuses fractions and negative numbers."""
    if np.issubdtype(array.dtype, np.floating):
        whole = np.isfinite(array) & (array == np.rint(array))
        if not whole.all():
            value = float(array[~whole][0])
            wrong = int(array.size - np.count_nonzero(whole))
            raise InputError(
                f"{file}: {wrong} voxels are no integers (the first is {value:.6g}), so that it is no label map; "
                "threshold it, or resample with nearest neighbour"
            )
    low, high = array.min(), array.max()
    if low < 0:
        raise InputError(f"{file}: has negative labels (the lowest is {int(low)}); labels are 0 and above")
    if high > np.iinfo(np.uint32).max:
        raise InputError(f"{file}: has label {high:.6g}, which is too large; is it a label map?")
    labels = array.astype(np.min_scalar_type(int(high)), order="K", copy=False)
    labels.setflags(write=False)
    return labels


@contextmanager
def _quiet() -> Iterator[list[str]]:
    """Keep ITK from writing to standard error; what the libraries below it (MetaIO, HDF5) write is handed over."""
    import SimpleITK as sitk

    shown = sitk.ProcessObject.GetGlobalWarningDisplay()
    sitk.ProcessObject.SetGlobalWarningDisplay(False)
    try:
        with captured_stderr() as said:
            yield said
    finally:
        sitk.ProcessObject.SetGlobalWarningDisplay(shown)


def _reason(error: Exception, said: list[str]) -> str:
    """The telling line of ITK's message, without the places in its source.

    MetaImage's own reason is whatever ``errno`` happened to be; what it wrote to standard error is to the point.
    """
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    if not lines or lines[-1].startswith("Reason:"):
        lines = said or ["no reason given"]
        return lines[0].split("Read: ", 1)[-1].rstrip(".")
    return lines[-1].split("ERROR:", 1)[-1].strip()


def _sizes(values: npt.ArrayLike) -> str:
    return " x ".join(f"{float(v):.4g}" for v in np.asarray(values).ravel())
