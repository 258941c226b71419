"""Long-axis views in, the annulus of a valve out: a ring in space, and the plane through it.

A view through a ventricle and its atrium shows two points of the ring, the ends of the valve. A smooth ring is fitted
to the points of all views.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.ndimage import distance_transform_edt, label

from femprep.errors import Advice, InputError
from femprep.image import PlaneView, Segmentation
from femprep.image.views import mask_edges
from femprep.mesh.tangents import tangents
from femprep.model import BoolArray, FloatArray, Immutable, Notice, Plane, readonly
from femprep.model.functions import arctan2, sine_cosine
from femprep.model.products import product, unit_vectors
from femprep.wall.planes.round_off import CLEAR

#: Cavities on both sides of a valve.
VALVES: Final = {"mitral": ("lv", "la"), "tricuspid": ("rv", "ra")}
#: Unlabelled leaflets between both cavities are at most this thick, mm, and lie within this cosine of straight ahead.
_LEAFLETS, _AHEAD = 4.0, 0.7
#: A gap in the border of a valve is at most this wide, mm, and the border at least that long.
_GAP, _CHORD = 6.0, 10.0
#: Words in the names of views of the left outflow tract.
_OUTFLOW: Final = ("3ch", "lvot")
#: Standard deviations of the ring's prior: a point's place, mm; the tilt against the way from the cavity's middle to
#: the valve; the centre, mm; second and third harmonics of radius and of height, mm.
_POINT, _TILT, _CENTRE = 1.0, 0.3, 6.0
_RADIUS: Final = (3.0, 1.0)
_HEIGHT: Final = (1.5, 0.5)
#: Points farther off than so many standard deviations count less (Huber).
_FAR: Final = 2.0
#: Rounds of the fits of plane, circle and weights.
_PLANES, _CIRCLES, _WEIGHTS = 3, 20, 5
#: Points of the ring.
_COUNT: Final = 72


@dataclass(frozen=True, eq=False)
class Annulus(Immutable):
    """The ring that a valve's leaflets begin at.

    Attributes
    ----------
    valve : str
        ``"mitral"`` or ``"tricuspid"``.
    ring : (n, 3) array
        Points along the closed ring, mm LPS.
    points : (k, 3) array
        Points of it that views show, mm LPS.
    views : tuple of str
        Names of these views.
    plane : Plane
        The plane that fits the ring best; its normal points out of the ventricle.

    Examples
    --------
    >>> fp.find_annulus(seg.with_long_axis("patient_LA_ED_gt.nii.gz"))  # doctest: +SKIP
    Annulus('mitral': 2 points in 1 views)
    """

    valve: str
    ring: FloatArray
    points: FloatArray
    views: tuple[str, ...]
    plane: Plane

    def __post_init__(self) -> None:
        for name in ("ring", "points"):
            object.__setattr__(self, name, readonly(getattr(self, name), np.float64, (None, 3), name))

    def __repr__(self) -> str:
        return f"Annulus({self.valve!r}: {len(self.points)} points in {len(self.views)} views)"


def find_annulus(seg: Segmentation, valve: str = "mitral") -> Annulus:
    """Find the annulus of a valve in long-axis views.

    A view's landmarks of that name are used where it has them. Otherwise the two ends of the border between ventricle
    and atrium are used; where the left atrium has no label, the ends of the border between the left cavity and the
    background. In a view of the outflow tract (``3ch`` or ``lvot`` in its name, or landmarks of the aortic valve) that
    border ends at the aortic valve on the side of the right ventricle, so that only the other end is used. In the plane
    that fits the points, radius and height of the ring are Fourier series of the angle up to the third harmonic, each
    coefficient with a prior. Of one view with two points the ring is a circle.

    Parameters
    ----------
    seg : Segmentation
        With long-axis views; displaced ones moved back first (:func:`femprep.align_slices`).
    valve : {"mitral", "tricuspid"}

    Returns
    -------
    Annulus

    Raises
    ------
    InputError
        The valve is unknown, or views show fewer than two points of it.

    Examples
    --------
    >>> fp.find_annulus(seg)
    Traceback (most recent call last):
    femprep.errors.InputError: no long-axis view shows the mitral annulus...
    """
    if valve not in VALVES:
        raise InputError(f"valve {valve!r} is unknown; known are {', '.join(VALVES)}")
    found = _seen(seg, valve)
    points = np.concatenate([*found.values(), np.empty((0, 3))])
    if len(points) < 2:
        raise InputError(
            f"no long-axis view shows the {valve} annulus",
            advice=[Advice("give views of ventricle and atrium by --long-axis", "image.long_axis")],
        )
    middle = seg.grid.to_world(np.argwhere(seg.mask(VALVES[valve][0])).mean(axis=0))
    ring, normal = _ring(points, unit_vectors(points.mean(axis=0) - middle))
    source = f"{valve} annulus: {len(points)} points in {', '.join(found)}"
    return Annulus(valve, ring, points, tuple(found), Plane(ring.mean(axis=0), normal, source))


def annulus_base(seg: Segmentation, below: Sequence[str]) -> Plane:
    """The base plane parallel to that of the mitral annulus, nearer to the apex by what surfaces round off.

    It lies below the ring and below every point of some other valves that views show.
    """
    found = find_annulus(seg)
    others = [points for valve in below for points in _seen(seg, valve).values()]
    low = float(found.plane.signed_distance(np.concatenate([found.ring, *others])).min()) - CLEAR
    words = (
        "the base plane lies {amount} nearer to the apex than the plane of the mitral annulus: below its lowest point, "
        "and clear of where surfaces round off (--base-offset moves it)"
    )
    notices = [Notice.of("moved", words, amount=-low, unit="mm", place=found.plane.point)]
    if len(found.views) == 1:
        words = "one view shows the mitral annulus: its ring was assumed to be a circle through the points seen"
        notices.append(Notice.of("assumed", words))
    point = found.plane.point + low * found.plane.normal
    return replace(found.plane, point=point, ring=found.ring, notices=tuple(notices))


def valve_points(view: PlaneView, valve: str) -> FloatArray:
    """Points ``(k, 3)`` of a valve's annulus in a view, mm LPS; none where the view does not show the valve."""
    if valve in view.landmarks:
        return view.landmarks[valve]
    ventricle, atrium = VALVES[valve]
    beyond = _largest(view.mask(atrium)) if atrium in view.shown else None
    if ventricle not in view.shown or (beyond is None and valve != "mitral"):
        return np.empty((0, 3))
    ends = _ends(view, *_border(view, _largest(view.mask(ventricle)), beyond))
    outflow = "aortic" in view.landmarks or any(word in view.name.lower() for word in _OUTFLOW)
    if beyond is None and len(ends) and outflow:
        if "rv" not in view.shown:
            return np.empty((0, 3))
        right = view.to_world(np.argwhere(view.mask("rv")).mean(axis=0))
        return ends[[int(np.argmax(np.linalg.norm(ends - right, axis=1)))]]
    return ends


def _seen(seg: Segmentation, valve: str) -> dict[str, FloatArray]:
    """Points of a valve's annulus by the view that shows them."""
    return {view.name: points for view in seg.views if len(points := valve_points(view, valve))}


def _largest(mask: BoolArray) -> BoolArray:
    """The largest piece of a mask."""
    piece = label(mask)[0]
    return np.asarray(piece == np.argmax(np.bincount(piece[mask])))


def _border(view: PlaneView, cavity: BoolArray, beyond: BoolArray | None) -> tuple[FloatArray, FloatArray]:
    """Border of a cavity with another one, or with the background, pixel by pixel.

    Returns
    -------
    middles : (n, 2) array
        Points half-way between both cavities, mm along the view's axes.
    half : (n, 2) array
        From there to the end of the pixel's side, mm.
    """
    edges = mask_edges(cavity, view.origin, view.axes, view.spacing)
    outer = edges.points + 0.5 * edges.spacing[:, None] * edges.across
    row, column = np.rint(product(outer - view.origin, view.axes) / view.spacing).astype(int).T
    middles, across = (product(part, view.axes) for part in (edges.points - view.origin, edges.across))
    half = 0.5 * np.abs(across[:, ::-1]) * view.spacing
    valve = view.labels[row, column] == 0
    if beyond is not None:
        far, nearest = distance_transform_edt(~beyond, sampling=view.spacing, return_indices=True)
        way = (nearest[:, row, column].T - np.column_stack([row, column])) * view.spacing
        away = far[row, column]
        valve &= (away <= _LEAFLETS) & ((way * across).sum(axis=1) >= _AHEAD * away)
        valve |= away == 0.0
        middles = middles + 0.5 * way
    return middles[valve], half[valve]


def _ends(view: PlaneView, middles: FloatArray, half: FloatArray) -> FloatArray:
    """Both ends ``(2, 3)`` of a border, mm LPS, on a parabola through it; none where it is too short for a valve."""
    if len(middles) < 3:
        return np.empty((0, 3))
    for _ in range(2):  # of several pieces the one with most pixels, along its own direction
        centre = middles.mean(axis=0)
        along = np.linalg.svd(middles - centre, full_matrices=False)[2][0]
        x = product(middles - centre, along)
        order = np.argsort(x)
        piece = max(np.split(order, np.flatnonzero(np.diff(x[order]) > _GAP) + 1), key=len)
        middles, half = middles[piece], half[piece]
    across = np.array([-along[1], along[0]])
    x, y = product(middles - centre, along), product(middles - centre, across)
    reach = product(half, np.abs(along))
    low, high = float((x - reach).min()), float((x + reach).max())
    if high - low < _CHORD:
        return np.empty((0, 3))
    bend = np.polynomial.Polynomial.fit(x, y, min(2, len(x) - 1))
    ends = np.array([centre + t * along + bend(t) * across for t in (low, high)])
    return view.origin + product(ends, view.axes.T)


def _ring(points: FloatArray, out: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A smooth ring ``(n, 3)`` near points, and the unit normal of its plane; ``out`` points out of the ventricle."""
    middle, normal = points.mean(axis=0), out
    for _ in range(_PLANES):
        frame = np.column_stack([*tangents(normal[None])[0], normal])
        u, v, w = product(points - middle, frame).T
        level, *slope = _fit(np.column_stack([np.ones_like(u), u, v]), w, (np.inf, _TILT, _TILT))
        middle = middle + level * normal
        normal = unit_vectors(normal - product(frame[:, :2], np.array(slope)))
    frame = np.column_stack([*tangents(normal[None])[0], normal])
    u, v, w = product(points - middle, frame).T
    centre = np.zeros(2)
    for _ in range(_CIRCLES):
        x, y = u - centre[0], v - centre[1]
        waves = _waves(arctan2(y, x))
        reach = np.sqrt(x * x + y * y) + product(waves[:, 1:3], centre)
        radius = _fit(waves, reach, (np.inf, _CENTRE, _CENTRE, *np.repeat(_RADIUS, 2)))
        centre = 0.5 * (centre + radius[1:3])
    height = _fit(waves[:, 3:], w, tuple(np.repeat(_HEIGHT, 2)))
    waves = _waves(np.linspace(0.0, 2.0 * np.pi, _COUNT, endpoint=False))
    reach = product(waves[:, [0, 3, 4, 5, 6]], radius[[0, 3, 4, 5, 6]])
    ring = np.column_stack([centre + reach[:, None] * waves[:, 1:3], product(waves[:, 3:], height)])
    return middle + product(ring, frame.T), normal


def _waves(angle: FloatArray) -> FloatArray:
    """One, and cosine and sine of the first three multiples of angles, ``(k, 7)``."""
    found = [np.ones_like(angle)]
    for number in (1, 2, 3):
        found += sine_cosine(number * angle)[::-1]
    return np.column_stack(found)


def _fit(matrix: FloatArray, value: FloatArray, prior: tuple[float, ...]) -> FloatArray:
    """Coefficients by robust least squares, each with the standard deviation of its prior about 0."""
    weight, least = np.ones(len(value)), np.diag((_POINT / np.array(prior)) ** 2)
    for _ in range(_WEIGHTS):
        found = np.linalg.solve(product(matrix.T * weight, matrix) + least, product(matrix.T, weight * value))
        off = np.abs(value - product(matrix, found)) / _POINT
        weight = np.minimum(1.0, _FAR / np.maximum(off, _FAR))
    return np.asarray(found)
