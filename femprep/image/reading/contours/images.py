"""A folder of DICOM images in, the pose of each image by its SOPInstanceUID out; through pydicom."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from femprep.errors import FileError, MissingDependencyError
from femprep.image.reading.dicom import is_dicom, quiet
from femprep.model import FloatArray
from femprep.model.products import unit_vectors

_TAGS: Final = (
    *("SOPInstanceUID", "SeriesInstanceUID", "SeriesDescription", "InstanceNumber", "TriggerTime"),
    *("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing", "SliceThickness"),
)
#: Thickness of a slice whose header has none, mm.
THICKNESS: Final = 8.0


class Image(NamedTuple):
    """Pose of one image.

    Attributes
    ----------
    origin, axes, spacing, thickness
        As of a ContourPlane.
    series : str
        Description of its series.
    plane : tuple
        Series and place: the same for all frames of one slice.
    time : tuple
        What orders the frames of one slice.
    """

    origin: FloatArray
    axes: FloatArray
    spacing: FloatArray
    thickness: float
    series: str
    plane: tuple[object, ...]
    time: tuple[float, float]


def require_pydicom(path: Path) -> None:
    """Refuse to go on without pydicom.

    Raises
    ------
    MissingDependencyError
    """
    if find_spec("pydicom") is None:
        raise MissingDependencyError(f"{path}: needs pydicom; install it with pip install 'femprep[dicom]'")


def read_images(folder: Path) -> dict[str, Image]:
    """Poses of all images of a folder and the folders in it, by SOPInstanceUID.

    Raises
    ------
    FileError
        There is no such folder, or it holds no DICOM image with a pose.
    """
    import pydicom

    if not folder.is_dir():
        raise FileError(f"{folder}: no such folder of DICOM images")
    found = {}
    with quiet():
        for path in sorted(folder.rglob("*")):
            if not is_dicom(path):
                continue
            try:
                data = pydicom.dcmread(path, stop_before_pixels=True, specific_tags=list(_TAGS))
                found[str(data.SOPInstanceUID)] = _image(data)
            # Other objects of a study have no pose; damaged files raise errors of any kind.
            except Exception:
                continue
    if not found:
        raise FileError(f"{folder}: holds no DICOM image; give the folder of the images that were contoured")
    return found


def _image(data: Any) -> Image:
    origin = np.array(data.ImagePositionPatient, dtype=np.float64)
    turn = np.array(data.ImageOrientationPatient, dtype=np.float64).reshape(2, 3)
    axes = np.column_stack([unit_vectors(one) for one in turn])
    rows, columns = map(float, data.PixelSpacing)
    place = tuple(np.round([*origin, *turn.ravel()], 2).tolist())
    return Image(
        origin,
        axes,
        np.array([columns, rows]),
        float(data.get("SliceThickness") or THICKNESS),
        str(data.get("SeriesDescription") or ""),
        (str(data.get("SeriesInstanceUID") or ""), *place),
        (float(data.get("TriggerTime") or 0.0), float(data.get("InstanceNumber") or 0.0)),
    )
