"""A number of vertices in, evenly spread points and triangles on the unit sphere out: equal charges at rest (2.2)."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from femprep.errors import InputError
from femprep.mesh.compiled import compiled
from femprep.model import FloatArray
from femprep.template import store
from femprep.template.sphere import Template, fibonacci, triangulate

_log = logging.getLogger(__name__)

#: Bounds of the number of vertices: an icosahedron, and what a solver can still use of one surface.
LEAST, MOST = 12, 20_000
#: Up to this many charges all pairs repel each other; beyond, a charge only feels those within the reach.
_ALL_PAIRS = 3000
#: Steps of descent. The energy is flat: further ones only move rows of charges about.
_ITERATIONS = 400
#: Neighbours are looked up anew this many times.
_ROUNDS = 4
#: Longest move of a charge in one step, in spacings.
_LONGEST_MOVE = 0.3
#: Charges of a block, and the rows of its room: places, sums of 1/d and of the force.
_BLOCK = 32
_X, _Y, _Z, _SUM, _FX, _FY, _FZ = (_BLOCK * k for k in range(7))
_ROOM = _BLOCK * 7


def sphere_points(count: int) -> FloatArray:
    """Evenly spread unit vectors ``(count, 3)``, at least 4: equal charges at rest. Kept on disk."""
    if count < 4:
        raise InputError(f"{count} points asked for on a sphere, at least 4 are needed")
    return _kept(count).directions


def charge_template(vertices: int) -> Template:
    """Triangulated unit sphere with a given number of vertices, made once and kept on disk.

    Equal charges on a sphere are moved to a minimum of their electrostatic energy (Thomson's problem) from
    a golden spiral, and triangulated by their convex hull. Above 3000 charges the energy is cut off beyond the
    fourth ring of neighbours: the spiral already is even over long distances, and what is left is local order.

    Parameters
    ----------
    vertices : int
        Number of vertices V, 12 to 20,000. There are 2 V - 4 triangles.

    Raises
    ------
    InputError
        The number is out of range.

    References
    ----------
    L. Glasser, A. G. Every, "Energies and spacings of point charges on a sphere", 1992,
    doi 10.1088/0305-4470/25/9/020.
    """
    if not LEAST <= vertices <= MOST:
        raise InputError(f"template with {vertices} vertices asked for, expected {LEAST} to {MOST}")
    return _kept(vertices)


def _kept(count: int) -> Template:
    """The template of the store, made where it is not there yet."""
    template = store.load("charges", count, 2 * count - 4)
    if template is None:
        template = _make(count)
        store.save("charges", count, template)
    return template


def _make(count: int) -> Template:
    points = relax(fibonacci(count))
    # From north to south, as the spiral: neighbours in number are near each other.
    points = points[np.lexsort((points[:, 1], points[:, 0], -points[:, 2]))]
    return Template(points, triangulate(points))


def relax(directions: FloatArray) -> FloatArray:
    """Move equal charges on the unit sphere towards a minimum of their energy; unit vectors ``(n, 3)`` in and out."""
    count = len(directions)
    if count <= _ALL_PAIRS:
        return _descend(directions, _coulomb, _ITERATIONS)
    # Charges move by much less than a spacing in one round, so that lists of neighbours hold for it.
    for _ in range(_ROUNDS):
        directions = _descend(directions, partial(_screened, *_neighbours(directions)), _ITERATIONS // _ROUNDS)
    return directions


def _descend(directions: FloatArray, repel: Callable[..., None], iterations: int) -> FloatArray:
    """Steepest descent on the sphere with steps of Barzilai and Borwein (1988, doi 10.1093/imanum/8.1.141).

    It needs one evaluation a step and reaches in as many of them what a quasi-Newton method does; and its few sums
    are numpy's own, while those of a linear algebra library depend on the number of its threads.
    ``repel(points, share, force)`` gives each charge's energy and its gradient.
    """
    count = len(directions)
    force = np.empty((count, 3))
    share = np.empty(count)
    longest = _LONGEST_MOVE * _spacing(count)

    def slope(at: FloatArray) -> FloatArray:
        repel(at, share, force)
        return np.asarray(force - (force * at).sum(axis=1)[:, None] * at)

    points = np.array(directions)
    uphill = slope(points)
    step = longest / max(float(np.sqrt((uphill * uphill).sum(axis=1)).max()), 1e-300)
    for iteration in range(iterations):
        move = -step * uphill
        length = float(np.sqrt((move * move).sum(axis=1)).max())
        if length < 1e-7 * longest:
            break
        following = points + move * min(1.0, longest / length)
        following /= np.sqrt((following * following).sum(axis=1))[:, None]
        there = slope(following)
        moved, turned = following - points, there - uphill
        curvature = float((moved * turned).sum())
        if curvature <= 0.0:
            step *= 2.0
        elif iteration % 2:
            step = float((moved * moved).sum()) / curvature
        else:
            step = curvature / float((turned * turned).sum())
        points, uphill = following, there
    _log.debug("%d charges relaxed in %d steps to energy %.12g", count, iteration + 1, share.sum())
    return points


def _spacing(count: int) -> float:
    """Distance of neighbours when ``count`` points cover the unit sphere with equilateral triangles."""
    return float(np.sqrt(8.0 * np.pi / (np.sqrt(3.0) * count)))


@compiled(grain=2)
def _push(begin: int, end: int, points: Any, others: Any, share: Any, force: Any) -> None:
    """Half the sum of 1/d, and its gradient, over all other charges, for each charge of some blocks.

    Vector units are filled with the block's charges, so that each one's sums run over the others in their order,
    whatever the processor's width. The block's room is one array: the compiler then knows that its parts do not
    overlap.
    """
    room = np.empty(_ROOM)
    for first in range(begin * _BLOCK, end * _BLOCK, _BLOCK):
        count = min(_BLOCK, points.shape[0] - first)
        room[:] = 0.0
        for i in range(_BLOCK):
            at = first + min(i, count - 1)
            room[_X + i] = points[at, 0]
            room[_Y + i] = points[at, 1]
            room[_Z + i] = points[at, 2]
        for j in range(others.shape[1]):
            x, y, z = others[0, j], others[1, j], others[2, j]
            for i in range(_BLOCK):
                dx = x - room[_X + i]
                dy = y - room[_Y + i]
                dz = z - room[_Z + i]
                squared = dx * dx + dy * dy + dz * dz
                # The charge itself: no distance, no force.
                near = 1.0 / np.sqrt(squared) if squared > 0.0 else 0.0
                cube = near * near * near
                room[_SUM + i] += near
                room[_FX + i] += dx * cube
                room[_FY + i] += dy * cube
                room[_FZ + i] += dz * cube
        for i in range(count):
            share[first + i] = 0.5 * room[_SUM + i]
            force[first + i, 0] = room[_FX + i]
            force[first + i, 1] = room[_FY + i]
            force[first + i, 2] = room[_FZ + i]


def _coulomb(points: FloatArray, share: FloatArray, force: FloatArray) -> None:
    """Half the potential at each charge, and the gradient of the whole energy."""
    _push(-(-len(points) // _BLOCK), points, np.ascontiguousarray(points.T), share, force)


def _neighbours(directions: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Neighbour lists of the start positions (row starts, columns) and the reach of the cut-off force."""
    from scipy.spatial import cKDTree

    spacing = _spacing(len(directions))
    reach = 4.0 * spacing
    tree = cKDTree(directions)
    # A little wider than the reach: charges move by less than half a spacing.
    pairs = tree.query_pairs(reach + 1.5 * spacing, output_type="ndarray")
    both = np.concatenate([pairs, pairs[:, ::-1]])
    both = both[np.lexsort((both[:, 1], both[:, 0]))]
    starts = np.searchsorted(both[:, 0], np.arange(len(directions) + 1))
    return starts.astype(np.int64), np.ascontiguousarray(both[:, 1]), float(reach)


def _screened(starts: Any, columns: Any, reach: float, points: Any, share: Any, force: Any) -> None:
    _push_near(len(points), starts, columns, reach, points, share, force)


@compiled(grain=256)
def _push_near(
    first: int, last: int, starts: Any, columns: Any, reach: float, points: Any, share: Any, force: Any
) -> None:
    """As _coulomb, with 1/d smoothly brought to zero at the reach: (1 - d^2/reach^2)^3 / d."""
    inverse = 1.0 / (reach * reach)
    for i in range(first, last):
        total = 0.0
        fx = 0.0
        fy = 0.0
        fz = 0.0
        for k in range(starts[i], starts[i + 1]):
            j = columns[k]
            dx = points[j, 0] - points[i, 0]
            dy = points[j, 1] - points[i, 1]
            dz = points[j, 2] - points[i, 2]
            squared = dx * dx + dy * dy + dz * dz
            rest = 1.0 - squared * inverse
            if rest > 0.0 and squared > 0.0:
                near = 1.0 / np.sqrt(squared)
                total += rest * rest * rest * near
                pull = rest * rest * (rest * near * near * near + 6.0 * inverse * near)
                fx += dx * pull
                fy += dy * pull
                fz += dz * pull
        share[i] = 0.5 * total
        force[i, 0] = fx
        force[i, 1] = fy
        force[i, 2] = fz
