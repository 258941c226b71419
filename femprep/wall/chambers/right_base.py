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
STEP: Final = 1.5
#: How far the cut reaches beyond the outer surface, mm.
_BEYOND: Final = 2.0


def cut_right_base(wall: Wall, plane: Plane, body: Surface, thickness: float) -> Wall:
    """Cut the wall of both ventricles down to the base of the right one, which lies nearer to the apex.

    What lies beyond the plane is taken away around the right ventricle. The left ventricle's wall stays, less a step of
    1.5 mm in the septum, so that the right ventricle's rim lies in its plane all round.

    Parameters
    ----------
    wall : Wall
        With facets ``endo_lv``, ``endo_rv``, ``epi`` and ``base``; its right ventricle passes through the plane.
    plane : Plane
        Base of the right ventricle, its normal away from the apex.
    body : Surface
        Closed outer surface of the left ventricle, cavity and myocardium.
    thickness : float
        What stays of the left ventricle's wall at the least, mm.

    Returns
    -------
    Wall
        With facets ``base_rv`` in the plane, and the plane under that name.
    """
    base = wall.planes["base"]
    frame = plane_frame(plane)[:2]

    def outlines(points: FloatArray, triangles: IntArray, *planes: Plane) -> list[FloatArray]:
        rings = [ring for rings in plane_sections(points, triangles, planes) for ring in rings]
        return [product(ring[:-1] - plane.point, frame.T) for ring in rings]

    def facets(name: str) -> IntArray:
        return wall.triangles[wall.facet_tag == FACET_TAGS[name]]

    below_base = replace(base, point=base.point - 1e-3 * base.normal)
    middle = replace(plane, point=plane.point + 0.5 * plane.signed_distance(base.point[None])[0] * plane.normal)
    right = outlines(wall.points, facets("endo_rv"), plane)
    outer = outlines(wall.points, facets("epi"), plane)
    left = outlines(body.points, body.triangles, plane)
    cavity = outlines(wall.points, facets("endo_lv"), plane, middle, below_base)
    height = float(np.ptp(wall.points @ plane.normal))
    opened = cut_down(
        wall,
        plane,
        height,
        around=right,
        outer=outer,
        body=left,
        cavity=cavity,
        step=STEP,
        keep=thickness,
        beyond=_BEYOND,
    )
    # Where the right ventricle bulges around the body, some of its surface is left beyond its base: outer surface now.
    away = plane.signed_distance(opened.points)[opened.triangles]
    beyond = (opened.facet_tag == FACET_TAGS["endo_rv"]) & (away.max(axis=1) > 1e-3)
    tag = np.where(beyond, FACET_TAGS["epi"], opened.facet_tag)
    planes = {**wall.planes, "base_rv": plane}
    info = {**wall.info, "planes": {name: own.record() for name, own in planes.items()}}
    return replace(opened, facet_tag=tag, planes=planes, info=info)
