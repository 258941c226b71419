"""The passes that improve a mesh: boundary points onto the wall, the mean quality up, the worst elements mended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from femprep.mesh.stars import coloured, stars
from femprep.model import BoolArray, FloatArray, IntArray
from femprep.volume.optimise.constraints import Constraints
from femprep.volume.optimise.quality import REGULAR_SINE, qualities
from femprep.volume.optimise.relax import relax
from femprep.volume.optimise.search import search, try_places

#: Elements below this quality are improved: an angle of 25 degrees or a mean ratio of 0.45.
POOR: Final = float(np.sin(np.radians(25.0)) / REGULAR_SINE)
#: A point is not put onto the wall where this would leave an element below this quality (and worse than before).
SOUND: Final = float(np.sin(np.radians(18.0)) / REGULAR_SINE)
#: As SOUND, for points that could not be put there: what they may cost at worst.
LEAST: Final = float(np.sin(np.radians(12.0)) / REGULAR_SINE)
#: How often all points are gone through for the mean quality at most, and the gain that makes it worth to go on: each
#: time brings about a fifth of what the one before did.
RELAXATIONS: Final = 3
WORTH: Final = 0.005


@dataclass(frozen=True)
class Optimised:
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

    def record(self) -> dict[str, Any]:
        """What was done, for the record of a run."""
        return {
            "sweeps": self.sweeps,
            "poor_elements_before": self.poor_before,
            "poor_elements_after": self.poor_after,
        }


def tet_quality(points: FloatArray, tets: IntArray) -> FloatArray:
    """Lesser of mean ratio and smallest sine of each tetrahedron, as the package describes it, ``(m,)``."""
    out = np.empty(len(tets))
    every = np.ones(len(points), dtype=np.bool_)
    p = np.array(points, dtype=np.float64, order="C")
    qualities(len(tets), p, np.ascontiguousarray(tets, dtype=np.int64), every, out)
    return out


def optimise(
    points: FloatArray,
    tets: IntArray,
    constraints: Constraints,
    *,
    poor: float = POOR,
    worth: float = WORTH,
    sweeps: int = 12,
) -> Optimised:
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
    worth : float
        Gain of mean quality by going through all points for which it is done once more.
    sweeps : int
        Most sweeps.
    """
    mesh = _Mesh(points, tets, constraints)
    poor_before = int((mesh.quality() < poor).sum())
    mesh.put_back(SOUND)
    for _ in range(sweeps):  # the mean quality around an inverted element has no slope to follow
        quality = mesh.quality()
        if quality.min() > 0.0:
            break
        mesh.search(_points_of_poor(quality, mesh.cells, poor), constraints.freedom)
        mesh.put_back(SOUND)
    before = float(mesh.quality().mean())
    for _ in range(RELAXATIONS):
        mesh.relax(poor)
        mesh.put_back(SOUND)
        after = float(mesh.quality().mean())
        if after - before < worth:
            break
        before = after
    done, last = 0, (-np.inf, 0)
    for done in range(1, sweeps + 1):
        quality = mesh.quality()
        now = float(quality.min()), -int((quality < poor).sum())
        if now[1] == 0 or (now[0] <= last[0] + 1e-4 and now[1] <= last[1]):
            done -= 1
            break
        last = now
        mesh.search(_points_of_poor(quality, mesh.cells, poor), constraints.freedom)
        mesh.put_back(SOUND)
    # What is still off the wall goes there for a little less quality, which points inside then make good.
    mesh.put_back(LEAST)
    inside = np.where(constraints.freedom == 3, 3, 0)
    for _ in range(2):
        mesh.search(_points_of_poor(mesh.quality(), mesh.cells, poor), inside)
    poor_after = int((mesh.quality() < poor).sum())
    return Optimised(mesh.points, done, poor_before, poor_after, mesh.off_wall())


class _Mesh:
    """A mesh whose points move, with what tells where each may go and which may find a better place."""

    def __init__(self, points: FloatArray, tets: IntArray, constraints: Constraints) -> None:
        self.points = np.array(points, dtype=np.float64)
        # Never written to, and said so: kernels compile once for arrays that may be and once for those that may not.
        self.cells = np.ascontiguousarray(tets, dtype=np.int64).view()
        self.cells.flags.writeable = False
        self._constraints = constraints
        constraints.flatten(self.points)
        self._star = stars(self.cells, len(self.points))
        self._arrays = (self.points, self.cells, *self._star)
        self._held, self._places, self._basis = constraints.targets(self.points)
        self._looked_up = self.points.copy()
        self._home = self.points.copy()
        self._fresh = np.ones(len(self.points), dtype=np.bool_)
        self._colours = self._coloured(np.arange(len(self.points)))
        self._judged, self._quality = self.points.copy(), tet_quality(self.points, self.cells)

    def quality(self) -> FloatArray:
        """Quality of each tetrahedron, brought up to date in place where points moved."""
        moved = _differ(self.points, self._judged)
        if moved.any():
            qualities(len(self.cells), self.points, self.cells, moved, self._quality)
            self._judged = self.points.copy()
        return self._quality

    def put_back(self, sound: float) -> None:
        """Put boundary points back onto the wall, and those that cannot go there back to where they last were."""
        held = self._look_up()
        off = held[_differ(self.points[held], self._places[held])]
        self._try(off, self._places, sound)
        off = off[_differ(self.points[off], self._places[off])]
        off = off[_differ(self.points[off], self._home[off])]
        self._try(off, self._home, sound)
        self._home = self.points.copy()

    def relax(self, poor: float) -> None:
        """Move all points once for the mean quality."""
        relax(self._arrays, self._colours, self._constraints.freedom, self._basis, poor, self._fresh)

    def search(self, nodes: IntArray, freedom: IntArray) -> None:
        """Move some points for the worst quality around each."""
        search(self._arrays, self._coloured(nodes), freedom, self._basis, self._fresh)

    def off_wall(self) -> float:
        """Greatest distance of a boundary point from the wall."""
        held = self._look_up()
        return float(np.linalg.norm(self._places[held] - self.points[held], axis=1).max(initial=0.0))

    def _look_up(self) -> IntArray:
        """Bring places and directions up to date of the boundary points that moved; the numbers of all of them.

        A point at the place found for it belongs there: it is not looked up again.
        """
        held = self._held
        moved = _differ(self.points[held], self._looked_up[held])
        moved &= _differ(self.points[held], self._places[held])
        chosen = np.zeros(len(self.points), dtype=np.bool_)
        chosen[held[moved]] = True
        self._constraints.renew(self.points, chosen, self._places, self._basis)
        self._looked_up[chosen] = self.points[chosen]
        return held

    def _try(self, nodes: IntArray, places: FloatArray, sound: float) -> None:
        if len(nodes):
            try_places(self._arrays, self._coloured(nodes), places, sound, self._fresh)

    def _coloured(self, nodes: IntArray) -> tuple[IntArray, IntArray]:
        order, first = coloured(self.cells, *self._star, nodes)
        return order, first


def _differ(one: FloatArray, other: FloatArray) -> BoolArray:
    """Which rows of two arrays ``(n, 3)`` differ; ``any`` along rows takes several times as long."""
    differ = one != other
    return np.asarray(differ[:, 0] | differ[:, 1] | differ[:, 2])


def _points_of_poor(quality: FloatArray, cells: IntArray, poor: float) -> IntArray:
    """Points of elements below a quality, those of the worst first."""
    worst = np.flatnonzero(quality < poor)
    nodes = cells[worst[np.argsort(quality[worst], kind="stable")]].ravel()
    return np.asarray(nodes[np.sort(np.unique(nodes, return_index=True)[1])])
