"""Anyone's surfaces of a heart in; the same in mm, mended, checked against each other, with their base plane, out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from femprep.errors import Advice, InputError, OptionError
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import is_closed, volume
from femprep.model import FloatArray, Notice, Plane, Surface, endocardium
from femprep.model.notice import spot
from femprep.model.surface import require_cells
from femprep.model.units import MILLIMETRES, check_size, guess_unit
from femprep.options import WallOptions, choose, takes
from femprep.options.advice import GIVE_BASE
from femprep.surface.given.beyond import closed_beyond
from femprep.surface.given.lid import without_lid
from femprep.surface.given.mend import mended
from femprep.surface.given.trim import trimmed
from femprep.wall.planes.rims import base_of_rims, require_rims_above

#: Names of surfaces: endocardia of the chambers, and what is around all of them.
CAVITIES: Final = ("lv", "rv", "la", "ra")
OUTER: Final = "epi"
#: Which of them make which anatomy.
_ANATOMY: Final = {("lv",): "lv", ("lv", "rv"): "biv", CAVITIES: "whole-heart"}
#: One surface this many times as large as another is in another unit.
_OTHER_UNIT: Final = 12.0
#: An endocardium may lie this far outside of the epicardium, mm, for the wall to be thickened there.
_OUTSIDE: Final = 1.0
#: Most of a closed surface's length that is cut away to where the endocardium is inside.
_CUT: Final = 0.3


@dataclass(frozen=True, eq=False)
class OwnSurfaces:
    """Surfaces that a template can be laid on, and what they are cut by.

    Attributes
    ----------
    surfaces : mapping of str to Surface
        In mm, mended, wound outward: closed, or open above the base. Flat lids and what lies more than about 4 mm
        beyond the base are taken off.
    base : Plane or None
        None where all are closed and stay so.
    unit : str
        Of the surfaces given.
    anatomy : str
        What they are surfaces of: ``"lv"``, ``"biv"`` or ``"whole-heart"``.
    notices : tuple of Notice
        What was assumed and found of all of them; those of each stand in its ``info``.

    Examples
    --------
    >>> fp.prepare_surfaces({"lv": endo, "epi": epi}, base=fp.find_base(seg)).anatomy
    'lv'
    """

    surfaces: Mapping[str, Surface]
    base: Plane | None
    unit: str
    anatomy: str
    notices: tuple[Notice, ...] = field(default_factory=tuple)

    @property
    def epi(self) -> Surface:
        """The epicardium.

        Examples
        --------
        >>> own = fp.prepare_surfaces({"lv": endo, "epi": epi}, base=fp.find_base(seg))
        >>> own.epi.name
        'epi'
        """
        return self.surfaces[OUTER]

    @property
    def endo(self) -> dict[str, Surface]:
        """Endocardium of each cavity by name.

        Examples
        --------
        >>> own = fp.prepare_surfaces({"lv": endo, "epi": epi}, base=fp.find_base(seg))
        >>> list(own.endo)
        ['lv']
        """
        return {name: surface for name, surface in self.surfaces.items() if name != OUTER}


@takes(WallOptions)
def prepare_surfaces(
    surfaces: Mapping[str, Surface],
    base: Plane | None = None,
    unit: str = "auto",
    options: WallOptions | None = None,
    **changes: object,
) -> OwnSurfaces:
    """Check anyone's surfaces of a heart and make them ready to be meshed.

    Corners that lie on each other are merged, windings turned, holes of up to 5 mm filled, specks left out, lengths
    brought to mm; whatever cannot be mended safely is refused with its place. The base plane is the given one; else the
    plane of the rims, or of the flat lids; where rims lie in no plane, one below all of them; of closed surfaces where
    the endocardium leaves the epicardium at one end. Each step is a notice.

    Parameters
    ----------
    surfaces : mapping of str to Surface
        ``lv`` (and ``rv``, ``la``, ``ra``): the endocardia; ``epi``: the epicardium around all of them.
    base : Plane, optional
        In the surfaces' own coordinates; its normal leads out of the heart.
    unit : {"auto", "mm", "cm", "m", "um"}
        Of the surfaces; guessed from their size by default, which is said.
    options, **changes
        :class:`~femprep.options.WallOptions`; ``base`` and ``base_offset`` matter here.

    Returns
    -------
    OwnSurfaces

    Raises
    ------
    InputError
        A surface is missing, in pieces, crosses itself, has a hole or handles, is in another unit or of no heart's
        size, or the endocardium is not inside the epicardium: one line, with the place.

    Examples
    --------
    >>> own = fp.prepare_surfaces({"lv": endo, "epi": epi}, base=fp.find_base(seg))
    >>> own.unit
    'mm'
    """
    chosen = choose(WallOptions, options, dict(changes))
    anatomy = anatomy_of(surfaces)
    ordered = {name: replace(surfaces[name], name=name) for name in (*CAVITIES, OUTER) if name in surfaces}
    for surface in ordered.values():
        require_cells(surface)
    unit, scale, notices = _unit(ordered, unit)
    if chosen.base == "annulus":
        raise OptionError("--base annulus needs labels with long-axis views", advice=[GIVE_BASE])
    if base is None and chosen.base is not None:
        base = Plane(np.array(chosen.base[:3]), np.array(chosen.base[3:]), "given")
    if base is not None and scale != 1.0:
        base = Plane(base.point * scale, base.normal, base.source, base.notices)
    found = {name: _ready(surface, scale, chosen.repair) for name, surface in ordered.items()}
    closed = {name: closed_beyond(surface.points, surface.triangles) for name, surface in found.items()}
    if anatomy == "whole-heart":
        _require_closed(found)
    elif base is not None:
        require_rims_above(found, base)
    else:
        base = base_of_rims(found) or _where_endo_leaves(closed)
    if base is not None and chosen.base_offset:
        base = Plane(base.point - chosen.base_offset * base.normal, base.normal, base.source, base.notices)
    if base is not None:
        notices += base.notices
    elif anatomy != "whole-heart":
        words = "the surfaces are closed, and the wall is closed around its cavities; give a base plane by --base"
        notices.append(Notice.of("assumed", words))
    _require_inside(closed, base)
    if base is not None:
        found = {name: s if s.directions is not None else trimmed(s, base) for name, s in found.items()}
    return OwnSurfaces(found, base, unit, anatomy, tuple(notices))


def anatomy_of(surfaces: Mapping[str, object]) -> str:
    """What surfaces of these names are surfaces of.

    Raises
    ------
    InputError
        A name is unknown, or one is missing.
    """
    unknown = [name for name in surfaces if name not in (*CAVITIES, OUTER)]
    own = tuple(name for name in CAVITIES if name in surfaces)
    if unknown:
        raise InputError(
            f"there is no surface named {unknown[0]!r}; endocardia are {', '.join(CAVITIES)}, the epicardium around "
            f"all of them is {OUTER}"
        )
    if OUTER not in surfaces or own not in _ANATOMY:
        ways = "; ".join(f"{' '.join((*names, OUTER))} ({anatomy})" for names, anatomy in _ANATOMY.items())
        raise InputError(f"surfaces {', '.join(surfaces) or 'none'} make no wall; give one of: {ways}")
    return _ANATOMY[own]


def facets_of(name: str, anatomy: str) -> str:
    """Name of the facets of a surface in a mesh of some anatomy."""
    return name if name == OUTER else endocardium(name, alone=anatomy == "lv")


def _unit(surfaces: Mapping[str, Surface], unit: str) -> tuple[str, float, list[Notice]]:
    """Their unit, its millimetres, and what there is to say of it; refused where they differ."""
    size = {name: float(np.linalg.norm(np.ptp(surface.points, axis=0))) for name, surface in surfaces.items()}
    least, most = min(size, key=size.__getitem__), max(size, key=size.__getitem__)
    if size[most] > _OTHER_UNIT * size[least]:
        raise InputError(
            f"surface {least!r} measures {size[least]:.4g} from corner to corner of its box and {most!r} "
            f"{size[most]:.4g}; are they in different units? bring both to mm"
        )
    if unit != "auto" and unit not in MILLIMETRES:
        raise InputError(f"unit is {unit!r}; expected auto, {', '.join(MILLIMETRES)}")
    if unit != "auto":
        check_size(f"surface {OUTER!r}", size[OUTER], unit)  # layers and columns between grow with the square of it
        return unit, MILLIMETRES[unit], []
    unit, diagonal = guess_unit(surfaces[OUTER].points, f"surface {OUTER!r}")
    words = f"lengths of the surfaces were taken to be in {unit}: the box around the heart is {{amount}} across"
    return unit, MILLIMETRES[unit], [Notice.of("assumed", words, amount=diagonal, unit="mm")]


def _ready(surface: Surface, scale: float, repair: bool) -> Surface:
    """A surface in mm, mended, without its flat lid. One with template directions, closed, stays as it is."""
    if scale != 1.0:
        surface = replace(surface, points=surface.points * scale, shape=None)
    if surface.directions is not None and is_closed(surface.cells):
        return surface
    sound = mended(surface, repair=repair)
    lidless = without_lid(sound.points, sound.triangles)
    if lidless is None:
        return sound
    used, cells = np.unique(lidless.cells, return_inverse=True)
    return replace(sound, points=sound.points[used], cells=cells.reshape(-1, 3))


def _require_closed(surfaces: Mapping[str, Surface]) -> None:
    for name, surface in surfaces.items():
        if not is_closed(surface.triangles):
            raise InputError(
                f"surface {name!r} of a whole heart is open; close it, and cut its openings by --valve NAME=X,Y,Z,..."
            )


def _require_inside(closed: Mapping[str, tuple[FloatArray, np.ndarray]], base: Plane | None) -> None:
    """Refuse endocardia that are not inside the epicardium, or overlap."""
    outer = closed[OUTER]
    inner = {name: own for name, own in closed.items() if name != OUTER}
    whole = volume(*outer)
    for name, own in inner.items():
        away, at = _outside(own, outer, base)
        if volume(*own) > whole and away > _OUTSIDE:
            raise InputError(
                f"surface {name!r} ({volume(*own) / 1000:.1f} mL) is larger than {OUTER!r} ({whole / 1000:.1f} mL); "
                "have the names changed places?"
            )
        if away > _OUTSIDE:
            raise InputError(
                f"surface {name!r} lies up to {away:.1f} mm outside of surface {OUTER!r}, at {spot(at)}; the "
                "endocardium must be inside",
                advice=["move it", Advice("cut below by --base X,Y,Z,NX,NY,NZ", "wall.base")],
            )
    names = list(inner)
    for k, name in enumerate(names):
        for other in names[:k]:
            away, at = _outside(inner[name], inner[other], base, inside=True)
            if away > _OUTSIDE:
                raise InputError(
                    f"surfaces {other!r} and {name!r} overlap by up to {away:.1f} mm, at {spot(at)}; cavities must lie "
                    "apart"
                )


def _outside(
    own: tuple[FloatArray, np.ndarray],
    other: tuple[FloatArray, np.ndarray],
    base: Plane | None,
    inside: bool = False,
) -> tuple[float, FloatArray]:
    """How far one surface lies outside of the other below the base (or inside it), mm, and where most."""
    points = own[0]
    if base is not None:
        points = points[base.signed_distance(points) < 0.0]
    if not len(points):
        return 0.0, np.zeros(3)
    away = ClosestFinder(*other).signed(points)
    away = -away if inside else away
    worst = int(away.argmax())
    return float(away[worst]), points[worst]


def _where_endo_leaves(closed: Mapping[str, tuple[FloatArray, np.ndarray]]) -> Plane | None:
    """The base of closed surfaces: below where an endocardium leaves the epicardium, if that is at one end alone."""
    outer = ClosestFinder(*closed[OUTER])
    points, away = [], []
    for name, own in closed.items():
        if name != OUTER:
            points.append(own[0])
            away.append(outer.signed(own[0]))
    all_, out = np.concatenate(points), np.concatenate(away) > 0.0
    if not out.any() or out.all():
        return None
    left = closed["lv"][0]
    axis = np.linalg.svd(left - left.mean(axis=0), full_matrices=False)[2][0]
    axis = axis if (all_[out].mean(axis=0) - left.mean(axis=0)) @ axis > 0.0 else -axis
    height = all_ @ axis
    low, top = float(height[out].min()), float(height.max())
    if top - low > _CUT * float(np.ptp(height)):
        return None
    below = 0.02 * float(np.ptp(height))
    point = left.mean(axis=0) + (low - below - left.mean(axis=0) @ axis) * axis
    words = (
        "the closed surfaces meet at one end, which was taken for the base: it lies {amount} below the top of the "
        "endocardium"
    )
    notice = Notice.of("assumed", words, amount=top - low + below, unit="mm", place=point)
    return Plane(point, axis, "below where endocardium and epicardium meet", (notice,))
