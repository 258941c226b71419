"""Long-axis views in, the annulus of a valve out: a ring in space, and the plane through it.

A view through a ventricle and its atrium shows two points of the ring, the ends of the valve. A smooth ring is put
through those of all views.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.ndimage import distance_transform_edt, label

from femprep.errors import Advice, InputError
from femprep.image import PlaneView, Segmentation
from femprep.image.views import mask_edges
from femprep.mesh.tangents import tangents
from femprep.model import BoolArray, FloatArray, Immutable, Notice, Plane, readonly
from femprep.model.functions import sine_cosine
from femprep.model.products import unit_vectors
from femprep.wall.planes.round_off import CLEAR

#: Cavities on both sides of a valve.
VALVES: Final = {"mitral": ("lv", "la"), "tricuspid": ("rv", "ra")}
#: Unlabelled leaflets between both cavities are no thicker than this, mm.
_LEAFLETS: Final = 4.0
#: A gap in a valve is no wider than this, mm, and one that a view shows no narrower than that.
_GAP, _CHORD = 6.0, 10.0
#: Standard deviations: of points, mm; of the ring's tilt against the way from the cavity's middle to the valve; of its
#: centre, mm; of its second and third harmonics in radius and in height, mm.
_POINT: Final = 1.0
_TILT, _CENTRE = 0.3, 6.0
_RADIUS: Final = (3.0, 1.0)
_HEIGHT: Final = (1.5, 0.5)
#: Points farther off than so many standard deviations count less (Huber).
_FAR: Final = 2.0
_ROUNDS: Final = 20
#: Points of the ring.
_COUNT: Final = 72


@dataclass(frozen=True, eq=False)
class Annulus(Immutable):
    """The ring in which a valve is attached.

    Attributes
    ----------
    valve : str
        ``"mitral"`` or ``"tricuspid"``.
    ring : (n, 3) array
        Points along the closed ring, mm LPS.
    points : (k, 3) array
        What views show of it, mm LPS.
    views : tuple of str
        Names of these views.
    plane : Plane
        Fits the ring best; its normal points out of the ventricle.
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
        return f"Annulus({self.valve!r}: {len(self.points)} points of {len(self.views)} views)"


def find_annulus(seg: Segmentation, valve: str = "mitral") -> Annulus:
    """The annulus of a valve, from what long-axis views show.

    A view's landmarks of that name are taken where it has any. Else the two ends of the border between both cavities
    are (``lv`` and ``la``, or ``rv`` and ``ra``); where the atrium has no label, the ends of the left cavity's border
    with the background. In a view of the outflow tract, whose name contains ``3ch`` or ``lvot``, this border ends at
    the aortic valve on the side of the right ventricle, and only the other end counts.

    Parameters
    ----------
    seg : Segmentation
        With views (:meth:`~femprep.image.Segmentation.with_long_axis`), moved back together if they are displaced.
    valve : {"mitral", "tricuspid"}

    Returns
    -------
    Annulus

    Raises
    ------
    InputError
        The valve is unknown, or no view shows two points of it.

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
    inside = seg.mask(VALVES[valve][0])
    out = points.mean(axis=0) - seg.grid.to_world(np.argwhere(inside).mean(axis=0))
    ring, normal = _ring(points, unit_vectors(out))
    words = f"{valve} annulus: {len(points)} points of {', '.join(found)}"
    return Annulus(valve, ring, points, tuple(found), Plane(ring.mean(axis=0), normal, words))


def annulus_base(seg: Segmentation, valves: tuple[str, ...]) -> Plane:
    """The plane through the mitral annulus, as far towards the apex as surfaces round off at the end of the wall.

    It lies below every point that views show of the other valves, too.
    """
    found = find_annulus(seg)
    plane = found.plane
    others = [points for valve in valves for points in _seen(seg, valve).values()]
    low = float(plane.signed_distance(np.concatenate([found.ring, *others])).min()) - CLEAR
    words = (
        f"the base plane lies {{amount}} nearer to the apex than the {found.valve} annulus, as surfaces round off at "
        "the end of the wall (--base-offset moves it back)"
    )
    notice = Notice.of("moved", words, amount=-low, unit="mm", place=plane.point)
    return replace(plane, point=plane.point + low * plane.normal, notices=(notice,), ring=found.ring)


def _seen(seg: Segmentation, valve: str) -> dict[str, FloatArray]:
    """Points of a valve's annulus by the view that shows them."""
    return {view.name: points for view in seg.views if len(points := valve_points(view, valve))}


def valve_points(view: PlaneView, valve: str) -> FloatArray:
    """Points ``(k, 3)`` of a valve's annulus that a view shows, mm LPS; none where it does not show the valve."""
    none = np.empty((0, 3))
    if valve in view.landmarks:
        return view.landmarks[valve]
    ventricle, atrium = VALVES[valve]
    if ventricle not in view.shown:
        return none
    cavity = _largest(view.mask(ventricle))
    beyond = _largest(view.mask(atrium)) if atrium in view.shown else None
    if beyond is None and valve != "mitral":
        return none
    ends = _ends(view, _border(view, cavity, beyond))
    outflow = any(word in view.name.lower() for word in ("3ch", "lvot"))
    if beyond is None and outflow and len(ends):
        if "rv" not in view.shown:
            return none
        right = view.to_world(np.argwhere(view.mask("rv")).mean(axis=0))
        return ends[[int(np.argmax(np.linalg.norm(ends - right, axis=1)))]]
    return ends


def _largest(mask: BoolArray) -> BoolArray:
    """The largest piece of a mask."""
    piece = label(mask)[0]
    return np.asarray(piece == np.argmax(np.bincount(piece[mask])))


def _border(view: PlaneView, cavity: BoolArray, beyond: BoolArray | None) -> tuple[FloatArray, FloatArray]:
    """Middles ``(n, 3)`` of the border of a cavity with another one, or with the background, and its directions out."""
    edges = mask_edges(cavity, view.origin, view.axes, view.spacing)
    outer = edges.points + 0.5 * edges.spacing[:, None] * edges.across
    row, column = np.rint((outer - view.origin) @ view.axes / view.spacing).astype(int).T
    free = view.labels[row, column] == 0
    if beyond is None:
        return edges.points[free], edges.across[free]
    away, nearest = distance_transform_edt(~beyond, sampling=view.spacing, return_indices=True)
    way = view.to_world(np.column_stack([part[row, column] for part in nearest])) - outer
    away = away[row, column]
    ahead = np.einsum("qk,qk->q", way, edges.across) >= 0.7 * away
    valve = (away == 0.0) | (free & ahead & (away <= _LEAFLETS))
    return (edges.points + 0.5 * way)[valve], edges.across[valve]


def _ends(view: PlaneView, border: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Both ends ``(2, 3)`` of a border; none where it is shorter than a valve."""
    middles, across = border
    none = np.empty((0, 3))
    if len(middles) < 3:
        return none
    flat = (middles - view.origin) @ view.axes
    # Along the border, each pixel's side from corner to corner; of several pieces the one with most sides.
    side = (across @ view.axes)[:, ::-1] * [-1.0, 1.0]
    half = 0.5 * np.abs(side) @ view.spacing
    for _ in range(2):
        middle = flat.mean(axis=0)
        along = np.linalg.svd(flat - middle, full_matrices=False)[2][0]
        order = np.argsort((flat - middle) @ along)
        breaks = np.flatnonzero(np.diff((flat[order] - middle) @ along) > _GAP) + 1
        longest = max(np.split(order, breaks), key=len)
        flat, side, half = flat[longest], side[longest], half[longest]
    axes = np.array([along, [-along[1], along[0]]])
    x, y = ((flat - flat.mean(axis=0)) @ axes.T).T
    reach = np.abs(side @ along) * half
    low, high = float((x - reach).min()), float((x + reach).max())
    if high - low < _CHORD:
        return none
    bend = np.polynomial.Polynomial.fit(x, y, min(2, len(x) - 1))
    ends = np.array([[t, bend(t)] for t in (low, high)])
    return view.origin + (flat.mean(axis=0) + ends @ axes) @ view.axes.T


def _ring(points: FloatArray, out: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A smooth ring ``(n, 3)`` near points, and the unit normal of its plane; ``out`` points out of the ventricle.

    In a plane, then in polar coordinates: radius and height are Fourier series of the angle, fitted by least squares
    with a prior for every coefficient.
    """
    middle = points.mean(axis=0)
    frame = np.column_stack([*tangents(out[None])[0], out])
    for _ in range(3):
        u, v, w = ((points - middle) @ frame).T
        slope = _fit(np.column_stack([np.ones_like(u), u, v]), w, (np.inf, _TILT, _TILT))
        tilted = frame[:, 2] - frame[:, :2] @ slope[1:]
        frame = np.column_stack([*tangents(unit_vectors(tilted)[None])[0], unit_vectors(tilted)])
        middle = middle + slope[0] * frame[:, 2]
    u, v, w = ((points - middle) @ frame).T
    centre = np.zeros(2)
    for _ in range(_ROUNDS):
        angle = np.arctan2(v - centre[1], u - centre[0])
        radius = np.hypot(u - centre[0], v - centre[1])
        waves = _waves(angle, 3)
        prior = (np.inf, _CENTRE, _CENTRE, *np.repeat(_RADIUS, 2))
        shape = _fit(waves, radius + waves[:, 1:3] @ centre, prior)
        centre = 0.5 * (centre + shape[1:3])
    height = _fit(waves[:, 3:], w, np.repeat(_HEIGHT, 2))
    turn = _waves(np.arange(_COUNT) * (2.0 * np.pi / _COUNT), 3)
    shape[1:3] = 0.0
    flat = turn[:, 1:3] * (turn @ shape)[:, None] + centre
    return middle + np.column_stack([flat, turn[:, 3:] @ height]) @ frame.T, frame[:, 2]


def _waves(angle: FloatArray, order: int) -> FloatArray:
    """One, then cosine and sine of each multiple of angles, ``(k, 1 + 2 order)``."""
    found = [np.ones_like(angle)]
    for number in range(1, order + 1):
        sine, cosine = sine_cosine(number * angle)
        found += [cosine, sine]
    return np.column_stack(found)


def _fit(matrix: FloatArray, value: FloatArray, prior: tuple[float, ...] | FloatArray) -> FloatArray:
    """Coefficients by robust least squares with a prior standard deviation of each."""
    weight, least = np.ones(len(value)), np.diag((_POINT / np.asarray(prior, dtype=float)) ** 2)
    for _ in range(5):
        found = np.linalg.solve(matrix.T @ (weight[:, None] * matrix) + least, matrix.T @ (weight * value))
        off = np.abs(value - matrix @ found) / _POINT
        weight = np.minimum(1.0, _FAR / np.maximum(off, _FAR))
    return found
