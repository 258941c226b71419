"""A DICOM segmentation (SEG) in, its segments as layers of labels and their geometry out; through highdicom.

Binary, fractional and label map segmentations [1]_ are read. A file holds the frames that are not empty alone, in any
order, each with its position; slices without a frame are filled in. Besides this file, only
``contours/images.py`` and ``contours/rtstruct.py`` import pydicom.

References
----------
.. [1] DICOM PS3.3, C.8.20 Segmentation. https://dicom.nema.org/medical/dicom/current/output/chtml/part03/sect_C.8.20.html
"""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.errors import FemprepError, FileError, InputError, MissingDependencyError
from femprep.image.reading.files import require_file
from femprep.image.reading.itk import ImageContent
from femprep.image.reading.native import require_memory
from femprep.image.reading.segments import Segment, header_of
from femprep.model import BoolArray, FloatArray, IntArray

#: SOP classes of segmentations: Segmentation Storage and Label Map Segmentation Storage.
_SEGMENTATIONS: Final = ("1.2.840.10008.5.1.4.1.1.66.4", "1.2.840.10008.5.1.4.1.1.66.7")
#: How far slices may lie off an even stack, of their distance.
_EVEN: Final = 0.02
#: Frames nearer than this are of one slice, mm.
_SAME: Final = 0.01
#: How far the last slice may be moved within its plane from the first, of a pixel, before the stack is sheared.
_SHEAR: Final = 0.1
_REMEDY: Final = "copy or export the file again"


def is_dicom(file: Path) -> bool:
    """Whether a file is DICOM by its ending, or by its first bytes where it has none."""
    if file.suffix.lower() in (".dcm", ".dicom"):
        return True
    if file.suffix[1:].isalpha() or not file.is_file():  # to open a pipe waits for whoever writes into it
        return False
    try:
        with open(file, "rb") as stream:
            return stream.read(132)[128:] == b"DICM"
    except OSError:
        return False


def read_dicom(file: Path) -> ImageContent:
    """Read a segmentation: layers ``(l, i, j, k)``, axis k across the slices, and a header as 3D Slicer's.

    Raises
    ------
    MissingDependencyError
        highdicom is not installed.
    FileError
        The file is missing, no DICOM, damaged or cut short.
    InputError
        It is another object than a segmentation, or its slices are no even stack.
    """
    require_file(file)
    if find_spec("highdicom") is None:
        raise MissingDependencyError("DICOM SEG needs highdicom; install it with pip install 'femprep[dicom]'")
    import highdicom

    notes: list[str] = []
    try:
        with quiet():
            data = _dataset(file)
            seg = highdicom.seg.Segmentation.from_dataset(data, copy=False)
            step, origin, slices = _geometry(seg)
            shape = (int(data.Columns), int(data.Rows), int(slices.max()) + 1)
            require_memory(file, shape)
            layers, segments = _layers(seg, slices, shape, notes)
            if recorded := _differing_spacing(data, float(np.linalg.norm(step[:, 2]))):
                notes.append(recorded)
    except _NoStackError as error:
        raise InputError(f"{file}: {error}") from None
    except FemprepError:
        raise
    # What pydicom and highdicom raise on damaged files is of any kind.
    except Exception as error:
        reason = str(error).strip().splitlines() or [type(error).__name__]
        raise FileError(f"{file}: damaged, or no segmentation that can be read ({reason[0].rstrip('.')})") from None
    if shape[2] < 2:
        raise InputError(f"{file}: labels a single slice, expected a stack of at least two")
    spacing = np.linalg.norm(step, axis=0)
    return ImageContent(layers, spacing, origin, step / spacing, header_of(segments), notes)


class _NoStackError(Exception):
    """Frames that do not lie as a stack of slices."""


def _dataset(file: Path) -> Any:
    """The file's data, with all of its pixels there."""
    import pydicom

    if file.stat().st_size == 0:
        raise FileError(f"{file}: file is empty")
    try:
        data = pydicom.dcmread(file)
    except pydicom.errors.InvalidDicomError:
        raise FileError(f"{file}: is no DICOM file; give a DICOM SEG, or {_REMEDY}") from None
    except PermissionError:
        raise FileError(f"{file}: no permission to read it") from None
    kind = data.get("SOPClassUID")
    if kind is None or ("PixelData" not in data and kind in _SEGMENTATIONS):
        raise FileError(f"{file}: damaged or cut short; {_REMEDY}")
    if kind not in _SEGMENTATIONS:
        name = kind.name.removesuffix(" Storage")
        raise InputError(f"{file}: is DICOM of the kind {name!r}, expected a segmentation (DICOM SEG)")
    if data.get("ImageType", [""])[0] and "FrameOfReferenceUID" not in data:
        raise InputError(f"{file}: its slices have no place in the patient (no frame of reference)")
    need = int(data.Rows) * int(data.Columns) * int(data.get("NumberOfFrames", 1)) * int(data.BitsAllocated) / 8
    if not data.file_meta.TransferSyntaxUID.is_compressed and len(data.PixelData) < need:
        raise FileError(f"{file}: cut short, {len(data.PixelData)} of {int(np.ceil(need))} bytes; {_REMEDY}")
    return data


def _geometry(seg: Any) -> tuple[FloatArray, FloatArray, IntArray]:
    """Steps along i, j and k as columns (3, 3), the place of the first voxel, and the slice of each frame."""
    rows, columns = (float(x) for x in _macro(seg, 0, "PixelMeasuresSequence").PixelSpacing)
    frames = range(int(seg.NumberOfFrames))
    turns = np.array([_macro(seg, n, "PlaneOrientationSequence").ImageOrientationPatient for n in frames], dtype=float)
    places = np.array([_macro(seg, n, "PlanePositionSequence").ImagePositionPatient for n in frames], dtype=float)
    if np.ptp(turns, axis=0).max() > 1e-3:
        raise _NoStackError("its frames are not parallel to one another; export one stack of slices")
    along, across = turns[0].reshape(2, 3)
    normal = np.cross(along, across)
    heights = places @ normal
    gaps = np.diff(np.sort(heights))
    gaps = gaps[gaps > _SAME]
    if not gaps.size:
        return np.column_stack([columns * along, rows * across, normal]), places[0], np.zeros(len(places), np.int64)
    slices = np.rint((heights - heights.min()) / gaps.min()).astype(np.int64)
    fit, *_ = np.linalg.lstsq(np.column_stack([np.ones(len(slices)), slices]), places, rcond=None)
    origin, step = fit
    off = np.abs(places - origin - slices[:, None] * step).max()
    if off > max(_EVEN * float(gaps.min()), _SAME):
        raise _NoStackError(
            f"its slices are no even stack: {gaps.min():.4g} to {gaps.max():.4g} mm apart, and {off:.3g} mm off it; "
            "resample the segmentation to one distance of slices, and export it again"
        )
    # The stack leads along the normal, unless it is sheared by more than a fraction of a pixel.
    if np.linalg.norm(step - (step @ normal) * normal) * slices.max() < _SHEAR * min(rows, columns):
        step = (step @ normal) * normal
    return np.column_stack([columns * along, rows * across, step]), origin, slices


def _macro(seg: Any, frame: int, name: str) -> Any:
    """What stands for a frame, or for all of them, in a functional group of that name."""
    own = seg.PerFrameFunctionalGroupsSequence[frame]
    return (own if name in own else seg.SharedFunctionalGroupsSequence[0])[name].value[0]


def _layers(
    seg: Any, slices: IntArray, shape: tuple[int, int, int], notes: list[str]
) -> tuple[npt.NDArray[np.uint16], list[Segment]]:
    """Label maps of the segments, as many as their overlaps need, and where each segment stands in them."""
    if seg.segmentation_type.value == "LABELMAP":
        layer = np.zeros(shape, np.uint16)
        for n, k in enumerate(slices):
            layer[:, :, k] = seg.get_stored_frame(n + 1).T
        return layer[None], [Segment(_label(seg, n), int(n), 0) for n in seg.segment_numbers]
    least = 1
    if seg.segmentation_type.value == "FRACTIONAL":
        least = int(np.ceil(0.5 * int(seg.MaximumFractionalValue)))
        notes.append(f"segments are fractional ({seg.SegmentationFractionalType.lower()}): taken from one half on")
    numbers = [int(_macro(seg, n, "SegmentIdentificationSequence").ReferencedSegmentNumber) for n in range(len(slices))]
    layers: list[npt.NDArray[np.uint16]] = []
    segments = []
    for number in map(int, seg.segment_numbers):
        mask: BoolArray = np.zeros(shape, dtype=bool)
        for frame in map(int, np.flatnonzero(np.equal(numbers, number))):
            mask[:, :, slices[frame]] |= least <= seg.get_stored_frame(frame + 1).T
        free = [k for k, layer in enumerate(layers) if not np.any(layer[mask])]
        if not free:
            free = [len(layers)]
            layers.append(np.zeros(shape, np.uint16))
        layers[free[0]][mask] = number
        segments.append(Segment(_label(seg, number), number, free[0]))
    return np.stack(layers), segments


def _label(seg: Any, number: int) -> str:
    return str(seg.get_segment_description(number).segment_label)


def _differing_spacing(data: Any, step: float) -> str | None:
    """What is said where the file's own distance of slices is not that of their positions."""
    try:
        recorded = float(_macro(data, 0, "PixelMeasuresSequence").SpacingBetweenSlices)
    except (AttributeError, TypeError, ValueError):
        return None
    if abs(recorded - step) <= _EVEN * step:
        return None
    return f"slices are said to be {recorded:.4g} mm apart and lie {step:.4g} mm apart; where they lie was taken"


@contextmanager
def quiet() -> Iterator[None]:
    """Keep what pydicom warns of, such as names of patients, off the screen."""
    log = logging.getLogger("pydicom")
    level = log.level
    log.setLevel(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        log.setLevel(level)
