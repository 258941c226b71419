"""Contours of phantoms on oblique planes, and files of them as Segment, cvi42 and radiotherapy programs write them.

The layouts are those that the open readers named in the modules of ``femprep/image/reading/contours`` expect.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pyvista as pv
import trimesh

import femprep as fp
from femprep.phantoms import Phantom, biventricular

PIXEL, DISTANCE, THICK = 1.4, 9.0, 8.0
#: Points of an outline.
POINTS = 80
TURN = trimesh.transformations.euler_matrix(0.5, -0.7, 0.9)[:3, :3]
PLACE = np.array([35.0, -60.0, 120.0])


def phantom() -> Phantom:
    """Both ventricles, turned out of all axes of the scanner."""
    return biventricular().moved(TURN, PLACE)


def drawn(kind: Phantom | None = None) -> fp.Contours:
    """Outlines of a phantom on a short-axis stack from base to apex and on three views, with valves and apex."""
    kind = phantom() if kind is None else kind
    ball = trimesh.creation.icosphere(subdivisions=6)
    faces = np.column_stack([np.full(len(ball.faces), 3), ball.faces]).ravel()
    meshes = {name: pv.PolyData(kind.exact_surface(name, ball.vertices), faces) for name in kind.regions}
    x, y, z = kind.rotation.T
    planes = []
    top = 15.0
    for k in range(10):
        at = kind.origin + (top - DISTANCE * k) * z - 70.0 * x - 60.0 * y
        planes.append(
            fp.ContourPlane(f"slice {k + 1}", at, np.column_stack([x, y]), [PIXEL] * 2, THICK, short_axis=True)
        )
    for name, angle in (("2CH", 60.0), ("3CH", -60.0), ("4CH", 0.0)):
        across = np.cos(np.radians(angle)) * x + np.sin(np.radians(angle)) * y
        at = kind.origin - 80.0 * across + 40.0 * z
        planes.append(
            fp.ContourPlane(name, at, np.column_stack([across, -z]), [1.2 * PIXEL] * 2, 6.0, short_axis=False)
        )
    contours = []
    for plane in planes:
        for surface, mesh in meshes.items():
            cut = mesh.slice(plane.normal, origin=plane.origin).strip(join=True, max_length=100_000)
            for n in range(cut.n_lines):
                points = _even(np.asarray(cut.get_cell(n).points, dtype=float))
                if plane.short_axis:
                    contours.append(fp.Contour(surface, points, plane.name, closed=True))
                    continue
                points = _below(points, kind)
                contours.append(fp.Contour(surface, points, plane.name, closed=False))
                if surface == "lv":
                    apex = points[[kind.height(points).argmin()]]
                    contours.append(fp.Contour("mitral", points[[0, -1]], plane.name, closed=False))
                    contours.append(fp.Contour("apex", apex, plane.name, closed=False))
    return fp.Contours(tuple(planes), tuple(contours))


def _even(line: np.ndarray) -> np.ndarray:
    """Points at even distances along a closed line."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = np.linspace(0.0, way[-1], POINTS, endpoint=False)
    return np.column_stack([np.interp(at, way, line[:, i]) for i in range(3)])


def _below(points: np.ndarray, kind: Phantom) -> np.ndarray:
    """A closed line without its part in the base, from one end of the base to the other."""
    on = kind.height(points) > kind.height(kind.base.point[None])[0] - 1e-3
    start = int(np.flatnonzero(on & ~np.roll(on, -1))[0]) + 1
    return np.roll(points, -start, axis=0)[np.roll(~on, -start)]


def pixels(plane: fp.ContourPlane, points: np.ndarray) -> np.ndarray:
    """World points in pixels of a plane, the first index along its first axis."""
    return plane.to_plane(points) / plane.spacing


def segment_stacks(found: fp.Contours, times: int = 3, frame: int = 1) -> list[dict[str, Any]]:
    """``setstruct`` of Segment: a short-axis stack and a stack for each view, drawn at one of their frames."""
    fields = {"lv": "Endo", "epi": "Epi", "rv": "RVEndo", "rv_epi": "RVEpi"}
    stack = [plane for plane in found.planes if plane.short_axis]
    groups = [("Short-axis", stack)] + [(p.name, [p]) for p in found.planes if not p.short_axis]
    entries = []
    for view, planes in groups:
        first = planes[0]
        entry: dict[str, Any] = {
            "ImageViewPlane": view,
            "ImagePosition": first.origin[None],
            "ImageOrientation": first.axes.T.reshape(1, 6),
            "ResolutionX": float(first.spacing[1]),
            "ResolutionY": float(first.spacing[0]),
            "SliceThickness": first.thickness,
            "SliceGap": DISTANCE - THICK,
            "TSize": float(times),
            "ZSize": float(len(planes)),
            "Rotated": False,
        }
        for surface, field in fields.items():
            xy = np.full((2, POINTS, times, len(planes)), np.nan)
            for k, plane in enumerate(planes):
                for one in found.on(plane.name, surface):
                    ji = pixels(plane, one.points) + 1.0
                    xy[:, : len(ji), frame, k] = ji[:, ::-1].T
            entry[field + "X"], entry[field + "Y"] = xy if np.isfinite(xy).any() else (np.empty((0, 0)),) * 2
        entries.append(entry)
    return entries


def write_mat5(path: Path, stacks: list[dict[str, Any]]) -> Path:
    """A study as MATLAB 5 has it."""
    from scipy.io import savemat

    names = list(stacks[0])
    array = np.empty((1, len(stacks)), dtype=[(name, object) for name in names])
    for n, stack in enumerate(stacks):
        array[0, n] = tuple(stack[name] for name in names)
    savemat(path, {"setstruct": array, "im": np.zeros((2, 2))})
    return path


def write_mat73(path: Path, stacks: list[dict[str, Any]]) -> Path:
    """A study as MATLAB 7.3 has it: arrays transposed; of several stacks each field holds references."""
    import h5py

    def store(group: Any, name: str, value: Any) -> Any:
        if isinstance(value, str):
            data = group.create_dataset(name, data=np.array([[ord(c)] for c in value], dtype=np.uint16))
            data.attrs["MATLAB_class"] = np.bytes_("char")
        elif np.size(value) == 0:
            data = group.create_dataset(name, data=np.zeros(2, dtype=np.uint64))
            data.attrs["MATLAB_empty"] = np.uint8(1)
        else:
            data = group.create_dataset(name, data=np.atleast_2d(np.asarray(value, dtype=np.float64)).T)
            data.attrs["MATLAB_class"] = np.bytes_("double")
        return data

    with h5py.File(path, "w", userblock_size=512) as file:
        group, kept = file.create_group("setstruct"), file.create_group("#refs#")
        for name in stacks[0]:
            if len(stacks) == 1:
                store(group, name, stacks[0][name])
                continue
            references = [store(kept, f"{name}{n}", stack[name]).ref for n, stack in enumerate(stacks)]
            group.create_dataset(name, data=np.array([[one] for one in references], dtype=h5py.ref_dtype))
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    return path


_SPACES = {name: f"http://www.circlecvi.com/cvi42/Workspace/{name}/" for name in ("Hash", "List", "Point")}


def write_cvi42(path: Path, images: Path, found: fp.Contours, times: int = 3, frame: int = 1, fine: int = 4) -> Path:
    """A workspace and the images it was drawn on, ``times`` for each plane; points in whole subpixels."""
    names = {"lv": "endocardial", "epi": "epicardial", "rv": "rvendocardial", "rv_epi": "rvepicardial"}
    for space, uri in _SPACES.items():
        ElementTree.register_namespace(space, uri)
    key, item, entry = f"{{{_SPACES['Hash']}}}key", f"{{{_SPACES['Hash']}}}item", f"{{{_SPACES['List']}}}item"
    root = ElementTree.Element(item, {key: "Workspace"})
    study = ElementTree.SubElement(ElementTree.SubElement(root, item, {key: "StudyMapStates"}), entry)
    states = ElementTree.SubElement(study, item, {key: "ImageStates"})

    def add(contours: Any, name: str, ij: np.ndarray) -> None:
        contour = ElementTree.SubElement(contours, item, {key: name})
        points = ElementTree.SubElement(contour, item, {key: "Points"})
        for values in np.rint(ij * fine).astype(int):
            point = ElementTree.SubElement(points, entry)
            for axis, value in zip("xy", values):
                ElementTree.SubElement(point, f"{{{_SPACES['Point']}}}{axis}").text = str(value)
        ElementTree.SubElement(contour, item, {key: "SubpixelResolution"}).text = str(fine)

    images.mkdir(exist_ok=True)
    for n, plane in enumerate(found.planes):
        uids = [f"1.2.3.{n + 1}.{t + 1}" for t in range(times)]
        for t, uid in enumerate(uids):
            write_image(images / f"IM{n:02d}{t:02d}", plane, uid, f"1.2.4.{n + 1}", t)
        state = ElementTree.SubElement(states, item, {key: uids[frame]})
        contours = ElementTree.SubElement(state, item, {key: "Contours"})
        prefix = "sa" if plane.short_axis else "la"
        for surface, name in names.items():
            for one in found.on(plane.name, surface):
                ending = "Contour" if one.closed else "OpenContour"
                add(contours, prefix + name + ending, pixels(plane, one.points))
        valve, apex = found.on(plane.name, "mitral"), found.on(plane.name, "apex")
        if valve and apex:
            points = np.concatenate([valve[0].points, apex[0].points])
            add(contours, "laxLvExtentPoints", pixels(plane, points))
        add(contours, "freeDrawRoiContour", np.array([[1.0, 1.0], [5.0, 1.0], [5.0, 5.0]]))
    ElementTree.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)
    return path


def _dataset(path: Path, kind: str, uid: str) -> Any:
    import pydicom

    data = pydicom.Dataset()
    data.file_meta = pydicom.dataset.FileMetaDataset()
    data.file_meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
    data.file_meta.MediaStorageSOPClassUID = data.SOPClassUID = kind
    data.file_meta.MediaStorageSOPInstanceUID = data.SOPInstanceUID = uid
    return data


def write_image(path: Path, plane: fp.ContourPlane, uid: str, series: str, time: int) -> None:
    """The header of an MR image in a plane, without pixels."""
    data = _dataset(path, "1.2.840.10008.5.1.4.1.1.4", uid)
    data.SeriesInstanceUID, data.SeriesDescription = series, "cine"
    data.InstanceNumber, data.TriggerTime = time + 1, 30.0 * time
    data.ImagePositionPatient = [f"{x:.8g}" for x in plane.origin]
    data.ImageOrientationPatient = [f"{x:.8f}" for x in plane.axes.T.ravel()]
    data.PixelSpacing = [float(plane.spacing[1]), float(plane.spacing[0])]
    data.SliceThickness = plane.thickness
    data.save_as(path, enforce_file_format=True)


def write_rtstruct(path: Path, found: fp.Contours, names: dict[str, str]) -> Path:
    """A structure set with a structure for each named surface, coordinates to a hundredth of a millimetre."""
    import pydicom

    data = _dataset(path, "1.2.840.10008.5.1.4.1.1.481.3", "1.2.5.1")
    data.Modality = "RTSTRUCT"
    data.StructureSetROISequence, data.ROIContourSequence = pydicom.Sequence(), pydicom.Sequence()
    for number, (surface, name) in enumerate(names.items(), 1):
        roi = pydicom.Dataset()
        roi.ROINumber, roi.ROIName = number, name
        data.StructureSetROISequence.append(roi)
        lines = pydicom.Dataset()
        lines.ReferencedROINumber, lines.ContourSequence = number, pydicom.Sequence()
        for one in (one for one in found.contours if one.surface == surface):
            line = pydicom.Dataset()
            line.ContourGeometricType = "CLOSED_PLANAR" if one.closed else "OPEN_PLANAR"
            line.NumberOfContourPoints = len(one.points)
            line.ContourData = [f"{x:.2f}" for x in one.points.ravel()]
            lines.ContourSequence.append(line)
        data.ROIContourSequence.append(lines)
    data.save_as(path, enforce_file_format=True)
    return path
