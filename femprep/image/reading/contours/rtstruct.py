"""A DICOM structure set (RTSTRUCT) in, Contours out: planar contours by name in world coordinates; through pydicom.

The file names no planes. Contours whose planes are parallel form a stack, the largest of which is the short-axis one;
stacks may lie in any direction [1]_.

References
----------
.. [1] DICOM PS3.3, C.8.8.6 ROI Contour Module.
   https://dicom.nema.org/medical/dicom/current/output/chtml/part03/sect_C.8.8.6.html
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from femprep.errors import FemprepError, FileError, InputError, OptionError
from femprep.image.contours import LANDMARKS, SURFACES, Contour, ContourPlane, Contours
from femprep.image.reading.contours.images import THICKNESS, require_pydicom
from femprep.image.reading.contours.phases import unused
from femprep.image.reading.dicom import quiet
from femprep.model import FloatArray, Notice
from femprep.model.products import product

_STRUCTURE_SET: Final = "1.2.840.10008.5.1.4.1.1.481.3"
#: Names of structures, in small letters without anything between: ``LV_Endo``, ``Left ventricular blood pool``...
_CAVITY: Final = "(endo|endocardium|endocardial|cavity|bloodpool|lumen)?(contour)?"
_NAMES: Final = {
    "lv": f"(lv|leftventric(le|ular)){_CAVITY}",
    "rv": f"(rv|rightventric(le|ular)){_CAVITY}",
    "la": f"(la|leftatri(um|al)){_CAVITY}",
    "ra": f"(ra|rightatri(um|al)){_CAVITY}",
    "epi": "(lv|leftventric(le|ular))?(epi|epicardium|epicardial)(contour)?",
    "rv_epi": "(rv|rightventric(le|ular))(epi|epicardium|epicardial)(contour)?",
    **{name: f"{name}(valve|annulus|point)?s?" for name in LANDMARKS},
}
#: How far points lie off the plane of their contour, mm: coordinates are rounded.
_FLAT: Final = 0.5
#: Bounds of a pixel size taken from the distance of points, mm.
_PIXELS: Final = (0.5, 1.5)


def read(path: Path, phase: int | None, images: Path | None, structures: Mapping[str, str] | None = None) -> Contours:
    """Read a structure set; ``structures`` names the structure of each surface where their names are unusual."""
    require_pydicom(path)
    if phase is not None or images is not None:
        raise OptionError(f"{path}: a DICOM structure set holds world points of one phase; leave out phase and images")
    there = _structures(path)
    given = _matched(path, list(there), structures)
    left = Counter(name for name in there if name not in given)
    lines = [(given[name], points, closed) for name in given for points, closed in there[name]]
    lines = [line for line in lines if line[0] in LANDMARKS or len(line[1]) > 2]
    flat = [points for surface, points, _ in lines if surface not in LANDMARKS]
    if not flat:
        raise InputError(f"{path}: its structures {', '.join(given)} hold no contours")
    steps = np.concatenate([np.linalg.norm(np.diff(points, axis=0), axis=1) for points in flat])
    pixel = float(np.clip(np.median(steps), *_PIXELS))
    planes = _planes(path, flat, pixel)
    contours = [Contour(surface, points, _plane_of(points, planes), closed) for surface, points, closed in lines]
    words = ", ".join(f"{name!r} taken as {surface}" for name, surface in given.items())
    words += f"; pixels taken as {pixel:.2f} mm and slices as {planes[0].thickness:.1f} mm"
    notices = [Notice.of("assumed", f"{path.name}: {words}"), *unused(path, left)]
    return Contours(tuple(planes), tuple(contours), str(path), tuple(notices))


def _structures(path: Path) -> dict[str, list[tuple[FloatArray, bool]]]:
    """Points ``(n, 3)`` of the contours of each structure, and whether they are closed, by its name."""
    import pydicom

    try:
        with quiet():
            data = pydicom.dcmread(path)
            if data.get("SOPClassUID") != _STRUCTURE_SET:
                kind = getattr(data.get("SOPClassUID"), "name", "unknown")
                raise InputError(f"{path}: is DICOM of the kind {kind!r}, expected a structure set (RTSTRUCT)")
            names = {int(roi.ROINumber): str(roi.ROIName) for roi in data.StructureSetROISequence}
            found: dict[str, list[tuple[FloatArray, bool]]] = {}
            for roi in data.ROIContourSequence:
                lines = found.setdefault(names[int(roi.ReferencedROINumber)], [])
                lines += [_line(one) for one in roi.get("ContourSequence") or () if one.get("ContourData")]
    except FemprepError:
        raise
    except Exception as error:  # pydicom raises errors of any kind on damaged files
        reason = (str(error).strip() or type(error).__name__).splitlines()[0]
        raise FileError(f"{path}: damaged structure set ({reason}); export it again") from None
    return {name: lines for name, lines in found.items() if lines}


def _line(contour: Any) -> tuple[FloatArray, bool]:
    points = np.array(contour.ContourData, dtype=np.float64).reshape(-1, 3)
    return points, str(contour.ContourGeometricType).startswith("CLOSED")


def _matched(path: Path, there: list[str], names: Mapping[str, str] | None) -> dict[str, str]:
    """Surfaces by the names of their structures."""
    shown = ", ".join(map(repr, there)) or "none"
    question = f"{path}: name the structures of its surfaces, as in --contours FILE:lv=LV_ENDO,epi=LV_EPI"
    for surface, name in (names or {}).items():
        if surface not in SURFACES + LANDMARKS:
            raise OptionError(f"{path}: surface {surface!r} is unknown, known: {', '.join(SURFACES + LANDMARKS)}")
        if name not in there:
            raise OptionError(f"{path}: has no structure {name!r} for {surface}; structures there: {shown}")
    if names:
        return {name: surface for surface, name in names.items()}
    plain = {name: re.sub("[^a-z0-9]", "", name.lower()) for name in there}
    found = {name: s for s, pattern in _NAMES.items() for name in there if re.fullmatch(pattern, plain[name])}
    twice = [surface for surface, count in Counter(found.values()).items() if count > 1]
    if twice or not set(found.values()) & set(SURFACES):
        which = f"several mean {twice[0]}" if twice else "none is known"
        raise OptionError(f"{question}; {which}; structures there: {shown}")
    return found


def _planes(path: Path, lines: list[FloatArray], pixel: float) -> list[ContourPlane]:
    """The planes of contours, those of the largest stack first."""
    size = [np.ptp(points, axis=0).max() for points in lines]
    rest = [lines[n] for n in np.argsort(size)[::-1]]
    stacks: list[tuple[FloatArray, list[FloatArray]]] = []
    while rest:
        normal = _normal(rest[:1])
        flat = [bool(np.ptp(product(points, normal)) < 2.0 * _FLAT) for points in rest]
        if not flat[0]:
            raise InputError(f"{path}: a contour of {len(rest[0])} points lies on no plane; export planar contours")
        inside = [points for points, one in zip(rest, flat) if one]
        stacks.append((_normal(inside), inside))
        rest = [points for points, one in zip(rest, flat) if not one]
    stacks.sort(key=lambda stack: -len(stack[1]))
    planes: list[ContourPlane] = []
    thickness = THICKNESS
    for number, (normal, inside) in enumerate(stacks):
        heights = np.sort([float(product(points, normal).mean()) for points in inside])
        parts = np.split(heights, np.flatnonzero(np.diff(heights) > _FLAT) + 1)
        middles = [float(part.mean()) for part in parts]
        if number == 0 and len(middles) > 1:
            thickness = float(np.median(np.diff(middles)))
        first = np.linalg.svd(np.eye(3) - np.outer(normal, normal))[0][:, 0]
        axes = np.column_stack([first, np.cross(normal, first)])
        corner = axes @ product(np.concatenate(inside), axes).min(axis=0)
        for k, height in enumerate(middles):
            name = f"slice {k + 1}" if number == 0 else f"view {number}" + f", slice {k + 1}" * (len(middles) > 1)
            origin = corner + height * normal
            planes.append(ContourPlane(name, origin, axes, np.full(2, pixel), thickness, number == 0))
    return planes


def _normal(lines: list[FloatArray]) -> FloatArray:
    """Unit normal common to the planes of contours."""
    centred = np.concatenate([points - points.mean(axis=0) for points in lines])
    normal = np.linalg.svd(centred, full_matrices=False)[2][2]
    return np.asarray(normal * np.sign(normal[np.abs(normal).argmax()]))


def _plane_of(points: FloatArray, planes: list[ContourPlane]) -> str:
    """The plane that points lie on."""
    off = [float(np.abs(product(points - plane.origin, plane.normal)).max()) for plane in planes]
    return planes[int(np.argmin(off))].name
