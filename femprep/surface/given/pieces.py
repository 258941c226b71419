"""A surface in several pieces in; each piece by itself, wound alike, out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femprep.mesh.measures.triangles import areas
from femprep.mesh.topology import edge_table, pieces
from femprep.model import Notice, Surface, noted
from femprep.surface.given.mend import SPECK, merged_corners, wound


def split_surface(surface: Surface) -> list[Surface]:
    """Split a surface into its connected pieces.

    Parameters
    ----------
    surface : Surface
        As of a file that holds several.

    Returns
    -------
    list of Surface
        The largest area first, each with its triangles wound alike, outward where it is closed. Specks of less than 1 %
        of the area are left out, with a notice.

    Raises
    ------
    InputError
        A piece has one side only.

    Examples
    --------
    >>> fp.split_surface(endo)
    [Surface('lv': 500 points, 996 triangles)]
    """
    points, cells, _ = merged_corners(surface.points, surface.triangles)
    piece = pieces(cells)
    area = np.bincount(piece, areas(points, cells))
    large = [k for k in np.argsort(-area, kind="stable") if area[k] >= SPECK * area.sum()]
    if len(area) == 1:
        return [surface]
    specks = len(area) - len(large)
    told = [Notice.of("left out", f"{specks} specks beside the surfaces of {surface.name}")] if specks else []
    found = []
    for number in large:
        used, own = np.unique(cells[piece == number], return_inverse=True)
        own = own.reshape(-1, 3)
        own, _ = wound(surface.name, points[used], own, edge_table(own))
        one = Surface(points[used], own, name=surface.name, info=noted(surface.info, *told))
        found.append(replace(one, cells=own[:, ::-1]) if one.volume < 0.0 else one)
    return found
