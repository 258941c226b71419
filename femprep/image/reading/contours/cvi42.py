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
from femprep.image.contours import Contour, ContourPlane, Contours
from femprep.image.reading.contours.images import Image, read_images, require_pydicom
from femprep.image.reading.contours.phases import Frames, frames_at, unused
from femprep.mesh.vtk.entities import refuse_entities
from femprep.model import FloatArray, Notice

_KEY: Final = "{http://www.circlecvi.com/cvi42/Workspace/Hash/}key"
_POINT: Final = "{http://www.circlecvi.com/cvi42/Workspace/Point/}"
#: What is called ``NAMEContour`` or ``NAMEOpenContour``.
_SURFACES: Final = {
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
}
#: Lines across a valve, and single points.
_LANDMARKS: Final = {
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
    require_pydicom("a cvi42 workspace")
    drawn = _drawn(path)
    folder = path.parent if images is None else images
    there = read_images(folder)
    here = [uid for uid in drawn if uid in there]
    if drawn and not here:
        raise FileError(
            f"{path}: none of the {len(drawn)} images that it holds contours of is in {folder} (SOPInstanceUID "
            f"{next(iter(drawn))}...); give the folder of their DICOM images with images"
        )
    notices = []
    if missing := len(drawn) - len(here):
        words = f"{path.name}: contours of {missing} of {len(drawn)} images were left out: no such image in {folder}"
        notices.append(Notice.of("left out", words))
    other: Counter[str] = Counter()
    planes: dict[tuple[object, ...], ContourPlane] = {}
    outlines: dict[str, dict[int, list[Contour]]] = {}
    times: dict[tuple[object, ...], list[tuple[float, float]]] = {}
    for image in there.values():
        times.setdefault(image.plane, []).append(image.time)
    for uid in here:
        image = there[uid]
        if not any(_used(name) for name in drawn[uid]):
            other.update(drawn[uid].keys())
            continue
        if image.plane not in planes:
            planes[image.plane] = _plane(image, len(planes) + 1, drawn[uid])
        plane, frame = planes[image.plane], sorted(times[image.plane]).index(image.time)
        found, names = _contours(plane, drawn[uid])
        other.update(names)
        if found:
            outlines.setdefault(plane.name, {})[frame] = found
    frames = [Frames(p.name, len(times[key]), outlines[p.name]) for key, p in planes.items() if p.name in outlines]
    at, more = frames_at(path, frames, phase)
    kept = tuple(plane for plane in planes.values() if plane.name in at)
    contours = [one for plane in kept for one in outlines[plane.name][at[plane.name]]]
    return Contours(kept, tuple(contours), str(path), (*notices, *unused(path, other), *more))


def _drawn(path: Path) -> dict[str, dict[str, FloatArray]]:
    """Points ``(n, 2)`` in pixels, by contour name, by SOPInstanceUID."""
    refuse_entities(path)
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


def _surface(name: str) -> str | None:
    """The surface that a contour of some name outlines; several of one name have numbers behind it."""
    stem = name.rstrip("0123456789").removesuffix("Contour").removesuffix("Open")
    return _SURFACES.get(stem) if "Contour" in name else None


def _used(name: str) -> bool:
    return _surface(name) is not None or name in _LANDMARKS or name in _EXTENTS


def _plane(image: Image, number: int, drawn: dict[str, FloatArray]) -> ContourPlane:
    """A plane with a name of its own; contours of short-axis slices begin with ``sa``."""
    short = any(name.startswith("sa") and _used(name) for name in drawn)
    name = f"{number}: {image.series}" if image.series else str(number)
    return ContourPlane(name, image.origin, image.axes, image.spacing, image.thickness, short)


def _contours(plane: ContourPlane, drawn: dict[str, FloatArray]) -> tuple[list[Contour], list[str]]:
    """The contours of one image, and the names of those that are not used."""
    world = {name: plane.origin + (points * plane.spacing) @ plane.axes.T for name, points in drawn.items()}
    found, other, valves = [], [], {}
    for name, points in world.items():
        if name in _EXTENTS:
            valve, surface = _EXTENTS[name]
            found.append(Contour(valve, points[:2], plane.name, closed=False))
            if len(points) == 3 and surface == "lv":
                found.append(Contour("apex", points[2:], plane.name, closed=False))
            if len(points) > 1:
                valves[surface] = points[:2]
        elif name in _LANDMARKS:
            ends = points if len(points) < 2 else points[[0, -1]]
            found.append(Contour(_LANDMARKS[name], ends, plane.name, closed=False))
    for name, points in world.items():
        outlined = _surface(name)
        if outlined is None or len(points) < 3:
            other += [] if _used(name) else [name]
            continue
        line, closed = points, "Open" not in name
        if closed and outlined in valves:
            line, closed = _opened(points, valves[outlined])
        found.append(Contour(outlined, line, plane.name, closed))
    return found, other


def _opened(points: FloatArray, valve: FloatArray) -> tuple[FloatArray, bool]:
    """An outline without its points on the line across a valve, from one end of the valve to the other."""
    ways = np.linalg.norm(points[:, None] - valve, axis=2).sum(axis=1)
    on = ways - np.linalg.norm(valve[1] - valve[0]) < _ON_VALVE
    if not on.any() or np.count_nonzero(~on) < 3:
        return points, True
    # The longest run of points off the valve begins behind the last point on it.
    start = int(np.flatnonzero(on & ~np.roll(on, -1))[0]) + 1
    return np.roll(points, -start, axis=0)[np.roll(~on, -start)], False
