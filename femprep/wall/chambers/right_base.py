"""Wall of both ventricles and a lower base for the right one in, the wall cut down to it on the right side out."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from femprep.mesh.plane_sections import plane_sections
from femprep.model import FACET_TAGS, FloatArray, IntArray, Plane, Surface, Wall
from femprep.model.products import product
from femprep.wall.joining.solid import cut_down, plane_frame

#: Width of the step in the septum at the base of the right ventricle, mm.
_STEP: Final = 1.5
#: From so far beyond the right cavity on, round the left ventricle, the cut leaves the tissue at 45 degrees; where it
#: ends there, and how far it reaches over the other base, mm.
_LEAVES, _ROUND, _OVER = 6.0, 20.0, 5.0
#: Edges of the cut, mm.
_EDGE: Final = 2.5


def cut_right_base(wall: Wall, plane: Plane, body: Surface, thickness: float) -> Wall:
    """Cut the wall of both ventricles down to the base of the right one, which lies nearer to the apex.

    What lies beyond the plane is taken away on the right side. The left ventricle's wall stays, less a step of 1.5 mm
    in the septum, so that the right ventricle's rim lies in its plane all round::

                 ____        ____   base
                |    |      |    |
        ____    |    |      |    |   step
       |    |  _|    |      |    |
       |    | |      |  lv  |    |         base_rv
       | rv_|_|

    Parameters
    ----------
    wall : Wall
        With facets ``endo_lv``, ``endo_rv``, ``epi`` and ``base``; its right ventricle passes through the plane.
    plane : Plane
        Base of the right ventricle, parallel to the other one, its normal away from the apex.
    body : Surface
        Closed outer surface of the left ventricle, cavity and myocardium.
    thickness : float
        Least thickness of the wall, mm; half of it stays of the left ventricle's in any case.

    Returns
    -------
    Wall
        With facets ``base_rv`` in the plane, and the plane under that name.
    """
    height = float(plane.signed_distance(wall.planes["base"].point[None])[0])
    points, triangles, floor = _cutter(wall, plane, body, height, thickness)
    cut = cut_down(wall, plane, points, triangles, floor)
    # Where the right ventricle reaches round the left one, some of its surface may stay beyond its base.
    away = plane.signed_distance(cut.points)[cut.triangles].max(axis=1)
    tag = np.where((cut.facet_tag == FACET_TAGS["endo_rv"]) & (away > 1e-3), FACET_TAGS["epi"], cut.facet_tag)
    planes = {**wall.planes, "base_rv": plane}
    info = {**wall.info, "planes": {name: own.record() for name, own in planes.items()}}
    return replace(cut, facet_tag=tag, planes=planes, info=info)


def _cutter(
    wall: Wall, plane: Plane, body: Surface, height: float, thickness: float
) -> tuple[FloatArray, IntArray, int]:
    """A sector of a thick shell around the left ventricle: points, triangles, and the row where its floor begins.

    Its inner side follows the body at every level, a step inside it.
    """
    frame = plane_frame(plane)

    def outlines(triangles: IntArray, points: FloatArray, level: float) -> FloatArray:
        at = Plane(plane.point + level * plane.normal, plane.normal)
        rings = [product(ring - plane.point, frame[:2].T) for ring in plane_sections(points, triangles, [at])[0]]
        return np.concatenate(rings)

    def facets(name: str) -> IntArray:
        return np.asarray(wall.triangles[wall.facet_tag == FACET_TAGS[name]])

    levels = np.linspace(0.0, height, max(2, round(height / _EDGE) + 1))
    inside = levels - 1e-3 * (levels == height)
    left = outlines(facets("endo_lv"), wall.points, 0.0)
    centre = 0.5 * (left.min(axis=0) + left.max(axis=0))

    def polar(ring: FloatArray) -> tuple[FloatArray, FloatArray]:
        x, y = product(ring - centre, turn).T
        return np.arctan2(y, x), np.hypot(x, y)

    right = outlines(facets("endo_rv"), wall.points, 0.0)
    way = right.mean(axis=0) - centre
    way /= np.hypot(*way)
    turn = np.array([[way[0], -way[1]], [way[1], way[0]]])  # the right ventricle lies at angle 0
    angle, radius = polar(right)
    low, high = (end(angle) + sign * _ROUND / radius[where(angle)] for end, sign, where in _ENDS)
    count = max(3, int(np.ceil((high - low) * float(radius.min()) / _EDGE)))
    theta = np.linspace(low, high, count + 1)

    def radii(ring: FloatArray) -> FloatArray:
        own, r = polar(ring)
        order = np.argsort(own)
        return np.interp(theta, own[order], r[order], period=2.0 * np.pi)

    away = np.maximum(np.maximum(angle.min() - theta, theta - angle.max()) * radius.mean() - _LEAVES, 0.0)
    inner = np.array(
        [
            np.maximum(
                radii(outlines(body.triangles, body.points, level)) - _STEP,
                radii(outlines(facets("endo_lv"), wall.points, level)) + 0.5 * thickness,
            )
            + away
            for level in inside
        ]
    )
    inner, levels = np.vstack([inner, inner[-1:]]), np.append(levels, height + _OVER)
    outer = np.full_like(inner, np.linalg.norm(wall.points - wall.points.mean(axis=0), axis=1).max() * 2.0)
    shell = np.stack([inner, outer])[..., None] * np.stack([np.cos(theta), np.sin(theta)], axis=1)
    flat = product(shell.reshape(-1, 2), turn.T) + centre
    up = np.broadcast_to(levels[:, None], inner.shape).ravel()
    points = plane.point + product(np.column_stack([flat, np.tile(up, 2)]), frame)
    number = np.arange(shell[..., 0].size).reshape(shell.shape[:-1])
    # Each pair of opposite sides: one and, turned over, the other.
    sides = [number[0], number[1].T, number[:, :, 0], number[:, :, -1].T, number[:, -1], number[:, 0].T]
    faces = [_grid(side) for side in sides]
    triangles = np.concatenate(faces)
    if np.einsum("ij,ij->", points[triangles[:, 0]], np.cross(points[triangles[:, 1]], points[triangles[:, 2]])) < 0.0:
        triangles = triangles[:, ::-1]
    return points, triangles, len(triangles) - len(faces[-1])


#: For either end of the right ventricle as seen from the left one: which angle, which way is beyond it, where it is.
_ENDS: Final = ((np.min, -1.0, np.argmin), (np.max, 1.0, np.argmax))


def _grid(number: IntArray) -> IntArray:
    """Two triangles for each cell of a grid of points."""
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    cells = np.stack([a, b, c, a, c, d], axis=-1)
    return cells.reshape(-1, 3)
