"""Files of surfaces in; epicardium and endocardia by name, told from where they lie, out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from femprep.annotation.annotate import read_boundary
from femprep.annotation.chambers import name_cavities
from femprep.annotation.hull import hull_of
from femprep.annotation.reading import Name, NoReading
from femprep.annotation.shell import shell_of_triangles
from femprep.errors import InputError
from femprep.mesh.topology import edge_table, is_closed, volume
from femprep.model import FACET_TAGS, Notice, Surface, noted
from femprep.model.image_file import piece_of
from femprep.model.notice import spot
from femprep.model.units import guess_unit
from femprep.options import AnnotateOptions
from femprep.surface import read_surface, split_surface
from femprep.surface.given.mend import wound

#: A surface lies in another's hull with this share of its points, off by at most this share of the diagonal of its box.
_INSIDE, _OFF = 0.8, 0.01
#: Facets of a wall's boundary that are surfaces of ours.
_SIDES: Final = {"endo": "lv", "endo_lv": "lv", "endo_rv": "rv", "epi": "epi"}
#: How many pieces a heart has: the epicardium and one, two or four endocardia.
_COUNTS: Final = (2, 3, 5)


def read_surfaces(*paths: str | Path) -> dict[str, Surface]:
    """Read the surfaces of a heart from one file of several pieces, or from several files, and name them.

    The piece around all others is the epicardium, the others are endocardia; of two ventricles the left one has the
    thicker wall and the rounder cavity. One closed piece is taken for the boundary of a wall, and parted into
    its sides as :func:`femprep.annotate` does. Each name is a notice.

    Parameters
    ----------
    *paths : path
        What :func:`femprep.read_surface` reads. ``FILE#2`` is the second largest piece of a file.

    Returns
    -------
    dict of str to Surface
        ``epi``, ``lv``, and where they are there ``rv``, ``la`` and ``ra``.

    Raises
    ------
    FileError
        A file is missing or damaged.
    InputError
        The position of the pieces does not tell their names: the message lists the pieces.

    Examples
    --------
    >>> surfaces = fp.read_surfaces("heart.vtp")  # doctest: +SKIP
    >>> fp.mesh_surfaces(surfaces, volume={"edge_length": 3.0}).quality.passed  # doctest: +SKIP
    True
    """
    found = {}
    for path in paths:
        file, number = piece_of(path)
        for k, one in enumerate(split_surface(read_surface(file)), 1):
            if number in (None, k):
                found[f"{file.name}#{k}"] = one
    if len(found) == 1:
        return _sides(*found.items())
    return _by_position(found)


def read_piece(path: str | Path) -> Surface:
    """A surface, or of ``FILE#2`` the second largest piece of one.

    Raises
    ------
    InputError
        It has fewer pieces.
    """
    file, number = piece_of(path)
    surface = read_surface(file)
    if number is None:
        return surface
    pieces = split_surface(surface)
    if not 1 <= number <= len(pieces):
        raise InputError(f"{str(path)!r}: the file has {len(pieces)} pieces; give one of 1 to {len(pieces)}")
    return pieces[number - 1]


def _by_position(found: dict[str, Surface]) -> dict[str, Surface]:
    names, surfaces = list(found), list(found.values())
    try:
        hulls = [hull_of(one.points).equations for one in surfaces]
    except NoReading as error:
        raise InputError(f"one of {', '.join(names)} is flat: {error}") from None
    inside = np.array([[_share(one, hull) >= _INSIDE for hull in hulls] for one in surfaces])
    np.fill_diagonal(inside, False)
    outer = np.flatnonzero(inside.sum(axis=0) == len(found) - 1)
    inner = [k for k in range(len(found)) if k not in outer]
    if len(found) not in _COUNTS or len(outer) != 1 or inside[np.ix_(inner, inner)].any():
        raise InputError(_question(found, "none lies around all others, which lie apart"))
    epi = surfaces[outer[0]]
    points = np.concatenate([epi.points, *(surfaces[k].points for k in inner)])
    sizes = [len(surfaces[k].points) for k in inner]
    starts = len(epi.points) + np.cumsum([0, *sizes[:-1]])
    cells = [surfaces[k].triangles + start for k, start in zip(inner, starts)]
    owner = np.repeat(np.arange(len(inner) + 1), [len(epi.triangles), *map(len, cells)])
    shell = shell_of_triangles(points, np.concatenate([epi.triangles, *cells]))
    try:
        order, sure, questions = name_cavities(shell, [owner == k + 1 for k in range(len(inner))], owner == 0)
    except NoReading as error:
        raise InputError(_question(found, str(error))) from None
    if questions:
        raise InputError(_question(found, "; ".join(question.words for question in questions)))
    sure = {"epi": Name(1.0, "it lies around the others"), **sure}
    told = dict(zip(["epi", *order], [int(outer[0]), *inner]))
    return {name: _named(surfaces[k], name, f"{names[k]} ({sure[name].because})") for name, k in told.items()}


def _share(surface: Surface, hull: np.ndarray) -> float:
    off = (surface.points @ hull[:, :3].T + hull[:, 3]).max(axis=1)
    return float(np.mean(off <= _OFF * np.linalg.norm(np.ptp(surface.points, axis=0))))


def _named(surface: Surface, name: str, what: str) -> Surface:
    notice = Notice.of("assumed", f"surface {name} is {what}")
    return replace(surface, name=name, info=noted(surface.info, notice))


def _question(found: dict[str, Surface], why: str) -> str:
    """All pieces with their sizes and places, and how to name them."""
    listed = []
    for name, one in found.items():
        size = f"{volume(one.points, one.triangles):.4g} in volume, " if is_closed(one.triangles) else "open, "
        across = np.linalg.norm(np.ptp(one.points, axis=0))
        listed.append(f"{name} ({size}{across:.4g} across, about {spot(one.points.mean(axis=0))})")
    first = next(iter(found))
    return (
        f"the names of {len(found)} surfaces do not follow from where they lie: {why}. They are {', '.join(listed)}; "
        f"name them (--surface epi={first} --surface lv=...), or give one closed wall alone (--surface {first})"
    )


def _sides(item: tuple[str, Surface]) -> dict[str, Surface]:
    """Epicardium and endocardia of the closed boundary of a wall."""
    name, surface = item
    table = edge_table(surface.triangles)
    if table.count.max() > 2:
        count = np.count_nonzero(table.count > 2)
        raise InputError(
            f"{name} is one surface that branches: {count} edges have more than two triangles, as where endocardium "
            "and epicardium touch; part them there"
        )
    if not is_closed(surface.triangles):
        raise InputError(
            f"{name} is one open surface; a wall lies between two: give --surface lv=FILE --surface epi=FILE"
        )
    _, diagonal = guess_unit(surface.points, name)
    scale = diagonal / float(np.linalg.norm(np.ptp(surface.points, axis=0)))
    cells, _ = wound(name, surface.points, surface.triangles, table)
    cells = cells[:, ::-1] if volume(surface.points, cells) < 0.0 else cells
    shell = shell_of_triangles(surface.points * scale, np.ascontiguousarray(cells))
    reading, _ = read_boundary(shell, np.zeros(len(cells), dtype=np.int32), AnnotateOptions(), 1.0)
    if reading.questions:
        raise InputError("; ".join(question.words for question in reading.questions))
    found = {}
    for facet, own in _SIDES.items():
        chosen = cells[reading.tag == FACET_TAGS[facet]]
        if len(chosen):
            used, corner = np.unique(chosen if own == "epi" else chosen[:, ::-1], return_inverse=True)
            part = Surface(surface.points[used], corner.reshape(-1, 3), name=own, info=surface.info)
            found[own] = _named(part, own, f"a side of {name} ({reading.names[facet].because})")
    return found
