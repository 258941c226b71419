"""A boundary in, names by flat pieces or by creases out: base and apex planes, and what they part.

A wall cut by planes, or with a rim of creases, falls into sheets once the pieces between them are taken out: the one
that encloses tissue is the epicardium, those that enclose none are endocardia.
"""

from __future__ import annotations

import numpy as np

from femprep.annotation.chambers import name_cavities
from femprep.annotation.hollows import hollows
from femprep.annotation.hull import hull_of
from femprep.annotation.reading import Name, NoReading, Question, Reading
from femprep.annotation.shell import Shell
from femprep.model import FACET_TAGS, BoolArray, FloatArray, Plane, endocardium
from femprep.model.notice import spot

#: Neighbours that fold by less than this, degrees, may lie in one plane; and by how much of an edge they may leave it.
_FOLD, _OFF = 2.0, 0.05
#: A flat piece counts from this share of the boundary's area; a sheet that is smaller joins its neighbour.
_FLAT, _SHEET = 0.004, 0.004
#: A step between two cuts of one base counts from this share.
_STEP = 0.0005
#: Neighbours that fold by less than this, degrees, do so by the rounding of a file alone.
_DIGITS = 0.3
#: What goes on from a flat end folds by less than this, and leans by less than that, degrees.
_BEND, _LEVEL = 15.0, 30.0
#: A base of creases lies in a plane to within this share of its size.
_BENT = 0.15
#: Two flat ends are base and apex plane where the areas within their outlines differ at least by this factor.
_LARGER = 1.3
#: An epicardium that fills more of its convex hull than this goes into no cavity.
_FULL = 0.9


def by_closed_sheets(shell: Shell) -> Reading:
    """Closed shells, one around the others: the outer one is the epicardium, each inner one an endocardium."""
    piece = shell.pieces()
    if len(np.unique(piece)) < 2:
        raise NoReading("the boundary is one closed sheet")
    return _read(shell, "closed sheets", np.zeros(len(shell), dtype=bool), {})


def by_flat_pieces(shell: Shell) -> Reading:
    """Flat pieces are the base, or base and apex plane; a base may be of several pieces that border on each other."""
    # A cut has a hole, where it opens the cavity; coarse elements at a round apex may lie in a plane, too.
    flat = [own for own in flat_pieces(shell) if shell.rims(own) != 1]
    if flat:
        try:
            return _by_ends(shell, flat)
        except NoReading as error:
            first = error
    else:
        first = NoReading("no flat piece with a hole in it")
    # Bricks end in terraces, which go round a cavity as the cut does, and within narrower outlines.
    widest = sorted(flat, key=lambda own: -_outline(shell, own))[:1] if len(flat) > 1 else []
    # Each ventricle may be cut by a plane of its own, with a step between them: no piece goes round its cavity.
    for ends in (widest, [own for own in _joined(shell) if shell.rims(own) not in (0, 1)]):
        if ends:
            try:
                return _by_ends(shell, ends)
            except NoReading:
                continue
    raise first


def _joined(shell: Shell) -> list[BoolArray]:
    """Pieces that are flat to the file's digits, small ones too, with those that they border on."""
    flat = flat_pieces(shell, _STEP, _DIGITS)
    number = shell.pieces(np.any([np.zeros(len(shell), dtype=bool), *flat], axis=0))
    size = np.bincount(number + 1, weights=shell.area)[1:]
    return [number == k for k in np.flatnonzero(size >= _FLAT * shell.area.sum())]


def _by_ends(shell: Shell, flat: list[BoolArray]) -> Reading:
    """Names of a wall whose flat ends are known."""
    areas = [float(shell.area[own].sum()) for own in flat]
    ends = _ends(shell, flat, areas)
    taken = np.zeros(len(shell), dtype=bool)
    for own in ends.values():
        taken |= own
    return _read(shell, "flat pieces", taken, ends)


def _ends(shell: Shell, flat: list[BoolArray], areas: list[float]) -> dict[str, BoolArray]:
    """Flat pieces by what they are: all that look the way of the largest one are base, the opposite one apex."""
    # The largest one may be the apex's, where the wall is thicker there: the outline tells.
    order = sorted(range(len(flat)), key=lambda k: -_outline(shell, flat[k]) if areas[k] > areas[0] / 20.0 else 0.0)
    flat, areas = [flat[k] for k in order], [areas[k] for k in order]
    up = _direction(shell, flat[0])
    base, apex = flat[0].copy(), np.zeros(len(shell), dtype=bool)
    for own, area in zip(flat[1:], areas[1:]):
        along = float(_direction(shell, own) @ up)
        if along < -0.7 and area > areas[0] / 20.0:
            apex |= own
        elif along > 0.7:
            base |= own
    apex = _grown(shell, apex, -up)
    return {"base": _grown(shell, base, up), **({"apex": apex} if apex.any() else {})}


def _outline(shell: Shell, own: BoolArray) -> float:
    """Area within the outline of a flat piece, its hole included, mm2."""
    middle = shell.centre[own].mean(axis=0)
    frame = np.linalg.svd(shell.centre[own] - middle, full_matrices=False)[2][:2]
    return float(hull_of((shell.centre[own] - middle) @ frame.T).volume)


def _grown(shell: Shell, own: BoolArray, up: FloatArray) -> BoolArray:
    """A flat end with the facets beside it that go on in its way without a crease: it may be bent a little."""
    fold = np.einsum("ij,ij->i", *(shell.normal[shell.pairs[:, k]] for k in range(2)))
    level = shell.normal @ up > np.cos(np.radians(_LEVEL))
    pairs = shell.pairs[fold > np.cos(np.radians(_BEND))]
    own = own.copy()
    for _ in range(1000 if own.any() else 0):
        beside = np.zeros(len(own), dtype=bool)
        for one, other in (pairs.T, pairs.T[::-1]):
            beside[other[own[one]]] = True
        fresh = beside & level & ~own
        if not fresh.any():
            break
        own |= fresh
    return own


def _direction(shell: Shell, own: BoolArray) -> FloatArray:
    total = shell.vector[own].sum(axis=0)
    return np.asarray(total / np.linalg.norm(total))


def by_creases(shell: Shell, degrees: float) -> Reading:
    """Sheets between creases: a base that is bent, or not quite flat, still has sharp rims."""
    fold = np.einsum("ij,ij->i", *(shell.normal[shell.pairs[:, k]] for k in range(2)))
    piece = shell.pieces(across=fold > np.cos(np.radians(degrees)))
    total = shell.area.sum()
    sheets = [piece == k for k in range(int(piece.max()) + 1)]
    sheets = [own for own in sheets if shell.area[own].sum() >= _SHEET * total]
    if len(sheets) < 3:
        raise NoReading(
            f"creases of {degrees:g} degrees part {len(sheets)} sheets; endocardium, epicardium and base are 3"
        )
    ends = []
    for own in sheets:
        middle = np.average(shell.centre[own], axis=0, weights=shell.area[own])
        size = np.sqrt(shell.area[own].sum())
        step = shell.centre[own] - middle
        spread_ = np.einsum("ni,nj,n->ij", step, step, shell.area[own]) / shell.area[own].sum()
        off = float(np.sqrt(max(np.linalg.eigvalsh(spread_)[0], 0.0)))
        if (
            off < _BENT * size / 2
            and np.linalg.norm(shell.vector[own].sum(axis=0)) > 0.7 * shell.area[own].sum()
            and shell.rims(own) != 1
        ):
            ends.append(own)
    if not ends:
        raise NoReading(f"no sheet between creases of {degrees:g} degrees is nearly flat")
    areas = [float(shell.area[own].sum()) for own in ends]
    named = _ends(shell, ends, areas)
    taken = np.zeros(len(shell), dtype=bool)
    for own in named.values():
        taken |= own
    return _read(shell, f"creases of {degrees:g} degrees", taken, named)


def by_plane(shell: Shell, base: Plane) -> Reading:
    """A base plane that was given: the facets that lie along it, within an edge."""
    height = (shell.centre - base.point) @ base.normal
    along = shell.normal @ base.normal
    reach = max(shell.edge, 1e-9)
    own = (np.abs(height) < reach) & (along > 0.7)
    own |= height > reach
    if not own.any():
        raise NoReading(f"no facet lies along the base plane through {spot(base.point)}")
    return _read(shell, "base plane given", own, {"base": own})


def flat_pieces(shell: Shell, share: float = _FLAT, degrees: float = _FOLD) -> list[BoolArray]:
    """Connected pieces of the boundary that lie in a plane and take a share of its area, the largest first."""
    fold = np.einsum("ij,ij->i", *(shell.normal[shell.pairs[:, k]] for k in range(2)))
    piece = shell.pieces(across=fold > np.cos(np.radians(degrees)))
    size = np.bincount(piece, weights=shell.area)
    found = []
    for k in np.flatnonzero(size >= share * shell.area.sum()):
        own = piece == k
        middle = np.average(shell.centre[own], axis=0, weights=shell.area[own])
        if own.sum() >= 3 and np.abs((shell.centre[own] - middle) @ _direction(shell, own)).max() < _OFF * shell.edge:
            found.append(own)
    return found


def _read(shell: Shell, way: str, taken: BoolArray, ends: dict[str, BoolArray]) -> Reading:
    """Names of the sheets that are left when base and apex are taken out.

    Raises
    ------
    NoReading
        They are not one around others.
    """
    piece = shell.pieces(~taken)
    count = int(piece.max(initial=-1)) + 1
    size = np.array([shell.area[piece == k].sum() for k in range(count)])
    big = [k for k in range(count) if size[k] >= _SHEET * shell.area.sum()]
    enclosed = {k: shell.enclosed(piece == k) for k in big}
    outer = [k for k in big if enclosed[k] > 0]
    inner = [k for k in big if enclosed[k] <= 0]
    if len(outer) != 1 or not inner:
        raise NoReading(
            f"{len(big)} sheets are left, {len(outer)} of them look outward and {len(inner)} into a cavity; one and at "
            "least one are expected"
        )
    epi = piece == outer[0]
    tissue = sum(enclosed.values())
    if tissue <= 0:
        raise NoReading("the cavities are larger than what encloses them")
    _none_left(shell, epi, enclosed[outer[0]], len(inner))
    names, sure, questions = name_cavities(shell, [piece == k for k in inner], epi)
    tag = np.zeros(len(shell), dtype=np.int32)
    tag[epi] = FACET_TAGS["epi"]
    given = {"epi": Name(1.0, "the one sheet that looks outward")}
    for k, name in zip(inner, names):
        endo = endocardium(name, alone=len(inner) == 1)
        tag[piece == k] = FACET_TAGS[endo]
        given[endo] = sure[name]
    flat = "a flat piece" if way == "flat pieces" else "a piece between the sheets"
    for name, end in ends.items():
        tag[end] = FACET_TAGS[name]
        given[name] = Name(1.0 if way in ("flat pieces", "base plane given") else 0.9, flat)
    if "apex" in ends:
        areas = [_outline(shell, ends[name]) for name in ("base", "apex")]
        ratio = areas[0] / max(areas[1], 1e-9)
        told = Name(float(1.0 - 0.5 / max(ratio, 1.0) ** 2), f"the larger outline of two flat ends, {ratio:.1f} times")
        given["base"] = given["apex"] = told
        if ratio < _LARGER:
            middle = np.average(shell.centre[ends["base"]], axis=0, weights=shell.area[ends["base"]])
            questions.append(
                Question(
                    f"the wall has two flat ends of nearly the same size: is the base the one near {spot(middle)}?",
                    f"at = {{ base = [{', '.join(f'{x:.1f}' for x in middle)}] }}",
                )
            )
    return Reading(way, spread(shell, tag), given, tuple(questions))


def _none_left(shell: Shell, epi: BoolArray, enclosed: float, count: int) -> None:
    """What is named epicardium goes into no cavity: a right ventricle may be open where the left one is closed.

    Raises
    ------
    NoReading
        The convex hull holds more cavities than were found.
    """
    hull = hull_of(shell.points[np.unique(shell.triangles[epi[shell.facet_of]])]).volume
    if count > 2 or enclosed > _FULL * hull:
        return
    held = hollows(shell)[2]
    if held > count:
        raise NoReading(f"{count} of the {held} cavities that the convex hull holds is found")


def spread(shell: Shell, tag: np.ndarray) -> np.ndarray:
    """Names for facets that have none, from their neighbours, ring by ring."""
    tag = tag.copy()
    for _ in range(1000):
        empty = tag == 0
        if not empty.any():
            break
        ends = np.concatenate([shell.pairs, shell.pairs[:, ::-1]])
        ends = ends[empty[ends[:, 0]] & ~empty[ends[:, 1]]]
        if not len(ends):
            break
        tag[ends[:, 0]] = tag[ends[:, 1]]
    return tag
