"""Closed surfaces and planes in, the closed and tagged Wall out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from femprep.errors import Advice, InputError, OptionError, StageError
from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.topology import enclosed_volume
from femprep.model import FACET_TAGS, IntArray, Plane, Progress, Surface, TagArray, Wall
from femprep.model.notice import spot
from femprep.options import WallOptions, choose, takes
from femprep.options.advice import MEND
from femprep.surface.fit import fit_surface
from femprep.surface.given.mend import mended
from femprep.surface.given.trim import trimmed
from femprep.wall.clipping.clip import clip, rim_loops
from femprep.wall.clipping.clipped_surface import ClippedSurface
from femprep.wall.clipping.improve import improve, onto_exact
from femprep.wall.clipping.mend import mend
from femprep.wall.clipping.rim import refine_rims
from femprep.wall.clipping.thickness import push_apart, pushed, require_nested, summary
from femprep.wall.joining.checks import check_clipped, check_surface, check_wall
from femprep.wall.joining.planar import flat_cap
from femprep.wall.joining.solid import join

#: Rounds in which the wall beside all endocardia is brought to the least thickness once more.
_AGAIN = 3


@takes(WallOptions)
def build_wall(
    *,
    epi: Surface,
    endo: Mapping[str, Surface],
    base: Plane | None,
    apex: Plane | None = None,
    options: WallOptions | None = None,
    progress: Progress | None = None,
    **changes: Any,
) -> Wall:
    """Clip the surfaces and join them to the closed boundary of the wall.

    Parameters
    ----------
    epi : Surface
        Epicardium: a template surface, or anyone's, on which one is laid first (:func:`~femprep.fit_surface`).
    endo : mapping of str to Surface
        Endocardium of each cavity by name, likewise. The facets of a single one are tagged ``endo``, of several
        ``endo_<name>``.
    base, apex : Plane, optional
        Where the surfaces are cut; what lies on the side of the normal is cut away. Without an apex plane the wall is
        closed at the apex; without both the surfaces stay closed, and the cavities are enclosed by the wall.
    options, **changes
        :class:`~femprep.options.WallOptions`.
    progress : callable, optional
        Called with ``("wall", fraction)``.

    Returns
    -------
    Wall
        Tagged ``endo`` (or ``endo_<name>``), ``epi``, ``base`` and, where clipped, ``apex``. ``template`` numbers the
        vertices of each surface as its template does. ``info`` holds ``thickness``, ``quality``, ``volumes_mm3``,
        ``apex``, ``repaired``.

    Raises
    ------
    InputError
        A surface is open, wound inward or crosses itself, a plane misses it, the endocardium is not inside the
        epicardium, or the wall is thinner than ``minimum_thickness`` (with ``policy="strict"``, or beyond repair).
    OptionError
        ``apex="clipped"`` without an apex plane.
    StageError
        The surfaces could not be joined.

    References
    ----------
    Skrinjar & Bistoquet 2009, section 4 (open surfaces), doi 10.1155/2009/313517.

    Examples
    --------
    >>> fp.build_wall(epi=epi, endo={"lv": endo}, base=fp.find_base(seg))
    Wall(... points, ... triangles: endo, epi, base)
    """
    chosen = choose(WallOptions, options, changes)
    report = progress or (lambda stage, fraction: None)
    if chosen.apex == "clipped" and apex is None:
        raise OptionError("apex is 'clipped', but no apex plane was given; find one with find_apex")
    tags = _endo_tags(endo)
    for surface in (epi, *endo.values()):
        if surface.directions is not None:
            check_surface(surface)
    epi, endo = _templates(epi, endo, base)
    planes = {name: plane for name, plane in (("base", base), ("apex", apex)) if plane is not None}
    # From here on surfaces go by their part in the wall, whatever objects they were fitted to.
    outer = clip(replace(epi, name="epi"), planes)
    inner = {name: clip(replace(endo[name], name=name), own) for name, own in _planes_of(endo, planes).items()}
    repaired = []
    for clipped, surface in zip((outer, *inner.values()), (epi, *endo.values())):
        repaired += _even(clipped, surface, chosen)
        report("wall", 0.3)
    for clipped in inner.values():
        repaired += _thicken(outer, clipped, chosen)
    repaired += _thicken_again(outer, list(inner.values()), chosen)
    report("wall", 0.7)
    triangles, source = join(outer, inner)
    # Only now: the boolean engine would take new vertices in the middle of straight edges out again.
    if len(inner) > 1 and refine_rims([outer, *inner.values()]):
        triangles, source = _facets(outer, list(inner.values()))
    clipped_surfaces = [outer, *inner.values()]
    numbers = np.array([FACET_TAGS["epi"], *(FACET_TAGS[tag] for tag in tags.values())], dtype=np.int32)
    wall = _with_caps(clipped_surfaces, triangles, numbers[source], planes)
    report("wall", 0.9)
    info = {
        "vertices": len(epi.points),
        "apex": apex_info(epi, apex),
        "thickness": summary(outer, list(inner.values())),
        "repaired": repaired,
        "quality": _quality_info(wall),
        "volumes_mm3": _volumes(clipped_surfaces, wall),
        "planes": {name: plane.record() for name, plane in planes.items()},
    }
    wall = Wall(wall.points, wall.triangles, wall.facet_tag, wall.template, planes, info)
    check_wall(wall, shells=1 if planes else 1 + len(inner))
    report("wall", 1.0)
    return wall


def _endo_tags(endo: Mapping[str, Surface]) -> dict[str, str]:
    """Facet name of each endocardium."""
    if not endo:
        raise InputError('no endocardium was given; give at least one, as {"lv": surface}')
    if len(endo) == 1:
        return {next(iter(endo)): "endo"}
    tags = {name: f"endo_{name}" for name in endo}
    unknown = [name for name, tag in tags.items() if tag not in FACET_TAGS]
    if unknown:
        known = ", ".join(tag.removeprefix("endo_") for tag in FACET_TAGS if tag.startswith("endo_"))
        raise InputError(f"there is no facet tag for an endocardium named {unknown[0]!r}; known names: {known}")
    return tags


def _planes_of(endo: Mapping[str, Surface], planes: Mapping[str, Plane]) -> dict[str, dict[str, Plane]]:
    """The planes that cut each endocardium: of several, one that ends above the apex plane is closed there."""
    if len(endo) == 1 or len(planes) < 2:
        return {name: dict(planes) for name in endo}
    beyond = {name: planes["apex"].signed_distance(surface.points).max() > 0 for name, surface in endo.items()}
    return {name: dict(planes) if beyond[name] else {"base": planes["base"]} for name in endo}


def _templates(epi: Surface, endo: Mapping[str, Surface], base: Plane | None) -> tuple[Surface, Mapping[str, Surface]]:
    """The same surfaces, with a template laid on each that has none: one of anyone's."""

    def laid(surface: Surface) -> Surface:
        if surface.directions is not None:
            return surface
        sound = mended(surface)
        return fit_surface(sound if base is None else trimmed(sound, base))

    return laid(epi), {name: laid(surface) for name, surface in endo.items()}


def _even(clipped: ClippedSurface, surface: Surface, options: WallOptions) -> list[dict[str, Any]]:
    """Even out the triangles of a clipped surface; what had to be mended."""
    improve(clipped)
    if surface.shape is not None:
        slid = (clipped.template < 0) | (clipped.points != surface.points[clipped.template]).any(axis=1)
        onto_exact(clipped, surface.shape, slid)
    steps = [mend(clipped)] if options.policy == "repair" else []
    check_clipped(clipped)
    return [step for step in steps if step is not None]


def _thicken(epi: ClippedSurface, endo: ClippedSurface, options: WallOptions) -> list[dict[str, Any]]:
    """Bring the wall beside one endocardium to the least thickness, by policy; what was pushed."""
    require_nested(epi, endo)
    if options.policy == "strict":
        found = summary(epi, [endo])
        if found["minimum_mm"] < options.minimum_thickness:
            raise InputError(
                f"the wall is {found['minimum_mm']:.2f} mm thick at {spot(found['minimum_at_mm'])}, beside "
                f"{endo.name!r}, below minimum_thickness = {options.minimum_thickness:g} mm",
                advice=[MEND, Advice("--policy repair", "wall.policy", "repair")],
            )
        return []
    step = push_apart(epi, endo, options.minimum_thickness, options.maximum_push)
    if step is None:
        return []
    # The push stretches triangles; sliding along the pushed surface evens them out, and may thin the wall a little.
    improve(epi)
    further = push_apart(epi, endo, options.minimum_thickness, options.maximum_push)
    if further is not None:
        step["thickness_after_mm"] = further["thickness_after_mm"]
        step["farthest_push_mm"] += further["farthest_push_mm"]
    check_clipped(epi)
    return [pushed(step)]


def _thicken_again(epi: ClippedSurface, endos: list[ClippedSurface], options: WallOptions) -> list[dict[str, Any]]:
    """Make good what evening out the epicardium beside one endocardium took from the wall beside another."""
    if len(endos) == 1 or options.policy == "strict":
        return []
    steps = []
    for _ in range(_AGAIN):
        found = [push_apart(epi, endo, options.minimum_thickness, options.maximum_push) for endo in endos]
        steps += [pushed(step) for step in found if step is not None]
        if not any(found):
            break
    if steps:
        check_clipped(epi)
    return steps


def _facets(epi: ClippedSurface, endos: list[ClippedSurface]) -> tuple[IntArray, IntArray]:
    """All facets of the clipped surfaces, wound out of the wall, numbered over all; and the surface each comes from."""
    starts = np.cumsum([len(epi.points), *(len(clipped.points) for clipped in endos)])
    inner = [clipped.triangles[:, ::-1] + start for clipped, start in zip(endos, starts)]
    count = [len(epi.triangles), *map(len, inner)]
    return np.concatenate([epi.triangles, *inner]), np.repeat(np.arange(len(count)), count)


def _with_caps(
    clipped_surfaces: list[ClippedSurface], triangles: IntArray, tag: TagArray, planes: Mapping[str, Plane]
) -> Wall:
    """Close the joined clipped surfaces by well-shaped caps between their rims."""
    points = [clipped.points for clipped in clipped_surfaces]
    starts = np.cumsum([0, *(len(clipped.points) for clipped in clipped_surfaces)])
    count = int(starts[-1])
    cells, tags = [triangles], [tag]
    for number, (name, plane) in enumerate(planes.items()):
        rims = [(k, loop) for k, clipped in enumerate(clipped_surfaces) for loop in rim_loops(clipped, number)]
        added, cap = flat_cap([clipped_surfaces[k].points[rim] for k, rim in rims], plane)
        vertex = np.concatenate([*(rim + starts[k] for k, rim in rims), count + np.arange(len(added))])
        points.append(added)
        count += len(added)
        cells.append(vertex[cap])
        tags.append(np.full(len(cap), FACET_TAGS[name], dtype=np.int32))
    template = np.concatenate([*(clipped.template for clipped in clipped_surfaces), np.full(count - starts[-1], -1)])
    return Wall(np.concatenate(points), np.concatenate(cells), np.concatenate(tags), template, planes)


def apex_info(epi: Surface, apex: Plane | None) -> dict[str, Any]:
    """How a wall of this epicardium ends at the apex, and by how much it was extrapolated there; JSON-ready."""
    if apex is not None:
        return {"mode": "clipped", "extrapolated": False, "extrapolated_mm": 0.0}
    boundary = epi.info.get("boundary", {}).get("apex", {})
    length = float(boundary.get("extrapolated_mm", 0.0))
    return {**boundary, "mode": "closed", "extrapolated": length > 0.0, "extrapolated_mm": length}


def _quality_info(wall: Wall) -> dict[str, Any]:
    """Least and mean Q (the paper's Eq. 12), and where the worst triangle lies."""
    quality = triangle_quality(wall.points, wall.triangles)
    worst = int(quality.argmin())
    return {
        "triangles": len(wall.triangles),
        "minimum": float(quality.min()),
        "mean": float(quality.mean()),
        "minimum_at_mm": [round(float(x), 3) for x in wall.points[wall.triangles[worst]].mean(axis=0)],
    }


def _volumes(clipped_surfaces: list[ClippedSurface], wall: Wall) -> dict[str, float]:
    """Volumes within the planes, which have to add up: epicardium = cavities + wall."""
    inside = {clipped.name: enclosed_volume(clipped.points, clipped.triangles) for clipped in clipped_surfaces}
    outer, *cavities = inside.values()
    if abs(outer - sum(cavities) - wall.volume) > 1e-9 * outer:
        raise StageError(
            f"volumes do not add up: epicardium {outer:.6f}, cavities {sum(cavities):.6f}, wall {wall.volume:.6f} mm3"
        )
    return {**inside, "wall": wall.volume}
