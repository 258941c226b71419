"""A workspace of Circle cvi42 (``.cvi42wsx``) and the DICOM images it was drawn on in, Contours out.

The file names images by their SOPInstanceUID and holds the contours of each as points in its pixels, multiplied by a
subpixel resolution; pixel (0, 0) is the centre of the first one, as UK Biobank's label maps made from such files have
it. Where a plane lies is in the headers of the images.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

import numpy as np

from femprep.errors import FileError
from femprep.image.contours import LANDMARKS, Contour, ContourPlane, Contours
from femprep.image.reading.contours.images import read_images, require_pydicom
from femprep.image.reading.contours.phases import DrawnPlane, contours_at, unused
from femprep.model import FloatArray, Notice

_KEY: Final = "{http://www.circlecvi.com/cvi42/Workspace/Hash/}key"
_POINT: Final = "{http://www.circlecvi.com/cvi42/Workspace/Point/}"
#: What contours mean: outlines, called ``NAMEContour`` or ``NAMEOpenContour``; lines across a valve; points.
_MEANINGS: Final = {
    "saendocardial": "lv",
    "laendocardial": "lv",
    "saepicardial": "epi",
    "laepicardial": "epi",
    "sarvendocardial": "rv",
    "larvendocardial": "rv",
    "sarvepicardial": "rv_epi",
    "larvepicardial": "rv_epi",
    "lala": "la",
    "lara": "ra",
    "MV": "mitral",
    "AV": "aortic",
    "AorticValveDiameter": "aortic",
    "PulmonaryValveDiameter": "pulmonary",
    "apexEpiLv": "apex",
}
#: Two ends of a valve, of the left ventricle also the apex; the surface that ends there.
_EXTENTS: Final = {"laxLvExtentPoints": ("mitral", "lv"), "laxRvExtentPoints": ("tricuspid", "rv")}
#: How near points lie to the line across a valve that closes an outline, mm.
_ON_VALVE: Final = 1.0


def read(path: Path, phase: int | None, images: Path | None) -> Contours:
    """Read the contours of one phase; images are looked for beside the file where no folder is given."""
    require_pydicom(path)
    drawn = _drawn(path)
    folder = path.parent if images is None else images
    there = read_images(folder)
    here = [uid for uid in drawn if uid in there]
    if drawn and not here:
        raise FileError(
            f"{path}: none of the {len(drawn)} images that it holds contours of is in {folder} (SOPInstanceUID "
            f"{next(iter(drawn))}...); put the folder of their DICOM images beside it, or name it (images in Python)"
        )
    notices = []
    if missing := len(drawn) - len(here):
        words = f"{path.name}: contours of {missing} of {len(drawn)} images were left out: no such image in {folder}"
        notices.append(Notice.of("left out", words))
    times: dict[tuple[object, ...], list[tuple[float, float]]] = {}
    for image in there.values():
        times.setdefault(image.plane, []).append(image.time)
    other: Counter[str] = Counter()
    planes: dict[tuple[object, ...], DrawnPlane] = {}
    for uid in here:
        image, known = there[uid], {name: xy for name, xy in drawn[uid].items() if _meaning(name) or name in _EXTENTS}
        other.update(drawn[uid].keys() - known)
        if not known:
            continue
        if image.plane not in planes:
            number = f"{len(planes) + 1}: {image.series}".removesuffix(": ")
            # Contours of short-axis slices begin so.
            plane = ContourPlane(number, *image[:4], short_axis=any(name.startswith("sa") for name in known))
            planes[image.plane] = DrawnPlane(plane, len(times[image.plane]), {})
        found = _contours(planes[image.plane].plane, known)
        if found:
            planes[image.plane].drawn[sorted(times[image.plane]).index(image.time)] = found
    notices += unused(path, other)
    return contours_at(path, [plane for plane in planes.values() if plane.drawn], phase, notices)


def _drawn(path: Path) -> dict[str, dict[str, FloatArray]]:
    """Points ``(n, 2)`` in pixels, by contour name, by SOPInstanceUID."""
    try:
        root = ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise FileError(f"{path}: is no XML workspace of cvi42 ({error}); export it as .cvi42wsx again") from None
    found: dict[str, dict[str, FloatArray]] = {}
    for states in (element for element in root.iter() if element.get(_KEY) == "ImageStates"):
        for state in states:
            for contour in (one for part in state if part.get(_KEY) == "Contours" for one in part):
                parts = {part.get(_KEY): part for part in contour}
                name = contour.get(_KEY, "")
                try:
                    xy = [[float(point.findtext(_POINT + axis, "")) for axis in "xy"] for point in parts["Points"]]
                    fine = float(parts["SubpixelResolution"].text or "") if "SubpixelResolution" in parts else 1.0
                    points = np.array(xy, dtype=np.float64).reshape(-1, 2) / fine
                except (KeyError, ValueError, ZeroDivisionError):
                    raise FileError(f"{path}: contour {name!r} has no points that can be read; export again") from None
                if len(points):
                    found.setdefault(state.get(_KEY, ""), {})[name] = points
    return found


def _meaning(name: str) -> str | None:
    """What a contour shows; several of one name have numbers behind it."""
    return _MEANINGS.get(name.rstrip("0123456789").removesuffix("Contour").removesuffix("Open"))


def _contours(plane: ContourPlane, drawn: dict[str, FloatArray]) -> list[Contour]:
    """The contours of one image."""
    found: list[Contour] = []
    valves: dict[str, FloatArray] = {}
    world = {name: plane.origin + (points * plane.spacing) @ plane.axes.T for name, points in drawn.items()}
    for name in [name for name in _EXTENTS if name in world]:
        (valve, surface), points = _EXTENTS[name], world.pop(name)
        found.append(Contour(valve, points[:2], plane.name, closed=False))
        if len(points) > 1:
            valves[surface] = points[:2]
        if len(points) == 3 and surface == "lv":
            found.append(Contour("apex", points[2:], plane.name, closed=False))
    for name, points in world.items():
        meaning, line, closed = str(_meaning(name)), points, "Open" not in name
        if meaning in LANDMARKS:
            line, closed = points if len(points) < 2 else points[[0, -1]], False
        elif closed and meaning in valves:
            line, closed = _opened(points, valves[meaning])
        if meaning in LANDMARKS or len(line) > 2:
            found.append(Contour(meaning, line, plane.name, closed))
    return found


def _opened(points: FloatArray, valve: FloatArray) -> tuple[FloatArray, bool]:
    """An outline without its points on the line across a valve, from one end of the valve to the other."""
    ways = np.linalg.norm(points[:, None] - valve, axis=2).sum(axis=1)
    on = ways - np.linalg.norm(valve[1] - valve[0]) < _ON_VALVE
    if not on.any() or np.count_nonzero(~on) < 3:
        return points, True
    # The longest run of points off the valve begins behind the last point on it.
    start = int(np.flatnonzero(on & ~np.roll(on, -1))[0]) + 1
    return np.roll(points, -start, axis=0)[np.roll(~on, -start)], False
