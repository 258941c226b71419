"""A field and boundary values in, a sound mapped template out: checked, and mended step by step where it is folded."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any, Final

from femprep.errors import StageError
from femprep.harmonic.field import Field
from femprep.harmonic.leastsquares import fit_spline
from femprep.harmonic.spline import Basis
from femprep.model import FloatArray, IntArray
from femprep.surface.shape import HarmonicShape
from femprep.surface.soundness import find_faults

_log = logging.getLogger(__name__)

#: Smoothing of the stopping function, step by step: none as in the paper, then just enough for a sound surface.
_SMOOTHING: Final = (0.0, 1e-7, 1e-6, 1e-5, 1e-4)


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
    info : dict
        ``smoothing`` used, ``underdetermined``, and under ``notices`` what had to be mended.
    """

    shape: HarmonicShape
    directions: FloatArray
    points: FloatArray
    info: dict[str, Any]


def sound_map(
    field: Field,
    basis: Basis,
    feet: FloatArray,
    level: FloatArray,
    directions: FloatArray,
    cells: IntArray,
    steps: int,
    name: str,
) -> Mapped:
    """Fit the stopping function and carry the template to it; smooth it step by step until no triangles cross.

    Parameters
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
    cells : (T, 3) array
        Its triangles.
    steps : int
        Runge-Kutta steps of a flow line.
    name : str
        The object's, for messages.

    Raises
    ------
    StageError
        No step gave a surface without crossing or folded triangles.
    """
    bounds = 0.5 * float(level.min()), 1.5 * float(level.max())
    first = None
    for smoothing in _SMOOTHING:
        stopping, solve = fit_spline(basis, feet, level, smoothing=smoothing)
        shape = HarmonicShape(field, stopping, *bounds, steps)
        points = shape(directions)
        faults = find_faults(points, cells, field)
        if not faults:
            notices: list[str] = []
            if first is not None:
                used = solve["smoothing"]
                notices.append(f"surface {name} had {first}; smoothing its stopping function by {used:g} mended it")
                _log.warning(notices[0])
            info = {"smoothing": solve["smoothing"], "underdetermined": solve["underdetermined"], "notices": notices}
            return Mapped(shape, directions, points, info)
        _log.info("surface of %r with smoothing %g: %s", name, smoothing, faults)
        first = first or faults
    raise StageError(
        f"the surface of {name!r} has {first} and could not be mended; raise the number of vertices "
        f"({len(directions)}), lower control_points ({basis.size - 1}), or mend the labels there"
    )
