"""Closed cavity surfaces in, the same out at a least distance from each other: the walls between chambers."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from femprep.errors import InputError
from femprep.mesh.measures.triangles import vertex_normals
from femprep.mesh.operations.push import push
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import FloatArray, Notice, Surface, noted
from femprep.model.notice import spot
from femprep.model.products import unit_vectors
from femprep.options import require_number
from femprep.options.advice import thinner
from femprep.wall.clipping.thickness import PUSHING

logger = logging.getLogger(__name__)

#: Margin by which a push aims beyond the limit.
_MARGIN = 1.05


def keep_apart(
    cavities: Mapping[str, Surface], least: float, most: float
) -> tuple[dict[str, Surface], list[dict[str, Any]]]:
    """Push cavities apart where the wall between two of them is thinner than a limit.

    Of each pair the first stays as it is and the second gives way, so that the order tells which surface is trusted
    more: the left ventricle before the right one, ventricles before atria.

    Parameters
    ----------
    cavities : mapping of str to Surface
        Closed, by name.
    least : float
        Least thickness between them, mm.
    most : float
        Farthest a vertex may be pushed, mm.

    Returns
    -------
    cavities : dict of str to Surface
        One that was pushed has no ``shape`` any more.
    repaired : list of dict
        What was done for each pair, JSON-ready.

    Raises
    ------
    InputError
        Two cavities overlap by more than ``most``.
    OptionError
        ``least`` or ``most`` is negative.

    Examples
    --------
    >>> cavities, repaired = fp.keep_apart({"lv": endo}, least=1.0, most=8.0)
    >>> repaired
    []
    """
    require_number("least", least, 0)
    require_number("most", most, 0)
    names = list(cavities)
    result, repaired = dict(cavities), []
    for later, name in enumerate(names):
        for other in names[:later]:
            surface, record = _give_way(result[name], result[other], least, most, (other, name))
            if record is not None:
                result[name] = surface
                repaired.append(record)
    return result, repaired


def _give_way(
    surface: Surface, other: Surface, least: float, most: float, names: tuple[str, str]
) -> tuple[Surface, dict[str, Any] | None]:
    """Push the vertices of one surface away from another one."""
    finder = ClosestFinder(other.points, other.triangles)
    points = surface.points.copy()
    lacking, _ = _lacking(points, surface, finder, least)
    if lacking.max() <= 0.0:
        return surface, None
    before, worst = least - float(lacking.max()), points[int(lacking.argmax())].copy()
    aim = partial(_lacking, points, surface, finder, _MARGIN * least)
    push(points, surface.triangles, PUSHING, aim, (_MARGIN - 1.0) * least)
    moved = float(np.linalg.norm(points - surface.points, axis=1).max())
    reached = least - float(_lacking(points, surface, finder, least)[0].max())
    if reached < 0.9 * least or moved > most:
        raise InputError(
            f"the cavities {names[0]!r} and {names[1]!r} are {before:.2f} mm apart near {spot(worst)} (negative: they "
            f"overlap); pushing them apart by {moved:.1f} mm leaves {reached:.2f} mm, but minimum_thickness = "
            f"{least:g} mm is asked within maximum_push = {most:g} mm",
            advice=thinner(min(reached, least - moved + most)),
        )
    record = {
        "between": list(names),
        "thickness_before_mm": before,
        "thickness_after_mm": reached,
        "worst_at_mm": [round(float(x), 3) for x in worst],
        "farthest_push_mm": moved,
    }
    logger.warning("%s and %s %.2f mm apart: pushed apart by up to %.2f mm", *names, before, moved)
    gap = f"were {before:.1f} mm apart" if before >= 0.0 else f"overlapped by {-before:.1f} mm"
    words = (
        f"cavities {names[0]} and {names[1]} {gap} near {{place}}: {names[1]} was pushed away by up to {{amount}}, "
        f"which leaves a wall of {reached:.1f} mm"
    )
    notice = Notice.of("repaired", words, amount=moved, unit="mm", place=worst)
    return replace(surface, points=points, shape=None), noted(record, notice)


def _lacking(
    points: FloatArray, surface: Surface, finder: ClosestFinder, least: float
) -> tuple[FloatArray, FloatArray]:
    """What each vertex lacks to the least distance, mm (at least 0), and which way leads away."""
    signed, near = finder.sided(points)
    along = unit_vectors(near.at(vertex_normals(finder.points, finder.triangles)))
    lacking = np.maximum(least - signed, 0.0)
    # A vertex of the other surface may come near the middle of a triangle of this one: its corners have to go.
    own, nearest = ClosestFinder(points, surface.triangles).sided(finder.points)
    short = np.maximum(least - own, 0.0)
    np.maximum.at(lacking, surface.triangles[nearest.triangle].ravel(), np.repeat(short, 3))
    return lacking, along
