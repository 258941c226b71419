"""A study saved by Medviso Segment (``.mat``) in, Contours out: the outlines of its image stacks at one phase.

``setstruct`` holds one entry for each image stack. Points are numbers of pixels from 1: x along the rows of the image,
y along its columns; slices are counted against the normal of the DICOM image [1]_. Files of MATLAB 5 are read by
scipy, of MATLAB 7.3 by h5py.

References
----------
.. [1] Function ``xyz2rlapfh``. https://github.com/Cardiac-MR-Group-Lund/segment-open
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from femprep.errors import FemprepError, FileError, InputError, OptionError
from femprep.image.contours import Contour, ContourPlane, Contours
from femprep.image.reading.contours.phases import DrawnPlane, contours_at
from femprep.model import FloatArray, Notice
from femprep.model.products import unit_vectors

_SURFACES: Final = {"Endo": "lv", "Epi": "epi", "RVEndo": "rv", "RVEpi": "rv_epi"}
_POSE: Final = ("ImagePosition", "ImageOrientation", "ResolutionX", "ResolutionY", "SliceThickness", "SliceGap")
_FIELDS: Final = (*(name + axis for name in _SURFACES for axis in "XY"), *_POSE, "TSize", "ZSize", "Rotated")
_VIEW: Final = "ImageViewPlane"
_SHORT_AXIS: Final = "short-axis"


def read(path: Path, phase: int | None, images: Path | None) -> Contours:
    """Read the outlines of both ventricles on the short-axis stack with most of them and on all long-axis views."""
    if images is not None:
        raise OptionError(f"{path}: a study of Segment holds the place of its images and needs none; leave them out")
    try:
        import h5py

        planes, notices = _planes(path, _hdf5(path) if h5py.is_hdf5(path) else _matlab5(path))
    except FemprepError:
        raise
    except Exception as error:  # scipy and h5py raise errors of any kind on damaged files
        reason = (str(error).strip() or type(error).__name__).splitlines()[0]
        raise FileError(f"{path}: damaged, or no study of Segment ({reason}); save it again") from None
    return contours_at(path, planes, phase, notices)


def _planes(path: Path, stacks: list[dict[str, Any]]) -> tuple[list[DrawnPlane], list[Notice]]:
    """Planes with their outlines."""
    counts = [sum(int(np.isfinite(stack.get(name + "X", ())).sum()) for name in _SURFACES) for stack in stacks]
    short = [n for n, stack in enumerate(stacks) if counts[n] and _is_short_axis(stack)]
    most = max(short, key=lambda n: counts[n], default=-1)
    planes, notices = [], []
    if len(short) > 1:
        words = f"{path.name}: of {len(short)} short-axis stacks with contours, stack {most + 1} with most is used"
        notices.append(Notice.of("left out", words))
    for n, stack in enumerate(stacks):
        if not counts[n] or (n in short and n != most):
            continue
        if np.any(stack.get("Rotated", 0)):
            raise InputError(f"{path}: stack {n + 1} is a rotated one, whose slices have no common direction")
        where = np.asarray(stack["ImagePosition"], float).ravel()
        along, across = (unit_vectors(one) for one in np.asarray(stack["ImageOrientation"], float).reshape(2, 3))
        row, column, thick, gap = (float(np.ravel(stack[name])[0]) for name in _POSE[2:])
        times, slices = (max(int(np.ravel(stack[name])[0]), 1) for name in ("TSize", "ZSize"))
        view = str(stack.get(_VIEW) or "view")
        for k in range(slices):
            name = view if n == most else f"{view} of stack {n + 1}"
            name += f", slice {k + 1}" * (slices > 1)
            origin = where - k * (thick + gap) * np.cross(along, across)
            axes = np.column_stack([along, across])
            plane = ContourPlane(name, origin, axes, np.array([column, row]), thick, n == most)
            drawn: dict[int, list[Contour]] = {}
            for field, surface in _SURFACES.items():
                x, y = (_points(stack.get(field + axis), times, slices)[:, :, k] for axis in "XY")
                for t in range(x.shape[1]):
                    index = np.column_stack([y[:, t], x[:, t]]) - 1.0
                    index = index[np.isfinite(index).all(axis=1)]
                    if len(index) > 2:
                        points = origin + (index * plane.spacing) @ axes.T
                        drawn.setdefault(t, []).append(Contour(surface, points, name, closed=True))
            if drawn:
                planes.append(DrawnPlane(plane, times, drawn))
    return planes, notices


def _is_short_axis(stack: Mapping[str, Any]) -> bool:
    """Whether a stack is named as a short-axis one, or has no name and several slices."""
    view = str(stack.get(_VIEW) or "").lower()
    return view == _SHORT_AXIS or ("ch" not in view and int(np.ravel(stack["ZSize"])[0]) > 2)


def _points(values: Any, times: int, slices: int) -> FloatArray:
    """Coordinates ``(points, times, slices)``; MATLAB drops what comes last where it is one."""
    array = np.asarray(() if values is None else values, dtype=np.float64)
    return array.reshape((-1, times, slices), order="F") if array.size else np.empty((0, 0, slices))


def _matlab5(path: Path) -> list[dict[str, Any]]:
    from scipy.io import loadmat

    found = loadmat(path, variable_names=["setstruct"]).get("setstruct")
    if found is None or not found.dtype.names:
        raise FileError(f"{path}: holds no setstruct, so it is no study of Segment")
    stacks = []
    for entry in found.ravel():
        stack = {name: entry[name] for name in _FIELDS if name in found.dtype.names}
        stack[_VIEW] = "".join(np.ravel(entry[_VIEW]).tolist()) if _VIEW in found.dtype.names else ""
        stacks.append(stack)
    return stacks


def _hdf5(path: Path) -> list[dict[str, Any]]:
    import h5py

    def value(data: Any) -> Any:
        if not isinstance(data, h5py.Dataset) or data.attrs.get("MATLAB_empty", 0):
            return np.empty(0)
        if data.attrs.get("MATLAB_class") == b"char":
            return "".join(map(chr, np.ravel(data[()])))
        return data[()].T

    with h5py.File(path) as file:
        if "setstruct" not in file:
            raise FileError(f"{path}: holds no setstruct, so it is no study of Segment")
        group = file["setstruct"]
        names = [name for name in (*_FIELDS, _VIEW) if name in group]
        # Of one stack the fields hold the values, of several references to them.
        if group[names[0]].dtype != h5py.ref_dtype:
            return [{name: value(group[name]) for name in names}]
        number = group[names[0]].size
        return [{name: value(file[group[name][()].ravel()[n]]) for name in names} for n in range(number)]
