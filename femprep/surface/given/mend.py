"""Anyone's triangles in; one sound piece of surface, wound outward, tiny holes filled, out; or what is wrong, where.

What is done changes nothing that a modeller would miss, and each step is a notice with its place.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order
from scipy.spatial import cKDTree

from femprep.errors import InputError
from femprep.mesh.measures.triangles import areas
from femprep.mesh.search.intersection import self_intersections
from femprep.mesh.topology import (
    EdgeTable,
    border_edges,
    border_loops,
    components,
    edge_table,
    enclosed_volume,
    euler_characteristic,
    pieces,
    pinched_vertices,
)
from femprep.model import FloatArray, IntArray, Notice, Surface, noted
from femprep.model.notice import spot
from femprep.surface.given.holes import extent, filled, perimeter
from femprep.surface.given.uncross import FARTHEST, uncrossed

#: Points nearer to each other than this share of the box's diagonal are one: what single precision leaves of a corner.
_SAME: Final = 2e-6
#: Loose pieces of at most this share of the area are specks.
SPECK: Final = 0.01
#: Holes no wider than this, mm, or of three edges are filled.
TINY: Final = 5.0


def mended(surface: Surface, *, repair: bool = False) -> Surface:
    """One sound piece of surface.

    Parameters
    ----------
    surface : Surface
        Lengths in mm; open or closed, wound in any way.
    repair : bool
        Whether it is smoothed where it crosses itself.

    Returns
    -------
    Surface
        Of triangles, wound outward, without tiny holes; wider ones stay. ``info`` has a notice for each thing done.

    Raises
    ------
    InputError
        It has no area, is in several pieces, branches, has one side only, crosses itself or has handles: where.
    """
    name, points, cells = surface.name, surface.points, surface.triangles
    notices: list[Notice] = []
    cells, dropped = _whole(cells)
    if not len(cells):
        raise InputError(f"surface {name!r} has no triangles with three different corners")
    points, cells, merged = merged_corners(points, cells)
    if merged:
        words = f"{merged} corners of surface {name} that lay on others were merged with them"
        notices.append(Notice.of("repaired", words))
    cells, more = _whole(cells)
    if not areas(points, cells).sum() > 0.0:
        raise InputError(f"surface {name!r} has no area: its corners lie in one place or on a line")
    cells, twice = _single(cells)
    points, cells, specks = _without_specks(name, points, cells)
    if specks is not None:
        notices.append(specks)
    table = edge_table(cells)
    many = np.flatnonzero(table.count > 2)
    if len(many):
        at = points[table.nodes[many[0]]].mean(axis=0)
        raise InputError(
            f"surface {name!r} branches: {len(many)} edges have more than two triangles, the first at {spot(at)}; take "
            "inner walls and doubled patches away"
        )
    cells, turned = wound(name, points, cells, table)
    points, cells, parted = _parted(points, cells)
    if dropped + more + twice + parted:
        words = f"surface {name}: "
        words += ", ".join(
            f"{count} {what}"
            for count, what in (
                (dropped + more, "triangles without area left out"),
                (twice, "doubled triangles left out"),
                (parted, "corners in which it touched itself parted"),
            )
            if count
        )
        notices.append(Notice.of("repaired", words))
    points, cells, holes = _without_holes(name, points, cells)
    notices += holes
    inward = enclosed_volume(points, cells) < 0.0
    if inward:
        cells = np.ascontiguousarray(cells[:, ::-1])
    wrong = np.flatnonzero(turned != inward)
    if len(wrong):
        all_of_them = len(wrong) == len(turned)
        which = "all triangles" if all_of_them else f"{len(wrong)} of {len(turned)} triangles"
        place = None if all_of_them else points[cells[wrong[0]]].mean(axis=0)
        words = f"{which} of surface {name} were wound inward, and turned"
        notices.append(
            Notice.of("repaired", words + ("" if place is None else ", the first near {place}"), place=place)
        )
    pairs = self_intersections(points, cells)
    if len(pairs) and repair:
        points, told = uncrossed(name, points, cells, pairs)
        notices.append(told)
    elif len(pairs):
        at = points[cells[pairs[0, 0]]].mean(axis=0)
        raise InputError(
            f"surface {name!r} crosses itself: {len(pairs)} pairs of triangles, the first at {spot(at)}; smooth it "
            f"there by --repair, which moves it by at most {FARTHEST:.0f} mm, or remove the fold in a mesh editor"
        )
    _require_no_handles(name, cells)
    used, cells = np.unique(cells, return_inverse=True)
    info = noted(surface.info, *notices)
    return replace(
        surface, points=points[used], cells=cells.reshape(-1, 3), directions=None, shape=None, point_data={}, info=info
    )


def _whole(cells: IntArray) -> tuple[IntArray, int]:
    """Cells with three different corners, and how many were left out."""
    kept = (cells != np.roll(cells, 1, axis=1)).all(axis=1)
    return cells[kept], int(np.count_nonzero(~kept))


def _single(cells: IntArray) -> tuple[IntArray, int]:
    """Each triangle once, and how many were left out."""
    _, first = np.unique(np.sort(cells, axis=1), axis=0, return_index=True)
    return cells[np.sort(first)], len(cells) - len(first)


def merged_corners(points: FloatArray, cells: IntArray) -> tuple[FloatArray, IntArray, int]:
    """Corners that lie on others merged with them: all at one place; where edges are loose, those nearly there too."""
    used, corner = np.unique(cells, return_inverse=True)
    unique, number = np.unique(points[used], axis=0, return_inverse=True)
    cells = number.ravel()[corner].reshape(-1, 3)
    merged = len(used) - len(unique)
    loose = np.unique(border_edges(cells)) if len(cells) else np.empty(0, np.int64)
    near = _SAME * float(np.linalg.norm(np.ptp(unique, axis=0)))
    pairs = cKDTree(unique[loose]).query_pairs(near, output_type="ndarray") if len(loose) else np.empty((0, 2), int)
    if len(pairs):
        one, two = loose[pairs].T
        _, first, number = np.unique(components(one, two, len(unique)), return_index=True, return_inverse=True)
        merged += len(unique) - len(first)
        unique, cells = unique[first], number.ravel()[cells]
    return unique, cells, merged


def _without_specks(name: str, points: FloatArray, cells: IntArray) -> tuple[FloatArray, IntArray, Notice | None]:
    """The one piece of a surface, without crumbs beside it."""
    piece = pieces(cells)
    if piece.max() == 0:
        return points, cells, None
    area = np.bincount(piece, areas(points, cells))
    order = np.argsort(-area, kind="stable")
    largest, second = order[:2]
    if area[second] > SPECK * area.sum():
        one, two = (spot(points[cells[piece == k]].mean(axis=(0, 1))) for k in (largest, second))
        raise InputError(
            f"surface {name!r} is in {len(area)} pieces, of {area[largest]:.0f} mm2 about {one} and of "
            f"{area[second]:.0f} mm2 about {two}; --surface FILE without a name takes all pieces by their position, "
            f"--surface {name}=FILE#1 the largest one"
        )
    at = points[cells[piece == second]].mean(axis=(0, 1))
    words = f"{len(area) - 1} specks of surface {name}, of {area.sum() - area[largest]:.1f} mm2 in all"
    return points, cells[piece == largest], Notice.of("left out", words, place=at)


def wound(
    name: str, points: FloatArray, cells: IntArray, table: EdgeTable
) -> tuple[IntArray, np.ndarray[tuple[int], np.dtype[np.bool_]]]:
    """Triangles wound alike, as the first one is, and which were turned for it."""
    inner = table.count == 2
    pair, clash = table.cells[inner], table.forward[inner] != 1
    graph = coo_array((np.ones(len(pair), dtype=np.int8), pair.T), shape=(len(cells), len(cells))).tocsr()
    order, before = breadth_first_order(graph, 0, directed=False)
    lookup = {}
    for (a, b), unlike in zip(pair.tolist(), clash.tolist()):
        lookup[a, b] = lookup[b, a] = unlike
    turned = np.zeros(len(cells), dtype=bool)
    for cell in order[1:].tolist():
        other = int(before[cell])
        turned[cell] = turned[other] ^ lookup[other, cell]
    if turned.any():
        cells = np.where(turned[:, None], cells[:, ::-1], cells)
        after = edge_table(cells)
        odd = np.flatnonzero((after.count == 2) & (after.forward != 1))
        if len(odd):
            at = points[after.nodes[odd[0]]].mean(axis=0)
            raise InputError(f"surface {name!r} has one side only, like a Moebius band, at {spot(at)}")
    return cells, turned


def _parted(points: FloatArray, cells: IntArray) -> tuple[FloatArray, IntArray, int]:
    """Corners in which fans of triangles meet that share no edge there: one for each fan, a little into it."""
    pinched = pinched_vertices(cells)
    if not len(pinched):
        return points, cells, 0
    cells, new, count = cells.copy(), [points], len(points)
    source = list(range(count))  # of a triangle with two such corners one has a new number already
    for vertex in pinched.tolist():
        around = np.flatnonzero((cells == vertex).any(axis=1))
        fan = _fans(cells[around], vertex)
        for k in range(fan.max() + 1):
            rows = around[fan == k]
            middle = points[np.array(source)[cells[rows]]].mean(axis=(0, 1))
            new.append((points[vertex] + 1e-3 * (middle - points[vertex]))[None])
            source.append(vertex)
            cells[rows] = np.where(cells[rows] == vertex, count, cells[rows])
            count += 1
    return np.concatenate(new), cells, len(pinched)


def _fans(cells: IntArray, vertex: int) -> IntArray:
    """Number of the fan about a vertex that each of its cells belongs to."""
    others = [set(row.tolist()) - {vertex} for row in cells]
    fan = np.arange(len(cells))
    for i in range(len(cells)):
        for j in range(i):
            if others[i] & others[j]:
                fan[fan == fan[i]] = fan[j]
    return np.unique(fan, return_inverse=True)[1].ravel()


def _without_holes(name: str, points: FloatArray, cells: IntArray) -> tuple[FloatArray, IntArray, list[Notice]]:
    """Tiny holes filled, each told."""
    notices = []
    loops = border_loops(cells)
    tiny = [loop for loop in loops if len(loop) == 3 or extent(points[loop]) <= TINY]
    if len(tiny) == len(loops) and len(tiny) == 1 and perimeter(points[tiny[0]]) ** 2 > areas(points, cells).sum():
        tiny = []  # The mouth of a small surface, not a hole in it.
    for loop in tiny:
        cells = np.concatenate([cells, filled(points, loop)])
        words = f"a hole of {{amount}} in surface {name} was filled"
        place = points[loop].mean(axis=0)
        notices.append(Notice.of("repaired", words, amount=extent(points[loop]), unit="mm", place=place))
    return points, cells, notices


def _require_no_handles(name: str, cells: IntArray) -> None:
    rims = len(border_loops(cells))
    handles = (2 - euler_characteristic(cells) - rims) // 2
    if handles:
        raise InputError(
            f"surface {name!r} has {handles} handles or tunnels, as between papillary muscles and wall; a surface of a "
            "chamber has none: fill them, or smooth them away"
        )
