"""Tetrahedra whose worst elements are poor in, the same tetrahedra with points moved out; tags and topology stay.

The quality of a tetrahedron here is the lesser of its mean ratio and its smallest sine of a dihedral angle (over the
regular tetrahedron's, so that it is small both for sharp and for blunt angles); it is negative where the tetrahedron
is inverted. First every point moves to where the mean of the mean ratio around it is better and no element poor;
then every point of a poor element searches for the place where the worst of its elements is best [1]_. Points inside
move in all directions, on a surface along it, on a rim along the rim. Deterministic.

References
----------
.. [1] Freitag & Ollivier-Gooch, Tetrahedral mesh improvement using swapping and smoothing, Int. J. Numer. Meth. Eng.
   40(21), 1997. doi:10.1002/(SICI)1097-0207(19971115)40:21<3979::AID-NME251>3.0.CO;2-9
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.compiled import compiled
from femprep.volume.constraints import Constraints

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

#: Sine of the regular tetrahedron's dihedral angle.
REGULAR_SINE: Final = 2.0 * np.sqrt(2.0) / 3.0
#: Elements below this quality are improved: an angle of 25 degrees or a mean ratio of 0.45.
POOR: Final = float(np.sin(np.radians(25.0)) / REGULAR_SINE)
#: A point is not put onto the wall where this would leave an element below this quality (and worse than before).
SOUND: Final = float(np.sin(np.radians(18.0)) / REGULAR_SINE)
#: As SOUND, for points that could not be put there: what they may cost at worst.
LEAST: Final = float(np.sin(np.radians(12.0)) / REGULAR_SINE)
#: How often all points are gone through for the mean quality.
RELAXATIONS: Final = 3
#: First step of a search by the mean edge length, inside and on a curved surface, and how often it is halved.
_FIRST_STEP: Final = 0.2
_SURFACE_STEP: Final = 0.06
_HALVINGS: Final = 5


@dataclass(frozen=True)
class Outcome:
    """Points after optimisation.

    Attributes
    ----------
    points : (n, 3) array
        mm.
    sweeps : int
        How often the poor elements were gone through.
    poor_before, poor_after : int
        Number of elements below the quality asked for.
    off_wall : float
        Greatest distance of a boundary point from the wall, mm.
    """

    points: FloatArray
    sweeps: int
    poor_before: int
    poor_after: int
    off_wall: float


def tet_quality(points: FloatArray, tets: IntArray) -> FloatArray:
    """Lesser of mean ratio and smallest sine of each tetrahedron, as described above, ``(m,)``."""
    out = np.empty(len(tets))
    _qualities(np.ascontiguousarray(points, dtype=np.float64), np.ascontiguousarray(tets, dtype=np.int64), out)
    return out


def optimise(
    points: FloatArray, tets: IntArray, constraints: Constraints, *, poor: float = POOR, sweeps: int = 12
) -> Outcome:
    """Put boundary points onto the wall and improve the worst elements.

    Points in planes are put there whatever it costs; other boundary points only where no element is spoiled. Then
    the mean quality is raised, and points of poor elements are moved, sweep by sweep, until none is left or nothing
    improves.

    Parameters
    ----------
    points : (n, 3) array
        mm; all of them in use.
    tets : (m, 4) array
        Tetrahedra.
    constraints : Constraints
        What holds the boundary points.
    poor : float
        Quality below which elements are improved.
    sweeps : int
        Most sweeps.
    """
    x = np.array(points, dtype=np.float64)
    cells = np.ascontiguousarray(tets, dtype=np.int64)
    start, around = _stars(cells, len(x))
    poor_before = int((tet_quality(x, cells) < poor).sum())
    constraints.flatten(x)
    basis = _put_back(x, x, cells, start, around, constraints, SOUND)
    for _ in range(RELAXATIONS):
        home = x.copy()
        _relax(x, cells, start, around, constraints.freedom, basis, poor)
        basis = _put_back(x, home, cells, start, around, constraints, SOUND)
    done, last = 0, (-np.inf, 0)
    for done in range(1, sweeps + 1):
        quality = tet_quality(x, cells)
        now = float(quality.min()), -int((quality < poor).sum())
        if now[1] == 0 or (now[0] <= last[0] + 1e-4 and now[1] <= last[1]):
            done -= 1
            break
        last, home = now, x.copy()
        _search(x, cells, start, around, _points_of_poor(quality, cells, poor), constraints.freedom, basis)
        basis = _put_back(x, home, cells, start, around, constraints, SOUND)
    # What is still off the wall goes there for a little less quality, which points inside then make good.
    basis = _put_back(x, x, cells, start, around, constraints, LEAST)
    inside = np.where(constraints.freedom == 3, 3, 0)
    for _ in range(2):
        _search(x, cells, start, around, _points_of_poor(tet_quality(x, cells), cells, poor), inside, basis)
    constraints.flatten(x)
    nodes, places, _ = constraints.targets(x)
    off = np.linalg.norm(places - x[nodes], axis=1)
    after = int((tet_quality(x, cells) < poor).sum())
    return Outcome(x, done, poor_before, after, float(off.max(initial=0.0)))


def _put_back(
    x: FloatArray,
    home: FloatArray,
    cells: IntArray,
    start: IntArray,
    around: IntArray,
    constraints: Constraints,
    sound: float,
) -> FloatArray:
    """Put boundary points back onto the wall, in place, and where they cannot go there back home; new directions."""
    nodes, places, basis = constraints.targets(x)
    _try_places(x, cells, start, around, nodes, places, sound)
    off = np.flatnonzero((x[nodes] != places).any(axis=1) & (x[nodes] != home[nodes]).any(axis=1))
    if len(off):
        _try_places(x, cells, start, around, nodes[off], home[nodes[off]], sound)
    return basis


def _points_of_poor(quality: FloatArray, cells: IntArray, poor: float) -> IntArray:
    """Points of elements below a quality, those of the worst first."""
    worst = np.flatnonzero(quality < poor)
    nodes = cells[worst[np.argsort(quality[worst], kind="stable")]].ravel()
    return np.asarray(nodes[np.sort(np.unique(nodes, return_index=True)[1])])


def _stars(cells: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Elements around each point: those of point v are ``around[start[v]:start[v + 1]]``."""
    order = np.argsort(cells.ravel(), kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(cells.ravel(), minlength=count))])
    return start.astype(np.int64), (order // 4).astype(np.int64)


@compiled()
def _shape(p: FloatArray, a: int, b: int, c: int, d: int) -> tuple[float, float]:
    """Mean ratio, and least sine over REGULAR_SINE, both signed by the volume."""
    ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
    vx, vy, vz = p[c, 0] - p[a, 0], p[c, 1] - p[a, 1], p[c, 2] - p[a, 2]
    wx, wy, wz = p[d, 0] - p[a, 0], p[d, 1] - p[a, 1], p[d, 2] - p[a, 2]
    # Twice the area vectors of the faces opposite to d, c, b; that opposite to a closes the surface.
    dx, dy, dz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    cx, cy, cz = wy * uz - wz * uy, wz * ux - wx * uz, wx * uy - wy * ux
    bx, by, bz = vy * wz - vz * wy, vz * wx - vx * wz, vx * wy - vy * wx
    ax, ay, az = bx + cx + dx, by + cy + dy, bz + cz + dz
    six = ux * bx + uy * by + uz * bz
    area_a, area_b = np.sqrt(ax * ax + ay * ay + az * az), np.sqrt(bx * bx + by * by + bz * bz)
    area_c, area_d = np.sqrt(cx * cx + cy * cy + cz * cz), np.sqrt(dx * dx + dy * dy + dz * dz)
    ab, ac, ad = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
    bc = (vx - ux) ** 2 + (vy - uy) ** 2 + (vz - uz) ** 2
    bd = (wx - ux) ** 2 + (wy - uy) ** 2 + (wz - uz) ** 2
    cd = (wx - vx) ** 2 + (wy - vy) ** 2 + (wz - vz) ** 2
    total = ab + ac + ad + bc + bd + cd
    least = min(area_a, area_b, area_c, area_d)
    if least <= 0.0 or total <= 0.0:
        return -1.0, -1.0
    # The sine at an edge is six volumes times its length by the products of twice the areas of its two faces.
    sine = np.sqrt(ab) / (area_c * area_d)
    sine = min(sine, np.sqrt(ac) / (area_b * area_d), np.sqrt(ad) / (area_b * area_c))
    sine = min(sine, np.sqrt(bc) / (area_a * area_d), np.sqrt(bd) / (area_a * area_c), np.sqrt(cd) / (area_a * area_b))
    ratio = 12.0 * np.cbrt(0.5 * abs(six)) ** 2 / total
    if six < 0.0:
        ratio = -ratio
    return ratio, sine * six / REGULAR_SINE


@compiled()
def _qualities(p: FloatArray, t: IntArray, out: FloatArray) -> None:
    for i in range(len(t)):
        ratio, sine = _shape(p, t[i, 0], t[i, 1], t[i, 2], t[i, 3])
        out[i] = min(ratio, sine)


@compiled()
def _star(p: FloatArray, t: IntArray, start: IntArray, around: IntArray, v: int, enough: float) -> float:
    """Worst quality of the elements around a point; any value not above ``enough`` as soon as it is certain."""
    worst: float = np.inf
    for k in range(start[v], start[v + 1]):
        i = around[k]
        ratio, sine = _shape(p, t[i, 0], t[i, 1], t[i, 2], t[i, 3])
        worst = min(worst, ratio, sine)
        if worst <= enough:
            return worst
    return worst


@compiled()
def _try_places(
    p: FloatArray,
    t: IntArray,
    start: IntArray,
    around: IntArray,
    nodes: IntArray,
    places: FloatArray,
    sound: float,
) -> None:
    """Put points at their places, one after the other, where the worst element around stays sound or gets no worse."""
    for i in range(len(nodes)):
        v = nodes[i]
        before = _star(p, t, start, around, v, -np.inf)
        x, y, z = p[v, 0], p[v, 1], p[v, 2]
        p[v] = places[i]
        if _star(p, t, start, around, v, -np.inf) < min(before, sound):
            p[v, 0], p[v, 1], p[v, 2] = x, y, z


@compiled()
def _star_mean(
    p: FloatArray, t: IntArray, start: IntArray, around: IntArray, v: int, enough: float
) -> tuple[float, float]:
    """Mean of the mean ratio and worst quality around a point; the mean is minus infinity if the worst is too poor."""
    worst, total = np.inf, 0.0
    for k in range(start[v], start[v + 1]):
        i = around[k]
        ratio, sine = _shape(p, t[i, 0], t[i, 1], t[i, 2], t[i, 3])
        worst = min(worst, ratio, sine)
        total += ratio
        if worst < enough:
            return -np.inf, worst
    return total / (start[v + 1] - start[v]), worst


@compiled()
def _relax(
    p: FloatArray,
    t: IntArray,
    start: IntArray,
    around: IntArray,
    freedom: IntArray,
    basis: FloatArray,
    poor: float,
) -> None:
    """Move each point once to a better mean ratio around it, no element becoming poor, or poorer if it is already."""
    home = np.empty(3)
    for v in range(len(p)):
        if freedom[v] == 0:
            continue
        best, worst = _star_mean(p, t, start, around, v, -np.inf)
        enough = min(worst, poor)
        length, count = 0.0, 0
        for k in range(start[v], start[v + 1]):
            for j in range(4):
                w = t[around[k], j]
                length += np.sqrt((p[w, 0] - p[v, 0]) ** 2 + (p[w, 1] - p[v, 1]) ** 2 + (p[w, 2] - p[v, 2]) ** 2)
                count += 1
        size = (_FIRST_STEP if freedom[v] == 3 else _SURFACE_STEP) * length / (0.75 * count)
        for _ in range(3):
            for k in range(freedom[v]):
                for way in (-1.0, 1.0):
                    home[:] = p[v]
                    p[v] = home + way * size * basis[v, k]
                    value, _ = _star_mean(p, t, start, around, v, enough)
                    if value > best:
                        best = value
                        break
                    p[v] = home
            size *= 0.5


@compiled()
def _search(
    p: FloatArray,
    t: IntArray,
    start: IntArray,
    around: IntArray,
    nodes: IntArray,
    freedom: IntArray,
    basis: FloatArray,
) -> None:
    """Move each point to where the worst element around it is best: compass search along its free directions."""
    step = np.empty(3)
    home = np.empty(3)
    for i in range(len(nodes)):
        v = nodes[i]
        if freedom[v] == 0:
            continue
        best = _star(p, t, start, around, v, -np.inf)
        length, count = 0.0, 0
        step[:] = 0.0
        for k in range(start[v], start[v + 1]):
            for j in range(4):
                w = t[around[k], j]
                if w != v:
                    length += np.sqrt((p[w, 0] - p[v, 0]) ** 2 + (p[w, 1] - p[v, 1]) ** 2 + (p[w, 2] - p[v, 2]) ** 2)
                    step += p[w] - p[v]
                    count += 1
        size = (_FIRST_STEP if freedom[v] == 3 else _SURFACE_STEP) * length / count
        if freedom[v] == 3:  # first the middle of the neighbours
            home[:] = p[v]
            p[v] = home + step / count
            value = _star(p, t, start, around, v, best)
            if value > best:
                best = value
            else:
                p[v] = home
        for _ in range(_HALVINGS):
            for _ in range(4):
                home[:] = p[v]
                chosen, sign = -1, 0.0
                for k in range(freedom[v]):
                    for way in (-1.0, 1.0):
                        p[v] = home + way * size * basis[v, k]
                        value = _star(p, t, start, around, v, best)
                        if value > best:
                            best, chosen, sign = value, k, way
                p[v] = home
                if chosen < 0:
                    break
                p[v] = home + sign * size * basis[v, chosen]
            size *= 0.5
