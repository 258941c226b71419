"""A Segmentation in, the breath-hold shift of each of its slices out; and the same with its slices moved back.

Each slice of a stack is taken in a breath-hold of its own, and lies displaced in its plane where the heart was not
where it was in the last one. All structures of a slice are displaced together, while the heart's own shape, tilt and
bend make them move smoothly and each in its own way: that tells the two apart. A displacement that is itself a straight
line along the stack (the whole heart sheared) cannot be told from the heart, and is left.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

import numpy as np

from femprep.image.left_out import leave_out_slices
from femprep.image.mixed import find_jumps
from femprep.image.segmentation import Segmentation
from femprep.model import FloatArray, Immutable, IntArray, Notice, readonly, records

_log = logging.getLogger(__name__)

#: A structure counts in slices where it has this many pixels, and if it has at least so many such slices.
_PIXELS: Final = 12
_SLICES: Final = 5
#: Least standard deviation of a structure's centroid, in pixels.
_NOISE: Final = 0.15
#: Twice the logarithm of the ratio of likelihoods from which shifts are believed: by chance about once in 140 stacks.
_EVIDENCE: Final = 6.0


class ViewMotion(NamedTuple):
    """How a long-axis view is moved to where the heart is: ``x -> rotation @ x + translation``, mm LPS.

    Attributes
    ----------
    name : str
    rotation : (3, 3) array
    translation : (3,) array
    way : float
        How far its middle moves, mm.
    """

    name: str
    rotation: FloatArray
    translation: FloatArray
    way: float

    @property
    def angle(self) -> float:
        """Angle of the rotation, degrees."""
        return float(np.degrees(np.arccos(np.clip(0.5 * (np.trace(self.rotation) - 1.0), -1.0, 1.0))))


@dataclass(frozen=True, eq=False)
class SliceShifts(Immutable):
    """How far slices lie displaced in their planes.

    Attributes
    ----------
    axis : int
        Grid axis across the slices.
    index : (n,) array
        Numbers of the slices that hold a structure, increasing.
    shift : (n, 2) array
        Displacement along the two in-plane axes of the grid, in their order, mm; zero where none are seen.
    deviation : (n,) array
        Standard deviation of each of the two, mm; it holds what looks like a tilt or a bend of the whole heart.
    evidence : float
        Of the estimate from centroids, twice the logarithm of the ratio of likelihoods with shifts and without, below 6
        all shifts are zero; of the joint one, squares of the shifts over their variances.
    zigzag : tuple of 2 floats
        Greatest in-plane distance of a structure's centroid from the middle of its neighbours', mm: as it is, and with
        the slices moved back.
    structures : tuple of str
        Structures the shifts were found from.
    views : tuple of ViewMotion
        How the long-axis views are moved back.
    left_out : tuple of str
        Names of views that contradict all other planes.
    slices_left_out : tuple of int
        Slices that do; not in ``index``.

    Examples
    --------
    >>> shifts = fp.estimate_shifts(seg)
    >>> shifts.shift.shape == (len(shifts.index), 2)
    True
    """

    axis: int
    index: IntArray
    shift: FloatArray
    deviation: FloatArray
    evidence: float
    zigzag: tuple[float, float]
    structures: tuple[str, ...]
    views: tuple[ViewMotion, ...] = ()
    left_out: tuple[str, ...] = ()
    slices_left_out: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.index)
        object.__setattr__(self, "index", readonly(self.index, np.int64, (count,), "slice index"))
        object.__setattr__(self, "shift", readonly(self.shift, np.float64, (count, 2), "slice shift"))
        object.__setattr__(self, "deviation", readonly(self.deviation, np.float64, (count,), "shift deviation"))

    def __repr__(self) -> str:
        return f"SliceShifts({len(self.index)} slices, {self.largest:.1f} mm at most)"

    @property
    def expected(self) -> float:
        """Expected length of what is left of a slice's shift once it is moved back, rms, mm.

        Examples
        --------
        >>> fp.estimate_shifts(seg).expected >= 0.0
        True
        """
        return float(np.sqrt(2.0 * np.mean(self.deviation**2))) if len(self.deviation) else 0.0

    @property
    def largest(self) -> float:
        """Length of the largest shift, mm.

        Examples
        --------
        >>> bool(fp.estimate_shifts(seg).largest < 1.0)
        True
        """
        return float(np.linalg.norm(self.shift, axis=1).max(initial=0.0))

    def record(self) -> dict[str, Any]:
        """All of it, JSON-ready, with its notice.

        Examples
        --------
        >>> sorted(fp.estimate_shifts(seg).record())[:2]
        ['axis', 'evidence']
        """
        return {
            "unit": "mm",
            "axis": self.axis,
            "slices": [
                {"slice": int(k), "shift": [float(x) for x in s], "deviation": round(float(d), 2)}
                for k, s, d in zip(self.index, self.shift, self.deviation)
            ],
            "evidence": round(self.evidence, 2),
            "zigzag": [round(z, 2) for z in self.zigzag],
            "structures": list(self.structures),
            "expected": round(self.expected, 2),
            "views": [{"view": v.name, "way": round(v.way, 2), "angle": round(v.angle, 2)} for v in self.views],
            "left_out": list(self.left_out),
            "slices_left_out": list(self.slices_left_out),
            "notices": records(*self.notices),
        }

    @property
    def notice(self) -> Notice:
        """What was done, for people.

        Examples
        --------
        >>> fp.estimate_shifts(seg).notice.kind
        'moved'
        """
        if self.largest:
            moved = ", ".join(f"{k}: ({x:+.1f}, {y:+.1f})" for k, (x, y) in zip(self.index, self.shift) if x or y)
            line = (
                "slices were moved back in their planes against breath-hold shifts of up to {amount}; "
                f"expected residual {self.expected:.1f} mm rms; "
                f"largest zig-zag of a centroid {self.zigzag[0]:.1f} mm before, {self.zigzag[1]:.1f} mm after; shifts "
                f"in mm along the image's in-plane axes, by slice: {moved}"
            )
            return Notice.of("moved", line, amount=self.largest, unit="mm")
        line = (
            "no slice was moved: the labels show no breath-hold shifts beyond what an estimate would leave "
            f"({self.expected:.1f} mm rms)"
        )
        return Notice.of("moved", line, amount=0.0, unit="mm")

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What was done to the slices and to each view, for people.

        Examples
        --------
        >>> len(fp.estimate_shifts(seg).notices)
        1
        """
        found = [self.notice]
        for view in self.views:
            line = f"long-axis view {view.name} was moved by {{amount}} and turned by {view.angle:.1f} degrees"
            found.append(Notice.of("moved", line, amount=view.way, unit="mm"))
        for name in self.left_out:
            line = (
                f"long-axis view {name} was left out: its outlines contradict the slices and the other views wherever "
                "it is moved; check that it shows the same heart in the same phase"
            )
            found.append(Notice.of("left out", line))
        for k in self.slices_left_out:
            line = (
                f"slice {k} was left out and interpolated from its neighbours: wherever it is moved, its outlines "
                "contradict the other slices; check its labels"
            )
            found.append(Notice.of("left out", line))
        return tuple(found)


def estimate_shifts(seg: Segmentation) -> SliceShifts:
    """Estimate how far each slice of a stack is displaced in its plane, from the labels alone.

    In each slice the centroid of every named structure, its holes filled, is taken. Their smooth courses along the
    stack and the jumps they share are separated by :func:`~femprep.image.mixed.find_jumps`. A slice in which structures
    have another form than in those next to it, as where the stack ends in the middle of the valves, tells little.

    Parameters
    ----------
    seg : Segmentation
        A stack of slices; only structures with a name count.

    Returns
    -------
    SliceShifts
        To 0.01 mm. All zero where fewer than five slices hold a structure, or where the labels give no evidence of
        shifts beyond what smooth structures and errors of their outlines explain.

    Examples
    --------
    >>> float(abs(fp.estimate_shifts(seg).shift).max()) < 1.0
    True
    """
    axis, flat = seg.stack_axis, list(seg.grid.flat_axes)
    spacing = seg.grid.spacing[flat]
    names, places, positions, changes = [], [], [], []
    for name in seg.structures:
        if not set(seg.structures[name]) <= set(seg.present):
            continue
        place, position, change = _outlines(np.moveaxis(seg.mask(name), axis, 0), spacing)
        if len(place) >= _SLICES:
            names.append(name)
            places.append(place)
            changes.append(change)
            positions.append(position + seg.grid.offset_at(place)[:, flat])
    if not names:
        return SliceShifts(axis, np.empty(0, dtype=np.int64), np.empty((0, 2)), np.empty(0), 0.0, (0.0, 0.0), ())
    jumps = find_jumps(places, positions, changes, float(seg.grid.spacing[axis]), _NOISE * float(spacing.max()))
    shift = np.round(jumps.size, 2) if jumps.evidence >= _EVIDENCE else np.zeros_like(jumps.size)
    at = [np.searchsorted(jumps.place, place) for place in places]
    before = max(_zigzag(position) for position in positions)
    after = max(_zigzag(position - shift[rows]) for position, rows in zip(positions, at))
    # A rounded zero may carry a sign.
    return SliceShifts(axis, jumps.place, shift + 0.0, jumps.deviation, jumps.evidence, (before, after), tuple(names))


def move_back(seg: Segmentation, shifts: SliceShifts) -> Segmentation:
    """Undo shifts: see :func:`femprep.align_slices`."""
    info = {**seg.info, "slice_shifts": shifts.record()}
    for notice in shifts.notices:
        _log.info(notice.what)
    known = {view.name: view for view in shifts.views}
    views = tuple(
        view.moved(known[view.name].rotation, known[view.name].translation) if view.name in known else view
        for view in seg.views
        if view.name not in shifts.left_out
    )
    if shifts.slices_left_out:
        seg = leave_out_slices(seg, shifts.slices_left_out)
    seg = replace(seg, info=info, views=views)
    if not shifts.largest:
        return seg
    axis = shifts.axis
    flat = [a for a in range(3) if a != axis]
    count = seg.grid.shape[axis]
    # Slices without a structure move with those next to them.
    back = -np.stack([_every(shifts.index, shifts.shift[:, a], count) for a in range(2)], axis=1)
    pixels = np.rint(back / seg.grid.spacing[flat]).astype(np.int64)
    room = int(np.abs(pixels).max())
    padding = [(0, 0) if a == axis else (room, room) for a in range(3)]
    wide = np.moveaxis(np.pad(seg.labels, padding), axis, 0)
    moved = np.stack([np.roll(plane, step, axis=(0, 1)) for plane, step in zip(wide, pixels)])
    labels = np.ascontiguousarray(np.moveaxis(moved, 0, axis))
    corner = [0 if a == axis else -room for a in range(3)]
    grid = seg.grid.window((corner[0], corner[1], corner[2]), labels.shape)
    offsets = np.array(grid.offset_at(np.arange(count)))
    offsets[:, flat] += back - pixels * seg.grid.spacing[flat]
    return replace(seg, labels=labels, grid=replace(grid, offsets=offsets))


def scanned_places(seg: Segmentation, index: FloatArray) -> FloatArray:
    """World points at which (fractional) indices of a stack lay before its slices were moved back.

    Parameters
    ----------
    seg : Segmentation
        As :func:`align_slices` returned it, or any other: then its places as they are.
    index : (n, 3) array

    Returns
    -------
    (n, 3) array
        mm LPS; between slices the shift is interpolated.
    """
    places = seg.grid.to_world(index)
    record = seg.info.get("slice_shifts")
    if not record or not record["slices"]:
        return places
    axis = int(record["axis"])
    flat = [a for a in range(3) if a != axis]
    numbers = np.array([one["slice"] for one in record["slices"]])
    shift = np.array([one["shift"] for one in record["slices"]], dtype=np.float64)
    count = seg.grid.shape[axis]
    every = [np.interp(index[:, axis], np.arange(count), _every(numbers, shift[:, a], count)) for a in range(2)]
    return np.asarray(places + np.stack(every, axis=1) @ seg.grid.direction[:, flat].T, dtype=np.float64)


def _outlines(stack: Any, spacing: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Slices of a structure; in each its centroid with holes filled, and how its form differs from its neighbour's, mm.

    Forms are compared when brought to the same centroid and area: the share of one that lies outside the other, times
    the radius of a disc of that area. The neighbour that is more alike counts.
    """
    from scipy import ndimage

    places = np.flatnonzero(np.count_nonzero(stack, axis=(1, 2)) >= _PIXELS)
    planes = [ndimage.binary_fill_holes(stack[k]) for k in places]
    pixels = [np.argwhere(plane) * spacing for plane in planes]
    centre = np.array([points.mean(axis=0) for points in pixels]).reshape(-1, 2)
    radius = np.sqrt(np.array([len(points) for points in pixels]) * spacing.prod() / np.pi)

    def outside(a: int, b: int) -> float:
        there = (centre[b] + (pixels[a] - centre[a]) * (radius[b] / radius[a])) / spacing
        return 1.0 - float(ndimage.map_coordinates(planes[b].astype(np.float64), there.T, order=1).mean())

    pairs = {(a, a + 1): outside(a, a + 1) for a in range(len(places) - 1)}
    change = [min(pairs.get((a - 1, a), 1.0), pairs.get((a, a + 1), 1.0)) for a in range(len(places))]
    return places, centre, np.array(change) * radius


def zigzags(seg: Segmentation, index: IntArray, shift: FloatArray) -> tuple[float, float]:
    """Greatest distance of a centroid from the middle of its neighbours', mm, before and after slices move back."""
    before, after = 0.0, 0.0
    flat = list(seg.grid.flat_axes)
    for name in seg.structures:
        if set(seg.structures[name]) <= set(seg.present):
            place, position, _ = _outlines(np.moveaxis(seg.mask(name), seg.stack_axis, 0), seg.grid.spacing[flat])
            known = np.isin(place, index)
            place, position = place[known], position[known]
            if len(place) > 2:
                before = max(before, _zigzag(position))
                after = max(after, _zigzag(position - shift[np.searchsorted(index, place)]))
    return before, after


def _zigzag(position: FloatArray) -> float:
    """Greatest distance of a position from the middle of its neighbours', mm."""
    bend = position[1:-1] - 0.5 * (position[:-2] + position[2:])
    return float(np.linalg.norm(bend, axis=1).max(initial=0.0))


def _every(index: IntArray, values: FloatArray, count: int) -> FloatArray:
    """Values for all slices: between those that have one interpolated, beyond them the last one's."""
    return np.asarray(np.interp(np.arange(count), index, values))
