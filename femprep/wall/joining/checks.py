"""Surfaces, clipped ones and walls in, errors out that say what is wrong, and where."""

from __future__ import annotations

import numpy as np

from femprep.errors import Advice, InputError, StageError
from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.search.intersection import self_intersections
from femprep.mesh.topology import edge_table, is_consistently_wound, pieces, pinched_vertices
from femprep.model import FloatArray, Surface, Wall, tag_name
from femprep.model.notice import spot
from femprep.options.advice import GIVE_BASE, MEND, MORE_VERTICES, MOVE_BASE
from femprep.wall.clipping.clipped_surface import LEAST_QUALITY, ClippedSurface

#: How far a vertex may lie off its plane, mm.
FLAT = 1e-9
#: Least quality Q of the triangles of a flat cap, which has no shape to spoil: of 46 hearts whose walls were thinned to
#: a pixel and more 7 had one of .07 to .2 there, where the rims are a millimetre apart.
_LEAST_FLAT = 0.02
#: So far below the base what fails is put down to how surfaces round off there, mm.
_BESIDE = 5.0


def check_surface(surface: Surface) -> None:
    """Refuse a surface that is not closed, wound outward, in one piece and of triangles.

    Raises
    ------
    InputError
    """
    what = f"surface {surface.name!r}"
    if surface.cells.shape[1] != 3:
        raise InputError(f"{what} has quadrilaterals; a wall is built from triangles")
    table = edge_table(surface.cells)
    odd = np.flatnonzero(table.count != 2)
    if len(odd):
        at = surface.points[table.nodes[odd[0]]].mean(axis=0)
        raise InputError(f"{what} is not closed: {len(odd)} edges without two triangles, the first at {spot(at)}")
    if not is_consistently_wound(surface.cells):
        bad = np.flatnonzero(table.forward != 1)
        at = surface.points[table.nodes[bad[0]]].mean(axis=0)
        raise InputError(f"{what} is not wound consistently: {len(bad)} edges, the first at {spot(at)}")
    count = len(np.unique(pieces(surface.cells)))
    if count != 1:
        raise InputError(f"{what} is in {count} pieces, expected 1")
    if surface.volume <= 0:
        raise InputError(f"{what} is wound inward (volume {surface.volume:.1f} mm3); reverse its triangles")


def check_clipped(clipped: ClippedSurface) -> None:
    """Refuse a clipped surface that crosses itself or is in several pieces.

    Raises
    ------
    InputError
    """
    pairs = self_intersections(clipped.points, clipped.triangles)
    if len(pairs):
        at = clipped.points[clipped.triangles[pairs[0, 0]]].mean(axis=0)
        raise InputError(
            f"surface {clipped.name!r} crosses itself: {len(pairs)} pairs of triangles, the first at {spot(at)}",
            advice=[MEND, MORE_VERTICES],
        )
    piece = pieces(clipped.triangles)
    if piece.max() > 0:
        at = clipped.points[clipped.triangles[piece == 1]].mean(axis=(0, 1))
        raise InputError(
            f"the planes cut surface {clipped.name!r} into {piece.max() + 1} pieces, one at {spot(at)}",
            advice=[MOVE_BASE, GIVE_BASE],
        )


def _beside_base(wall: Wall, at: FloatArray) -> tuple[str, list[Advice]]:
    """What helps where a wall fails just below its base: there surfaces round off into the caps that are cut away."""
    base = wall.planes.get("base")
    depth = -float(base.signed_distance(at[None])[0]) if base is not None else np.inf
    if not 0.0 <= depth < _BESIDE:
        return "", [MEND]
    inward = float(np.ceil(depth + 0.5))
    words = f"move the base inwards by --base-offset {inward:g}, or more"
    where = f"; it lies {abs(round(depth, 1))} mm below the base, where surfaces round off beside a thin last slice"
    return where, [Advice(words, "wall.base_offset", inward)]


def check_wall(wall: Wall, shells: int = 1) -> None:
    """Refuse a wall that is not the clean boundary of one solid.

    Parameters
    ----------
    wall : Wall
    shells : int
        Closed surfaces it has: 1, and one more for each cavity it encloses.

    Raises
    ------
    StageError
        It is not closed, not wound consistently, pinched, in more or fewer pieces, without volume, crosses itself,
        has a triangle of Q below 0.2 (of a cap: 0.02), or a vertex of a cap off its plane. The message says where and
        under which tag.
    """
    points, triangles = wall.points, wall.triangles

    def refuse(what: str, cell: int) -> None:
        tag = tag_name(int(wall.facet_tag[cell]))
        at = points[triangles[cell]].mean(axis=0)
        where, advice = _beside_base(wall, at)
        raise StageError(f"the wall {what} at {spot(at)} ({tag}){where}", advice=advice)

    table = edge_table(triangles)
    odd = np.flatnonzero(table.count != 2)
    if len(odd):
        refuse(f"is not closed: {len(odd)} edges without two triangles, the first", int(table.cells[odd[0], 0]))
    turned = np.flatnonzero(table.forward != 1)
    if len(turned):
        refuse(f"is not wound consistently: {len(turned)} edges, the first", int(table.cells[turned[0], 0]))
    pinched = pinched_vertices(triangles)
    if len(pinched):
        refuse("touches itself in a vertex", int(np.flatnonzero((triangles == pinched[0]).any(axis=1))[0]))
    piece = pieces(triangles)
    if piece.max() + 1 != shells:
        refuse(f"is in {piece.max() + 1} pieces instead of {shells}, one", int(np.argmax(piece == piece.max())))
    if wall.volume <= 0:
        refuse(f"has no volume ({wall.volume:.3f} mm3)", 0)
    caps = {name: np.flatnonzero([tag_name(int(t)) == name for t in wall.facet_tag]) for name in wall.planes}
    quality = triangle_quality(points, triangles)
    least = np.full(len(quality), LEAST_QUALITY)
    for cap in caps.values():
        least[cap] = _LEAST_FLAT
    if (quality < least).any():
        worst = int((quality / least).argmin())
        refuse(f"has a triangle of quality Q = {quality[worst]:.3f}, below {least[worst]:g},", worst)
    pairs = self_intersections(points, triangles)
    if len(pairs):
        refuse(f"crosses itself: {len(pairs)} pairs of triangles, the first", int(pairs[0, 0]))
    for name, cap in caps.items():
        off = np.abs(wall.planes[name].signed_distance(points[triangles[cap]].reshape(-1, 3)))
        if off.max(initial=0.0) > FLAT:
            refuse(f"has a vertex {off.max():.2e} mm off its plane", int(cap[int(off.argmax()) // 3]))
