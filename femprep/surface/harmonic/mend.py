"""A field and boundary values in, a sound mapped template out: checked, and mended step by step where it is folded."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from femprep.errors import StageError
from femprep.model import FloatArray, IntArray, Notice, records, split_quads
from femprep.surface.fitting.slide import Connectivity
from femprep.surface.fitting.ways import ACCEPTANCE
from femprep.surface.harmonic.even import even_out
from femprep.surface.harmonic.field import Field
from femprep.surface.harmonic.leastsquares import SplineSolution, fit_spline
from femprep.surface.harmonic.shape import HarmonicShape
from femprep.surface.harmonic.soundness import Faults, find_faults
from femprep.surface.harmonic.spline import Basis

_log = logging.getLogger(__name__)

#: Smoothing of the stopping function, step by step: none as in the paper, then just enough for a sound surface.
_PAPER: Final = (0.0, 1e-7, 1e-6, 1e-5, 1e-4)
#: Vertices that move see the stopping function between the template's own directions too: never without smoothing.
_EVEN: Final = (1e-6, 1e-5, 1e-4)
#: For the sake of even triangles alone smoothing goes up to here.
_WORTH: Final = 1e-5


@dataclass(frozen=True, eq=False)
class Mapped:
    """A template carried onto a surface.

    Attributes
    ----------
    shape : HarmonicShape
        The smooth surface.
    directions : (V, 3) array
        Where on the sphere each vertex comes from.
    points : (V, 3) array
        The vertices, ``shape(directions)``, mm LPS.
    cells : (m, 3) or (m, 4) array
        The template's cells, or others on the same vertices.
    solved : SplineSolution
        How its stopping function was solved for.
    least_quality : float or None
        Least Q of the triangles; None where vertices were not moved.
    info : dict
        The record: ``smoothing`` used, ``underdetermined``, ``even`` (how much triangles gained, where vertices were
        moved), and under ``notices`` what had to be mended.
    """

    shape: HarmonicShape
    directions: FloatArray
    points: FloatArray
    cells: IntArray
    solved: SplineSolution
    least_quality: float | None
    info: dict[str, Any]


@dataclass(frozen=True, eq=False)
class HarmonicFit:
    """What the stopping function is fitted to, and what is carried to it.

    Attributes
    ----------
    field : Field
        The harmonic field.
    basis : Basis
        Control points of the stopping function.
    feet : (N, 3) array
        Unit vectors of the boundary points' flow lines.
    level : (N,) array
        Values of u at the boundary points.
    directions : (V, 3) array
        The template's vertices.
    cells : (m, 3) or (m, 4) array
        Its triangles or quadrilaterals.
    axes : (3, 3) array
        The image's axes as a rotation, columns.
    steps : int
        Runge-Kutta steps of a flow line.
    name : str
        The object's, for messages.
    connectivity, curvature
        As for :func:`~femprep.surface.fitting.place.place_evenly`, where vertices are moved.
    """

    field: Field
    basis: Basis
    feet: FloatArray
    level: FloatArray
    directions: FloatArray
    cells: IntArray
    axes: FloatArray
    steps: int
    name: str
    connectivity: Connectivity = "template"
    curvature: float = 0.0

    def stopped(self, smoothing: float) -> tuple[HarmonicShape, SplineSolution]:
        """The surface of one smoothing, and how its stopping function was solved for."""
        stopping, solved = fit_spline(self.basis, self.feet, self.level, smoothing=smoothing)
        bounds = 0.5 * float(self.level.min()), 1.5 * float(self.level.max())
        return HarmonicShape(self.field, stopping, *bounds, self.steps), solved

    def mapped(self, smoothing: float, even: bool) -> tuple[Mapped, Faults]:
        """The template on the surface of one smoothing, its vertices moved or not, and its faults."""
        shape, solved = self.stopped(smoothing)
        info: dict[str, Any] = {"smoothing": solved.smoothing, "underdetermined": solved.underdetermined}
        if even:
            found = even_out(shape, self.directions, self.cells, self.axes, self.connectivity, self.curvature)
            info["even"] = found.info
            mapped = Mapped(shape, found.directions, found.points, found.cells, solved, found.least_quality, info)
        else:
            mapped = Mapped(shape, self.directions, shape(self.directions), self.cells, solved, None, info)
        return mapped, find_faults(mapped.points, split_quads(mapped.cells), self.field)


def sound_map(fit: HarmonicFit, even: bool) -> Mapped:
    """Fit the stopping function and carry the template to it; mend it step by step until no triangles cross.

    Parameters
    ----------
    fit : HarmonicFit
        What to fit and to carry.
    even : bool
        Move the vertices along the surface to even triangles. Otherwise the surface is the paper's, and they are
        moved only where no smoothing mends it.

    Raises
    ------
    StageError
        No step gave a surface without crossing or folded triangles.
    """
    first: Faults | None = None
    found: list[Mapped] = []
    for smoothing, moved in _steps(even):
        mapped, faults = fit.mapped(smoothing, moved)
        if faults:
            _log.info("surface of %r with smoothing %g: %s", fit.name, smoothing, faults)
            first = first or faults
            if found:
                break
            continue
        found.append(mapped)
        if mapped.least_quality is None or smoothing >= _WORTH or mapped.least_quality >= ACCEPTANCE.least:
            break
    if not found:
        raise StageError(
            f"the surface of {fit.name!r} has {first} and could not be mended; raise the number of vertices "
            f"({len(fit.directions)}), lower control_points ({fit.basis.size - 1}), or mend the labels there"
        )
    best = max(found, key=lambda one: 1.0 if one.least_quality is None else one.least_quality)
    notices = []
    if first is not None:
        how = f"smoothing its stopping function by {best.solved.smoothing:g}"
        if best.least_quality is not None and not even:
            how += " and moving its vertices along it"
        notices.append(f"surface {fit.name} had {first}; {how} mended it")
        _log.warning(notices[0])
    if not np.array_equal(best.cells, fit.cells) and fit.connectivity == "auto":
        notices.append(
            f"surface {fit.name} is too long or branched for even triangles in the template's order; edges were flipped"
        )
        _log.info(notices[-1])
    best.info["notices"] = records(*(Notice.of("repaired", line) for line in notices))
    return best


def _steps(even: bool) -> Iterator[tuple[float, bool]]:
    """Smoothing, and whether vertices are moved, in the order they are tried."""
    if not even:
        yield from ((smoothing, False) for smoothing in _PAPER)
    yield from ((smoothing, True) for smoothing in _EVEN)
