"""A surface that crosses itself in, the same locally smoothed until it does not, with how far it moved, out."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.search.intersection import self_intersections
from femprep.mesh.topology import adjacency, border_edges, enclosed_volume
from femprep.model import FloatArray, IntArray, Notice
from femprep.model.notice import spot

#: Farthest from the repaired surface that a corner of the given one may lie, mm.
FARTHEST: Final = 5.0
#: Steps of smoothing at most, and the share of the way to the neighbours' mean that each takes.
_STEPS, _SHARE = 100, 0.5


def uncrossed(name: str, points: FloatArray, cells: IntArray, pairs: IntArray) -> tuple[FloatArray, Notice]:
    """Smooth a surface where it crosses itself until no triangles cross; its rims stay.

    Parameters
    ----------
    name : str
        Of the surface, for messages.
    points : (n, 3) array
        mm.
    cells : (m, 3) array
        Triangles.
    pairs : (k, 2) array
        Triangles that cross.

    Raises
    ------
    InputError
        It still crosses itself, or would move by more than 5 mm.
    """
    beside = adjacency(cells, len(points)).tocsr().astype(np.float64)
    near = np.zeros(len(points))
    near[cells[pairs]] = 1.0
    near = near + beside @ near
    near[border_edges(cells)] = 0.0
    rows, at, crossing = np.flatnonzero(near), points.copy(), pairs
    around = beside[rows].multiply(1.0 / np.maximum(beside[rows].sum(axis=1), 1.0).reshape(-1, 1)).tocsr()
    for _ in range(_STEPS):
        at[rows] += _SHARE * (around @ at - at[rows])
        if not len(crossing := self_intersections(at, cells)):
            break
    distance = ClosestFinder(at, cells)(points[rows]).distance
    worst = points[rows[int(distance.argmax())]] if len(rows) else points[cells[pairs[0, 0], 0]]
    if len(crossing) or distance.max() > FARTHEST:
        reason = "still crosses itself" if len(crossing) else f"moves by {distance.max():.1f} mm"
        raise InputError(
            f"surface {name!r} crosses itself about {spot(worst)}, and smoothed there {reason} (at most {FARTHEST:.0f} "
            "mm are allowed); remove the fold in a mesh editor"
        )
    change = (enclosed_volume(at, cells) - enclosed_volume(points, cells)) / 1e3
    words = f"surface {name} crossed itself ({len(pairs)} pairs of triangles) and was smoothed there: it moved by up to"
    words += f" {{amount}} near {{place}}, and its volume changed by {change:+.2f} mL"
    return at, Notice.of("repaired", words, amount=float(distance.max()), unit="mm", place=worst)
