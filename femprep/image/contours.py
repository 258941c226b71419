"""Contours: outlines of the heart's surfaces, drawn on the planes of a short-axis stack and of long-axis views."""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from femprep.errors import InputError, cannot_write, quoted
from femprep.image.contour_file import file_of
from femprep.image.contour_labels import segmentation_of, views_of
from femprep.image.segmentation import Segmentation
from femprep.image.views import PlaneView
from femprep.model import FloatArray, Immutable, Notice, readonly
from femprep.model.products import product

#: Surfaces that a contour can outline.
SURFACES: Final = ("lv", "rv", "la", "ra", "epi", "rv_epi")
#: What single points can mark.
LANDMARKS: Final = ("mitral", "tricuspid", "aortic", "pulmonary", "apex")
#: Largest deviation of a plane's axes from unit length and a right angle: headers hold single precision.
_ORTHONORMAL: Final = 1e-4
#: Farthest that a point may lie off its plane, mm: contours are drawn on it, and files round.
_OFF_PLANE: Final = 1.0


@dataclass(frozen=True, eq=False)
class ContourPlane(Immutable):
    """The image plane that contours were drawn on.

    Attributes
    ----------
    name : str
        Name of the plane, by which contours refer to it.
    origin : (3,) array
        World position of the centre of the first pixel, mm LPS.
    axes : (3, 2) array
        Unit vectors along which the first and the second pixel index grow.
    spacing : (2,) array
        Pixel size along them, mm.
    thickness : float
        Thickness of the slice, mm.
    short_axis : bool
        Whether the plane is a slice of the short-axis stack; else it is a long-axis view.

    Raises
    ------
    InputError
        A number is not finite, a size is not positive, or the axes are not orthonormal.

    Examples
    --------
    >>> plane = fp.ContourPlane("4ch", [0, 0, 0], [[1, 0], [0, 0], [0, 1]], [1.4, 1.4], 6.0, short_axis=False)
    >>> plane.normal.tolist()
    [0.0, -1.0, 0.0]
    """

    name: str
    origin: FloatArray
    axes: FloatArray
    spacing: FloatArray
    thickness: float
    short_axis: bool

    def __post_init__(self) -> None:
        for field, shape in (("origin", (3,)), ("axes", (3, 2)), ("spacing", (2,))):
            value = readonly(getattr(self, field), np.float64, shape, f"{field} of plane {self.name!r}")
            object.__setattr__(self, field, value)
        object.__setattr__(self, "thickness", float(self.thickness))
        if not np.isfinite(self.origin).all():
            raise InputError(f"plane {self.name!r}: its origin {self.origin.tolist()} is not finite")
        if not np.abs(self.axes.T @ self.axes - np.eye(2)).max() <= _ORTHONORMAL:
            raise InputError(f"plane {self.name!r}: its axes {self.axes.T.tolist()} are not orthonormal")
        sizes = [*self.spacing.tolist(), self.thickness]
        if not np.isfinite(sizes).all() or min(sizes) <= 0.0:
            raise InputError(
                f"plane {self.name!r}: pixels and thickness are {sizes} mm, expected three positive numbers"
            )

    @property
    def normal(self) -> FloatArray:
        """Unit vector across the plane, ``(3,)``: first axis times second axis.

        Examples
        --------
        >>> plane = fp.ContourPlane("1", [0, 0, 0], [[1, 0], [0, 1], [0, 0]], [1.4, 1.4], 8.0, short_axis=True)
        >>> plane.normal.tolist()
        [0.0, 0.0, 1.0]
        """
        return np.asarray(np.cross(self.axes[:, 0], self.axes[:, 1]))

    def to_plane(self, points: FloatArray) -> FloatArray:
        """Place ``(n, 2)`` along the axes, mm from the origin, of world points ``(n, 3)``.

        Examples
        --------
        >>> import numpy as np
        >>> plane = fp.ContourPlane("1", [0, 0, 0], [[1, 0], [0, 1], [0, 0]], [1.4, 1.4], 8.0, short_axis=True)
        >>> plane.to_plane(np.array([[1.0, 2.0, 0.0]])).tolist()
        [[1.0, 2.0]]
        """
        return product(points - self.origin, self.axes)


@dataclass(frozen=True, eq=False)
class Contour(Immutable):
    """One outline, or the points of one landmark, on one plane.

    Attributes
    ----------
    surface : str
        A surface: cavities ``"lv"``, ``"rv"``, ``"la"``, ``"ra"`` (endocardium), ``"epi"`` (left ventricle with its
        myocardium, of which the septum is a part) and ``"rv_epi"`` (right ventricle with its free wall); or a
        landmark: ``"mitral"``, ``"tricuspid"``, ``"aortic"``, ``"pulmonary"``, ``"apex"``.
    points : (n, 3) array
        World points, mm LPS, in order along the line.
    plane : str
        Name of the plane.
    closed : bool
        Whether the line returns to its first point. An open one ends where the surface opens, as at a valve, and the
        straight line between its ends closes it.

    Raises
    ------
    InputError
        The surface is unknown, a point is not finite, or a line has fewer than three points.

    Examples
    --------
    >>> fp.Contour("lv", [[0, 0, 0], [9, 0, 0], [0, 9, 0]], "1", closed=True)
    Contour('lv': closed line of 3 points on '1')
    """

    surface: str
    points: FloatArray
    plane: str
    closed: bool

    def __post_init__(self) -> None:
        if self.surface not in SURFACES + LANDMARKS:
            known = ", ".join(SURFACES + LANDMARKS)
            raise InputError(f"contour on plane {self.plane!r}: its surface is {quoted(self.surface)}, known: {known}")
        what = f"{self.surface} contour on plane {self.plane!r}"
        object.__setattr__(self, "points", readonly(self.points, np.float64, (None, 3), what))
        if not np.isfinite(self.points).all():
            raise InputError(f"{what}: a point is not finite")
        least = 1 if self.is_landmark else 3
        if len(self.points) < least:
            raise InputError(f"{what}: has {len(self.points)} points, expected at least {least}")

    def __repr__(self) -> str:
        kind = "landmark" if self.is_landmark else f"{'closed' if self.closed else 'open'} line"
        return f"Contour({self.surface!r}: {kind} of {len(self.points)} points on {self.plane!r})"

    @property
    def is_landmark(self) -> bool:
        """Whether the points mark places instead of a line.

        Examples
        --------
        >>> fp.Contour("apex", [[0, 0, 0]], "4ch", closed=False).is_landmark
        True
        """
        return self.surface in LANDMARKS


@dataclass(frozen=True, eq=False)
class Contours(Immutable):
    """The contours of one heart at one time.

    Attributes
    ----------
    planes : tuple of ContourPlane
        The planes, each with a name of its own; those of the short-axis stack in any order.
    contours : tuple of Contour
        Outlines and landmarks, each on one of the planes.
    source : str
        Where they come from, usually a file.
    notices : tuple of Notice
        What was assumed or repaired while reading.

    Raises
    ------
    InputError
        There are no contours, two planes share a name, a contour names a plane that is not there, or lies off it.

    Examples
    --------
    >>> plane = fp.ContourPlane("1", [0, 0, 0], [[1, 0], [0, 1], [0, 0]], [1.4, 1.4], 8.0, short_axis=True)
    >>> fp.Contours((plane,), (fp.Contour("lv", [[0, 0, 0], [9, 0, 0], [0, 9, 0]], "1", closed=True),))
    Contours(1 short-axis plane, 0 long-axis planes: 1 lv)
    """

    planes: tuple[ContourPlane, ...]
    contours: tuple[Contour, ...]
    source: str = ""
    notices: tuple[Notice, ...] = ()

    def __post_init__(self) -> None:
        for name in ("planes", "contours", "notices"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        where = f"{self.source}: " if self.source else ""
        if not self.contours:
            raise InputError(f"{where}holds no contours")
        name, count = Counter(plane.name for plane in self.planes).most_common(1)[0] if self.planes else ("", 0)
        if count > 1:
            raise InputError(f"{where}{count} planes are named {name!r}; give each a name of its own")
        planes = {plane.name: plane for plane in self.planes}
        for one in self.contours:
            if one.plane not in planes:
                raise InputError(f"{where}a {one.surface} contour lies on plane {one.plane!r}, which is not there")
            plane = planes[one.plane]
            off = np.abs(product(one.points - plane.origin, plane.normal)).max()
            if off > _OFF_PLANE:
                raise InputError(
                    f"{where}the {one.surface} contour on plane {one.plane!r} lies {off:.1f} mm off it; check the "
                    "plane's position and orientation"
                )

    def __repr__(self) -> str:
        short = sum(plane.short_axis for plane in self.planes)
        long = len(self.planes) - short
        counts = ", ".join(f"{n} {name}" for name, n in Counter(one.surface for one in self.contours).items())
        planes = f"{short} short-axis plane{'s' * (short != 1)}, {long} long-axis plane{'s' * (long != 1)}"
        return f"Contours({planes}: {counts})"

    def on(self, plane: str, surface: str) -> tuple[Contour, ...]:
        """Contours of one surface, or of one landmark, on one plane.

        Examples
        --------
        >>> fp.read_contours("GPFile_000.txt").on("2", "lv")  # doctest: +SKIP
        (Contour('lv': closed line of 62 points on '2'),)
        """
        return tuple(one for one in self.contours if one.plane == plane and one.surface == surface)

    def views(self, *, pixel: float | None = None) -> tuple[PlaneView, ...]:
        """The long-axis planes as views, with their landmarks.

        Parameters
        ----------
        pixel : float, optional
            Pixel size of the labels, mm; two thirds of the plane's where not given.

        Examples
        --------
        >>> seg = seg.with_views(*fp.read_contours("GPFile_000.txt").views())  # doctest: +SKIP
        """
        return views_of(self, pixel)

    def to_segmentation(self, *, pixel: float | None = None) -> Segmentation:
        """Labels inside of the contours: the short-axis planes as a stack, the long-axis planes as its views.

        Where contours overlap, a pixel is the left ventricle's first, then its myocardium's, the right ventricle's, an
        atrium's, and the right ventricle's wall last. Where short-axis planes are not equally spaced, slices between
        them are interpolated, and a notice reports it.

        Parameters
        ----------
        pixel : float, optional
            Pixel size of the labels, mm; two thirds of the planes' smallest where not given, because contours are known
            to less than a pixel.

        Returns
        -------
        Segmentation
            With ``lv``, ``myo``, ``rv``, ``rv_wall``, ``la``, ``ra``, as far as there are contours.

        Raises
        ------
        InputError
            Fewer than two short-axis planes have contours, or they are not parallel.
        OptionError
            The pixel size is not positive.

        Examples
        --------
        >>> fp.read_contours("GPFile_000.txt").to_segmentation()  # doctest: +SKIP
        Segmentation(138 x 116 x 5 voxels of 0.938 x 0.938 x 17.7 mm: lv, myo, rv, rv_wall)
        """
        return segmentation_of(self, pixel)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a JSON file, which :func:`femprep.read_contours` reads; its schema is ``contours.json``.

        Raises
        ------
        FileError
            The file cannot be written.

        Examples
        --------
        >>> fp.read_contours("GPFile_000.txt").save("contours.json")  # doctest: +SKIP
        """
        text = file_of(self).model_dump_json(indent=1)
        try:
            Path(path).write_text(text + "\n", encoding="utf-8")
        except OSError as error:
            raise cannot_write(f"file {os.fspath(path)!r}", error, "choose another place") from None
