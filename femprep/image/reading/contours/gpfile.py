"""A GPFile of biv-me and the SliceInfoFile beside it in, Contours out.

Lines of the GPFile, separated by tabs: x, y, z in mm LPS, type of contour, number of the plane, weight, phase. Lines of
the SliceInfoFile: name of a DICOM file, number of the plane, and its position, orientation and pixel size. Format:
github.com/UOA-Heart-Mechanics-Research/biv-me.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np

from femprep.errors import FileError, InputError, OptionError
from femprep.image.contours import Contour, ContourPlane, Contours
from femprep.image.reading.contours.ordering import in_order
from femprep.model import FloatArray, Notice

#: Types that make each surface; the first has to be there. Those of the septum belong to both ventricles.
_OUTLINES: Final[Mapping[str, tuple[str, ...]]] = {
    "lv": ("LV_ENDOCARDIAL",),
    "epi": ("LV_EPICARDIAL", "RV_SEPTUM"),
    "rv": ("RV_FREEWALL", "RV_SEPTUM", "RV_ENDOCARDIAL"),
    "rv_epi": ("RV_EPICARDIAL", "RV_SEPTUM"),
    "la": ("LA",),
    "ra": ("RA",),
}
_LANDMARKS: Final[Mapping[str, str]] = {
    "MITRAL_VALVE": "mitral",
    "TRICUSPID_VALVE": "tricuspid",
    "AORTA_VALVE": "aortic",
    "PULMONARY_VALVE": "pulmonary",
    "APEX_POINT": "apex",
}
#: Types without use here: the ends of the septum, which its outline has as well, and points that were taken out.
_UNUSED: Final = ("RV_INSERT", "EXCLUDED")
#: Slice thickness where no file has one, mm.
_THICKNESS: Final = 8.0
#: Words before the numbers of a plane's pose, and how many numbers.
_POSE: Final = (("ImagePositionPatient", 3), ("ImageOrientationPatient", 6), ("PixelSpacing", 2))


def read(path: Path, phase: int | None, images: Path | None) -> Contours:
    """Read one phase; see :func:`femprep.read_contours`.

    Raises
    ------
    FileError, InputError, OptionError
    """
    if phase is not None:
        raise OptionError(f"{path}: a GPFile holds one phase; leave the phase out and name the phase's file")
    if images is not None:
        raise OptionError(f"{path}: a GPFile has world points and needs no images; leave them out")
    points, left_out = _points(path)
    poses = _poses(path.with_name("SliceInfoFile.txt"))
    planes, contours = [], []
    for number in sorted({number for number, _ in points}):
        own = {kind: np.array(values) for (n, kind), values in points.items() if n == number}
        if number not in poses:
            raise FileError(f"{path}: has contours on plane {number}, which its SliceInfoFile.txt does not list")
        short = any(kind.startswith("SAX_") for kind in own)
        planes.append(ContourPlane(str(number), *poses[number], _THICKNESS, short))
        contours += _outlines({kind[4:]: p for kind, p in own.items() if kind[:4] in ("SAX_", "LAX_")}, number, short)
        contours += [Contour(_LANDMARKS[k], p, str(number), closed=False) for k, p in own.items() if k in _LANDMARKS]
    words = f"the file names no slice thickness, taken as {_THICKNESS:g} mm"
    notices = [Notice.of("assumed", f"{path.name}: {words}", amount=_THICKNESS, unit="mm")]
    if left_out:
        names = ", ".join(f"{count} {name}" for name, count in left_out.items())
        notices.append(Notice.of("left out", f"{path.name}: points of unknown types were left out: {names}"))
    return Contours(tuple(planes), tuple(contours), str(path), tuple(notices))


def _outlines(own: Mapping[str, FloatArray], number: int, short: bool) -> list[Contour]:
    """The outlines that the types of one plane make."""
    found = []
    for surface, kinds in _OUTLINES.items():
        pieces = [own[kind] for kind in kinds if kind in own]
        if kinds[0] in own and sum(map(len, pieces)) >= 3:
            line, closed = in_order(pieces)
            found.append(Contour(surface, line, str(number), closed or short))
    return found


def _points(path: Path) -> tuple[dict[tuple[int, str], list[list[float]]], Counter[str]]:
    """Points by plane and type, and the number of those of unknown types."""
    found: dict[tuple[int, str], list[list[float]]] = defaultdict(list)
    left_out: Counter[str] = Counter()
    known = {f"{view}_{kind}" for kinds in _OUTLINES.values() for kind in kinds for view in ("SAX", "LAX")}
    for line, row in enumerate(_lines(path)[1:], start=2):
        parts = row.split("\t")
        try:
            place, kind, plane, weight = [float(x) for x in parts[:3]], parts[3], int(parts[4]), float(parts[5])
        except (ValueError, IndexError):
            raise FileError(f"{path}: line {line} is no point of a contour: {row[:60]!r}") from None
        if kind in known or kind in _LANDMARKS:
            if weight > 0.0:
                found[plane, kind].append(place)
        elif kind not in _UNUSED and not kind.endswith("_PHANTOM"):
            left_out[kind] += 1
    if not found:
        raise InputError(f"{path}: holds no contours")
    return found, left_out


def _poses(path: Path) -> dict[int, tuple[FloatArray, FloatArray, FloatArray]]:
    """Origin, axes and pixel size of each plane."""
    found = {}
    for line, row in enumerate(_lines(path), start=1):
        parts = row.split()
        try:
            number = next(int(b) for a, b in pairwise(parts) if a in ("sliceID:", "frameID:"))
            at = [parts.index(word) + 1 for word, _ in _POSE]
            place, axes, pixel = (np.array(parts[i : i + n], dtype=float) for i, (_, n) in zip(at, _POSE))
            # PixelSpacing is the distance of rows first, and the first axis runs along a row.
            found[number] = (place, axes.reshape(2, 3).T, pixel[::-1])
        except (ValueError, StopIteration):
            raise FileError(f"{path}: line {line} is no pose of a plane: {row[:60]!r}") from None
    return found


def _lines(path: Path) -> list[str]:
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror}); it belongs to the contours") from None
    except UnicodeDecodeError:
        raise FileError(f"{path}: is no text file") from None
    return [row for row in text.splitlines() if row.strip()]
