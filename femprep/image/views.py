"""Long-axis slices: labels on single planes in world space, each with its own pose, pixels and thickness."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.model import BoolArray, FloatArray, Immutable, IntArray, readonly
from femprep.model.arrays import integers, mapping
from femprep.model.products import product

#: Largest deviation of a plane's axes from unit length and a right angle: headers hold single precision.
_ORTHONORMAL = 1e-4


class MaskEdges(NamedTuple):
    """Where a plane shows the boundary of an object.

    Attributes
    ----------
    points : (n, 3) array
        Middles between two neighbouring pixels of which one shows the object, mm LPS.
    across : (n, 3) array
        Unit vector from the inner to the outer one.
    spacing : (n,) array
        Their distance, mm.
    """

    points: FloatArray
    across: FloatArray
    spacing: FloatArray


def mask_edges(mask: BoolArray, origin: FloatArray, axes: FloatArray, spacing: FloatArray) -> MaskEdges:
    """Where a mask ``(n, m)`` on a plane changes from pixel to pixel; origin, axes, spacing as of a PlaneView."""
    points, across, distance = [], [], []
    for axis in range(2):
        rows = np.moveaxis(mask, axis, 0)
        for side in (1, -1):
            inner, outer = (rows[:-1], rows[1:]) if side > 0 else (rows[1:], rows[:-1])
            index = np.argwhere(inner & ~outer) + np.array([0.5, 0.0])
            points.append(origin + product((index if axis == 0 else index[:, ::-1]) * spacing, axes.T))
            across.append(np.broadcast_to(side * axes[:, axis], (len(index), 3)))
            distance.append(np.full(len(index), spacing[axis]))
    return MaskEdges(np.concatenate(points), np.concatenate(across), np.concatenate(distance))


@dataclass(frozen=True, eq=False)
class PlaneView(Immutable):
    """One long-axis slice: labels on a plane in world space.

    Attributes
    ----------
    name : str
        Name of the view (``"4ch"``) or of its file.
    labels : (n, m) integer array
        Label numbers, 0 is background.
    structures : mapping of str to tuple of int
        Label numbers of each structure that the view shows, named as in a Segmentation.
    origin : (3,) array
        World position of the centre of pixel (0, 0), mm LPS.
    axes : (3, 2) array
        Unit vectors along which the first and the second index grow.
    spacing : (2,) array
        Pixel size along them, mm.
    thickness : float
        Thickness of the slice, mm.
    landmarks : mapping of str to (k, 3) array, optional
        Points that the view shows, mm LPS: ``"mitral"``, ``"tricuspid"``, ``"aortic"`` and ``"pulmonary"``, where the
        valve's leaflets begin, and ``"apex"``.

    Raises
    ------
    InputError
        A shape, an axis or a size is wrong.

    Examples
    --------
    >>> import numpy as np
    >>> labels = np.zeros((4, 5), dtype=int)
    >>> view = fp.PlaneView("4ch", labels, {"lv": (3,)}, [0, 0, 0], [[1, 0], [0, 0], [0, 1]], [1.4, 1.4], 6.0)
    >>> view.normal.tolist()
    [0.0, -1.0, 0.0]
    """

    name: str
    labels: IntArray
    structures: Mapping[str, tuple[int, ...]]
    origin: FloatArray
    axes: FloatArray
    spacing: FloatArray
    thickness: float
    landmarks: Mapping[str, FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        labels = np.asarray(self.labels)
        if labels.ndim != 2 or not np.issubdtype(labels.dtype, np.integer):
            raise InputError(f"view {self.name!r}: labels are {labels.dtype} {labels.shape}, expected integers (n, m)")
        if labels.flags.writeable:
            labels = labels.copy()
            labels.setflags(write=False)
        object.__setattr__(self, "labels", labels)
        found = mapping(self.structures, f"structures of view {self.name!r}").items()
        numbers = {name: tuple(np.atleast_1d(integers(n, f"structure {name!r}")).tolist()) for name, n in found}
        object.__setattr__(self, "structures", MappingProxyType(numbers))
        object.__setattr__(self, "origin", readonly(self.origin, np.float64, (3,), f"origin of view {self.name!r}"))
        object.__setattr__(self, "axes", readonly(self.axes, np.float64, (3, 2), f"axes of view {self.name!r}"))
        object.__setattr__(self, "spacing", readonly(self.spacing, np.float64, (2,), f"pixels of view {self.name!r}"))
        if not np.isfinite(self.origin).all() or not np.isfinite(self.axes).all():
            raise InputError(f"view {self.name!r}: its place in the world is not finite; check the header of its file")
        if np.abs(self.axes.T @ self.axes - np.eye(2)).max() > _ORTHONORMAL:
            raise InputError(f"view {self.name!r}: its axes {self.axes.T.tolist()} are not orthonormal")
        sizes = [*self.spacing.tolist(), float(self.thickness)]
        if not np.isfinite(sizes).all() or min(sizes) <= 0.0:
            raise InputError(
                f"view {self.name!r}: pixels and thickness are {sizes} mm, expected three positive numbers"
            )
        object.__setattr__(self, "thickness", float(self.thickness))
        own = mapping(self.landmarks, f"landmarks of view {self.name!r}").items()
        points = {name: readonly(p, np.float64, (None, 3), f"landmark {name!r} of {self.name!r}") for name, p in own}
        object.__setattr__(self, "landmarks", MappingProxyType(points))

    def __repr__(self) -> str:
        return f"PlaneView({self.name!r}: {' x '.join(map(str, self.labels.shape))} pixels, {', '.join(self.shown)})"

    @property
    def normal(self) -> FloatArray:
        """Unit vector across the plane, ``(3,)``: first axis times second axis.

        Examples
        --------
        >>> import numpy as np
        >>> view = fp.PlaneView("4ch", np.eye(4, dtype=int), {"lv": (1,)}, [0, 0, 0], np.eye(3)[:, :2], [1.4, 1.4], 6.0)
        >>> view.normal.tolist()
        [0.0, 0.0, 1.0]
        """
        return np.asarray(np.cross(self.axes[:, 0], self.axes[:, 1]))

    @property
    def shown(self) -> tuple[str, ...]:
        """Structures of which the view has a pixel.

        Examples
        --------
        >>> import numpy as np
        >>> view = fp.PlaneView("4ch", np.eye(4, dtype=int), {"lv": (1,)}, [0, 0, 0], np.eye(3)[:, :2], [1.4, 1.4], 6.0)
        >>> view.shown
        ('lv',)
        """
        return tuple(name for name, numbers in self.structures.items() if np.isin(self.labels, numbers).any())

    def mask(self, *structures: str) -> BoolArray:
        """Pixels of one or several structures together, ``(n, m)`` bool.

        Raises
        ------
        InputError
            The view does not name a structure.

        Examples
        --------
        >>> import numpy as np
        >>> view = fp.PlaneView("4ch", np.eye(4, dtype=int), {"lv": (1,)}, [0, 0, 0], np.eye(3)[:, :2], [1.4, 1.4], 6.0)
        >>> int(view.mask("lv").sum())
        4
        """
        for name in structures:
            if name not in self.structures:
                known = ", ".join(self.structures) or "none"
                raise InputError(f"view {self.name!r} names no structure {name!r} (named: {known})")
        return np.isin(self.labels, [number for name in structures for number in self.structures[name]])

    def showing(self, *structures: str) -> PlaneView | None:
        """The view of one object alone: 1 in its pixels; None where the view does not name all of its structures.

        Examples
        --------
        >>> import numpy as np
        >>> view = fp.PlaneView("4ch", np.eye(4, dtype=int), {"lv": (1,)}, [0, 0, 0], np.eye(3)[:, :2], [1.4, 1.4], 6.0)
        >>> view.showing("lv", "myo") is None
        True
        """
        if not set(structures) <= set(self.structures):
            return None
        return replace(self, labels=self.mask(*structures).astype(np.int64), structures={"object": (1,)})

    def to_world(self, index: npt.ArrayLike) -> FloatArray:
        """World points ``(k, 3)``, mm LPS, of fractional pixel indices ``(k, 2)``.

        Examples
        --------
        >>> import numpy as np
        >>> view = fp.PlaneView("4ch", np.eye(4, dtype=int), {"lv": (1,)}, [0, 0, 0], np.eye(3)[:, :2], [1.4, 1.4], 6.0)
        >>> view.to_world([[1, 2]]).tolist()
        [[1.4, 2.8, 0.0]]
        """
        local = np.asarray(index, dtype=np.float64) * self.spacing
        return np.asarray(self.origin + product(local, self.axes.T), dtype=np.float64)

    def moved(self, rotation: FloatArray, translation: FloatArray) -> PlaneView:
        """The same view rigidly moved in the world: ``x -> rotation @ x + translation``.

        Examples
        --------
        >>> import numpy as np
        >>> view = fp.PlaneView("4ch", np.eye(4, dtype=int), {"lv": (1,)}, [0, 0, 0], np.eye(3)[:, :2], [1.4, 1.4], 6.0)
        >>> view.moved(np.eye(3), np.array([0.0, 0.0, 5.0])).origin.tolist()
        [0.0, 0.0, 5.0]
        """
        landmarks = {name: product(points, rotation.T) + translation for name, points in self.landmarks.items()}
        origin = rotation @ self.origin + translation
        return replace(self, origin=origin, axes=rotation @ self.axes, landmarks=landmarks)
