"""An image file in, its array and geometry out, and back: through SimpleITK, which no other file imports."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from femprep.errors import DiskFullError, FileError, InputError, cannot_write
from femprep.image.grid import Grid
from femprep.image.reading.affine import FLAT, sform, sheared_angle
from femprep.image.reading.files import format_of, header_of, require_whole
from femprep.image.reading.native import captured_stderr, require_memory
from femprep.image.reading.nifti_header import pose_note
from femprep.model import FloatArray

#: A disk with less room than this is full, bytes.
_FULL: Final = 2**16
#: Channels add to 1 within this; so many frames are listed.
_SUM, _LISTED = 0.01, 20
#: What to do with channels of classes.
_ARGMAX: Final = (
    "; of channels of classes, the first of which is the background, save the argmax (nibabel: labels = "
    "numpy.argmax(image.get_fdata(), axis=-1).astype('uint8'))"
)


class ImageContent(NamedTuple):
    """What a file holds.

    Attributes
    ----------
    array : (i, j, k) or (layers, i, j, k) array
    spacing, origin : (3,) array
        mm.
    direction : (3, 3) array
    header : dict
        Fields of NIfTI and of Slicer's segments.
    notes : list of str
        What was assumed.
    """

    array: npt.NDArray[Any]
    spacing: FloatArray
    origin: FloatArray
    direction: FloatArray
    header: dict[str, str]
    notes: list[str]


def read_content(file: Path, frame: int | None = None, *, slices: int = 2) -> ImageContent:
    """Read a file of at least so many slices, one frame of it where it has several."""
    image = _read(file, frame, slices)
    if format_of(file) == "NiftiImageIO" and (note := pose_note(header_of(file), image.origin, image.direction)):
        image.notes.append(note)
    matrix = sform(image.header)
    if matrix is not None and (angle := sheared_angle(matrix[:, :3])) is not None:
        image.notes.append(f"the axes of its sform are at {angle:.1f} degrees to one another; its qform was taken")
    return image


def count_frames(file: Path) -> int:
    """How many frames a file holds; 1 of a 3-D image."""
    import SimpleITK as sitk

    reader = sitk.ImageFileReader()
    reader.SetImageIO(require_whole(file))
    reader.SetFileName(str(file))
    try:
        with _quiet():
            reader.ReadImageInformation()
            size = list(reader.GetSize())
    except RuntimeError as error:
        raise _unreadable(file, error, []) from None
    return int(size[3]) if len(size) > 3 else 1


def _read(file: Path, frame: int | None, slices: int) -> ImageContent:
    """Read a file as ITK understands it."""
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
            keys = reader.GetMetaDataKeys()
            slicer = format_of(file) == "NrrdImageIO" and any(key.endswith("_LabelValue") for key in keys)
            components = 1 if slicer else reader.GetNumberOfComponents()
            _require_volume(
                file,
                reader,
                components,
                reader.GetPixelID() in (sitk.sitkComplexFloat32, sitk.sitkComplexFloat64),
                frame,
                slices,
            )
            require_memory(file, size[:3])
            if len(size) > 3:
                reader.SetExtractSize(size[:3] + [0] * (len(size) - 3))
                if frame is not None:
                    reader.SetExtractIndex([0] * 3 + [frame - 1] + [0] * (len(size) - 4))
                else:
                    notes.append(f"the image has {len(size)} dimensions with a single frame; that frame was taken")
            image = reader.Execute()
            # Other formats have no such fields, and ITK stumbles over keys that are no text.
            keys = keys if slicer or format_of(file) == "NiftiImageIO" else ()
            header = {key: reader.GetMetaData(key) for key in keys if key.isascii()}
    except RuntimeError as error:
        raise _unreadable(file, error, said) from None
    array = sitk.GetArrayFromImage(image)
    # Layers of segments come as components, the last axis; all others are turned round, to i, j, k.
    array = np.moveaxis(array, -1, 0).transpose(0, 3, 2, 1) if array.ndim == 4 else array.T
    return ImageContent(
        array,
        np.array(image.GetSpacing()),
        np.array(image.GetOrigin()),
        np.array(image.GetDirection()).reshape(3, 3),
        header,
        notes,
    )


def write_image(labels: npt.NDArray[Any], grid: Grid, file: Path) -> None:
    """Write a label map, whole or not at all; see :func:`femprep.write_segmentation`."""
    import SimpleITK as sitk

    kind = format_of(file)
    kept = np.min_scalar_type(int(labels.max(initial=0)))
    image = sitk.GetImageFromArray(np.ascontiguousarray(labels.T, dtype=kept))
    image.SetSpacing([float(s) for s in grid.spacing])
    image.SetOrigin([float(x) for x in grid.origin])
    image.SetDirection([float(x) for x in grid.direction.ravel()])
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
        if not np.array_equal(written, labels.T):
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


def skewed(file: Path) -> InputError:
    """What is said of axes that are not at right angles."""
    return InputError(
        f"{file}: the axes of its affine are not at right angles; mend the header, or resample the labels by nearest "
        "neighbours, as nibabel.processing.resample_to_output(image, voxel_sizes, order=0) does"
    )


def _unreadable(file: Path, error: RuntimeError, said: list[str]) -> FileError | InputError:
    if "orthonormal" in str(error):
        return skewed(file)
    if "determinant is 0" in str(error):
        return FileError(f"{file}: {FLAT}")
    return FileError(f"{file}: damaged or not readable ({_reason(error, said)})")


def _require_volume(
    file: Path, reader: Any, components: int, complex_values: bool, frame: int | None, slices: int
) -> None:
    """Refuse what is no single 3-D image of scalars."""
    size = list(reader.GetSize())
    shown = " x ".join(map(str, size))
    if components > 1 or complex_values:
        raise InputError(f"{file}: has {max(components, 2)} values per voxel, expected one label{_ARGMAX}")
    if len(size) < 3 or min(size[:3]) < slices:
        raise InputError(f"{file}: is a 2-D image ({shown}), expected a stack of at least two slices")
    frames = size[3] if len(size) > 3 else 1
    if frame is not None and not 1 <= frame <= frames:
        raise InputError(f"{file}: has no frame {frame}, it holds {frames} ({shown}), counted from 1")
    if any(n > 1 for n in (size[3:] if frame is None else size[4:])):
        raise InputError(f"{file}: is a {len(size)}-D image ({shown}), expected 3-D{_several(file, reader)}")


def _several(file: Path, reader: Any) -> str:
    """What to do with an image of several frames, by what they hold."""
    import SimpleITK as sitk

    size = list(reader.GetSize())
    require_memory(file, size)
    frames = sitk.GetArrayFromImage(reader.Execute()).reshape(-1, *size[2::-1])
    if np.abs(frames.sum(axis=0) - 1.0).max() < _SUM and frames.min() >= 0:
        return f"; its {len(frames)} channels add to 1 in every voxel, as probabilities of classes do{_ARGMAX}"
    held = [number for number, frame in enumerate(frames, 1) if frame.any()]
    listed = ", ".join(map(str, held[:_LISTED])) + (", ..." if len(held) > _LISTED else "")
    words = (
        f"; {len(frames)} frames, of which those that hold labels are {listed or 'none'}: choose one by --frame N (of "
        "--image FILE:N, counted from 1), or mesh them as phases of one heart by --sequence"
    )
    if (frames.min(), frames.max()) != (0, 1) or np.any((frames != 0) & (frames != 1)):
        return words
    return (
        f"{words}; or, as they hold 0 and 1 alone, write each that is the mask of a structure to a file of its own, "
        "for --mask lv=FILE --mask myo=FILE"
    )


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
