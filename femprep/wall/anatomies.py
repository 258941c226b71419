"""A segmentation in, the closed surfaces and planes of a wall out, by anatomy; ``pipeline`` fills it.

What labels and options tell at once, objects, planes and openings, is laid out before any surface is fitted.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from femprep.errors import StageError
from femprep.image import LabelObject, Segmentation
from femprep.model import Notice, Plane, Progress, Surface, endocardium, noted
from femprep.model.stages import Stages
from femprep.options import Options
from femprep.options.advice import MORE_VERTICES
from femprep.surface import fit_surface
from femprep.surface.fitting.outlined import outline_surface
from femprep.wall import (
    Envelope,
    Opening,
    Part,
    check_openings,
    extend_apex,
    find_apex,
    find_base,
    find_common_base,
    find_openings,
    given_openings,
    keep_apart,
    thin_wall,
)
from femprep.wall.assumed import assumed_wall, closed_openings, filled_groove, unused_structures
from femprep.wall.outlines import Outline
from femprep.wall.planes.common_base import separate_bases

logger = logging.getLogger(__name__)

#: Vertices of the common epicardium over those of one cavity, by how much larger its surface is.
_EPI_SHARE: Final = {"biv": 1.8, "whole-heart": 4.5}
#: Rounding of the joint of both ventricles by the wall thickness of the right one, and of what is added to reach the
#: least thickness.
_ROUNDING, _LEAST_ROUNDING = 3.0, 0.5
#: How far below an outline of the body grooves are filled up where the epicardium folds in them, mm, in turn.
_BELOW: Final = (2.0, 1.0, 0.5, 0.0)
#: Width over which the grooves between the chambers of the whole heart are rounded, mm.
_GROOVE: Final = 6.0
#: How far from another chamber the epicardium follows one alone, mm: from a labelled right ventricle, from any chamber
#: of the whole heart, whose grooves are filled.
_JOINT: Final = {"biv": 2.0 * _GROOVE, "whole-heart": 20.0}
#: Beside a right ventricle whose wall is assumed it follows the left one's outline where their rounded joint lifts it
#: by no more than this, pixels.
_LIFT: Final = 1.0 / 3.0


@dataclass(frozen=True)
class Layout:
    """What is known of a wall before any surface is fitted.

    Attributes
    ----------
    objects : mapping of str to LabelObject
        What surfaces are fitted to, in this order.
    base, apex : Plane, optional
    right_base : Plane, optional
        Base of the right ventricle, where it is another one.
    openings : list of Opening
        To be cut into the wall.
    """

    objects: Mapping[str, LabelObject]
    base: Plane | None = None
    apex: Plane | None = None
    right_base: Plane | None = None
    openings: list[Opening] = field(default_factory=list)


@dataclass(frozen=True)
class WallSurfaces:
    """What a wall is built from.

    Attributes
    ----------
    objects : mapping of str to LabelObject
        What the surfaces were fitted to.
    endo : mapping of str to Surface
        Endocardium of each cavity.
    epi : Surface
    base, apex, right_base : Plane, optional
    body : Surface, optional
        Outer surface of the left ventricle alone, where the epicardium is another one.
    openings : list of Opening
        To be cut into the wall.
    repaired : list of dict
        What was done to the surfaces, JSON-ready, each with its notice.
    outlines : tuple of Outline
        What the facets of the finished mesh ought to follow.
    notices : list of Notice
        What was assumed, or left out, where the labels do not tell or nobody asked.
    """

    objects: Mapping[str, LabelObject]
    endo: Mapping[str, Surface]
    epi: Surface
    base: Plane | None = None
    apex: Plane | None = None
    right_base: Plane | None = None
    body: Surface | None = None
    openings: list[Opening] = field(default_factory=list)
    repaired: list[dict[str, Any]] = field(default_factory=list)
    outlines: tuple[Outline, ...] = ()
    notices: list[Notice] = field(default_factory=list)

    @property
    def surfaces(self) -> dict[str, Surface]:
        """All surfaces by the name of their file."""
        found = {**self.endo, "epi": self.epi, **({} if self.body is None else {"lv_epi": self.body})}
        return {name: replace(surface, name=name) for name, surface in found.items()}

    @property
    def planes(self) -> dict[str, Plane]:
        """The planes that cut the wall, by the name of their facets."""
        own = {"base": self.base, "apex": self.apex, "base_rv": self.right_base}
        return {name: plane for name, plane in own.items() if plane is not None}

    @property
    def by_facets(self) -> dict[str, Surface]:
        """Those that the wall is built from by the tags of its facets."""
        alone = len(self.endo) == 1
        endo = {endocardium(name, alone): surface for name, surface in self.endo.items()}
        return {**endo, "epi": self.epi}


#: Chambers of the whole heart, those first whose surfaces are trusted most: what each body is made of.
CHAMBERS: Final = {"lv": ("lv", "myo"), "rv": ("rv", "rv_wall"), "la": ("la", "la_wall"), "ra": ("ra", "ra_wall")}


def lay_out(seg: Segmentation, options: Options, stages: Stages, *, one_base: bool = False) -> Layout:
    """Objects, planes and openings of the anatomy asked for, by the labels.

    Raises
    ------
    InputError
        A structure is missing or no solid object; no base or apex is found; a given opening is none.
    """
    wall, whole = options.wall, options.anatomy == "whole-heart"
    openings: list[Opening] = []
    if whole:
        with stages("openings"):
            openings = given_openings(wall.valves)
            if wall.openings == "labels":
                named = {opening.name for opening in openings}
                openings += [opening for opening in find_openings(seg) if opening.name not in named]
            check_openings(seg, openings)
    with stages("objects"):
        right, right_base = separate_bases(seg, wall) if options.anatomy == "biv" and not one_base else (seg, None)
        parts = structures_of(seg, options.anatomy)
        objects = {
            name: (right if own[0] == "rv" else seg).object(*own, name=name, options=options.image)
            for name, own in parts.items()
        }
    if whole:
        return Layout(objects, openings=openings)
    with stages("planes"):
        base = (find_base if options.anatomy == "lv" or right_base else find_common_base)(seg, options=wall)
        apex = find_apex(seg, options=wall) if wall.apex == "clipped" else None
    return Layout(objects, base, apex, right_base)


def structures_of(seg: Segmentation, anatomy: str) -> dict[str, tuple[str, ...]]:
    """Structures that each object of an anatomy is the union of."""
    if anatomy == "lv":
        return {"lv": ("lv",), "epi": ("lv", "myo")}
    if anatomy == "biv":
        right = {"rv_epi": ("rv", "rv_wall")} if "rv_wall" in seg.structures else {}
        return {"lv": ("lv",), "rv": ("rv",), "lv_epi": ("lv", "myo"), **right}
    cavities: dict[str, tuple[str, ...]] = {name: (name,) for name in CHAMBERS}
    bodies = {f"{name}_epi": own for name, own in CHAMBERS.items() if own[1] in seg.structures or name == "lv"}
    return {**cavities, **bodies}


def _fitted(seg: Segmentation, layout: Layout, options: Options, stages: Stages, outer: str = "") -> dict[str, Surface]:
    """A closed surface for each object; that around the left ventricle, ``outer``, goes on where its labels end."""
    fitted: dict[str, Surface] = {}
    for name, obj in layout.objects.items():
        with stages(f"surface {name}") as report:
            closed = name == outer and layout.apex is None
            # Only the smooth surface follows views.
            heart = seg if options.surface.method == "smooth" else replace(seg, views=())
            own = extend_apex(heart, obj, endo=fitted["lv"], options=options.wall) if closed else None
            fitted[name] = fit_surface(obj, boundary=own, options=options.surface, progress=report)
    return fitted


def left_ventricle(seg: Segmentation, layout: Layout, options: Options, stages: Stages) -> WallSurfaces:
    """Endo- and epicardium of the left ventricle, fitted to ``lv`` and ``lv`` + ``myo``."""
    objects, base, apex = layout.objects, layout.base, layout.apex
    fitted = _fitted(seg, layout, options, stages, outer="epi")
    outlines = Outline("endo", objects["lv"]), Outline("epi", objects["epi"])
    return WallSurfaces(objects, {"lv": fitted["lv"]}, fitted["epi"], base, apex, outlines=outlines)


def both_ventricles(seg: Segmentation, layout: Layout, options: Options, stages: Stages) -> WallSurfaces:
    """Both endocardia and the common epicardium.

    The epicardium encloses the left ventricle (``lv`` + ``myo``) and the right one: where the labels have its wall
    (``rv_wall``) as they have it, else its cavity grown by ``rv_wall_thickness``; in any case all cavities grown by
    ``minimum_thickness``.
    """
    objects, base, apex = layout.objects, layout.base, layout.apex
    wall, walled = options.wall, "rv_epi" in objects
    fitted = _fitted(seg, layout, options, stages, outer="lv_epi")
    with stages("surface epi") as report:
        cavities = {name: fitted[name] for name in ("lv", "rv")}
        cavities, repaired = keep_apart(cavities, wall.minimum_thickness, wall.maximum_push)
        thickness = wall.minimum_thickness if walled else wall.rv_wall_thickness
        least = _LEAST_ROUNDING * wall.minimum_thickness
        enclosed = [Part(fitted["lv_epi"], 0.0, 0.0)]
        if walled:
            enclosed.append(Part(fitted["rv_epi"], 0.0, _GROOVE))
        enclosed.append(Part(cavities["rv"], thickness, least if walled else _ROUNDING * thickness))
        enclosed.append(Part(cavities["lv"], wall.minimum_thickness, least))
        epi = _enclose(enclosed, seg, options, report, repaired)
    clear = _JOINT["biv"] if walled else thickness + _rounded(_ROUNDING * thickness, _LIFT * seg.grid.pixel)
    outlines = _outlines(objects, {**fitted, **cavities}, ("lv", "rv"), ("lv", "rv"), clear)
    return WallSurfaces(
        objects,
        cavities,
        epi,
        base,
        apex,
        layout.right_base,
        fitted["lv_epi"],
        repaired=repaired,
        outlines=outlines,
        notices=[] if walled else [assumed_wall("rv", thickness)],
    )


def whole_heart(seg: Segmentation, layout: Layout, options: Options, stages: Stages) -> WallSurfaces:
    """Endocardia of the four chambers and the epicardium around them, all closed.

    The epicardium encloses the body of each chamber, cavity and wall, as the labels have it (a chamber without a
    labelled wall: its cavity grown by ``rv_wall_thickness`` or ``atrial_wall_thickness``), and all cavities grown by
    ``minimum_thickness``: walls that are thinner, or that the labels leave open, are thickened outwards. Between two
    chambers the less trusted one gives way. Both are told in ``repaired``. Walls of vessels are left out. Openings are
    those of the labels, or given ones, where they are asked for.
    """
    wall, objects = options.wall, layout.objects
    given = {"rv": wall.rv_wall_thickness, "la": wall.atrial_wall_thickness, "ra": wall.atrial_wall_thickness}
    fitted = _fitted(seg, layout, options, stages)
    with stages("surface epi") as report:
        cavities = {name: fitted[name] for name in CHAMBERS}
        cavities, repaired = keep_apart(cavities, wall.minimum_thickness, wall.maximum_push)
        bodies = [Part(fitted["lv_epi"], 0.0, 0.0)]
        for name, thickness in given.items():
            body = fitted.get(f"{name}_epi")
            labelled = Part(body, 0.0, _GROOVE) if body is not None else Part(cavities[name], thickness, _GROOVE)
            bodies.append(labelled)
        repaired += [record for name in CHAMBERS if (record := thin_wall(bodies, name, cavities[name], wall))]
        least = _LEAST_ROUNDING * wall.minimum_thickness
        grown = [Part(surface, wall.minimum_thickness, least) for surface in cavities.values()]
        epi = _enclose([*bodies, *grown], seg, options, report, repaired)
    notices = [assumed_wall(name, thickness) for name, thickness in given.items() if f"{name}_epi" not in fitted]
    notices += closed_openings(wall)
    notices += unused_structures(seg, [structure for own in CHAMBERS.values() for structure in own])
    return WallSurfaces(
        objects,
        cavities,
        epi,
        body=fitted["lv_epi"],
        openings=layout.openings,
        repaired=repaired,
        outlines=_outlines(
            objects, {**fitted, **cavities}, tuple(CHAMBERS), ("lv",), _JOINT["whole-heart"], layout.openings
        ),
        notices=notices,
    )


def _rounded(blend: float, lift: float) -> float:
    """How far beyond one of two bodies the smooth minimum of their fields lifts the other by more than so much, mm.

    At a distance d it is lifted by (blend - d)^2 / (4 blend).
    """
    return float(blend - min(blend, np.sqrt(4.0 * blend * lift)))


def _outlines(
    objects: Mapping[str, LabelObject],
    surfaces: Mapping[str, Surface],
    chambers: tuple[str, ...],
    walled: tuple[str, ...],
    clear: float,
    openings: Sequence[Opening] = (),
) -> tuple[Outline, ...]:
    """What endocardia and the common epicardium ought to follow: this the outline of some labelled bodies.

    Where another chamber joins a body, whose wall may be assumed, the epicardium runs from one to the other. Of a whole
    heart it follows the left ventricle's: thin walls of the others are thickened to the least thickness.
    """
    of = {name: tuple(one for one in openings if name in (one.cavity, one.beyond)) for name in chambers}
    endo = [Outline(f"endo_{name}", objects[name], openings=of[name]) for name in chambers]
    bodies = {name: objects[f"{name}_epi"] for name in chambers if f"{name}_epi" in objects}
    epi = []
    for name in walled:
        if name in bodies:
            others = tuple(surfaces.get(f"{other}_epi", surfaces[other]) for other in chambers if other != name)
            epi.append(Outline("epi", bodies[name], others, clear, of[name]))
    return (*endo, *epi)


def _enclose(
    parts: list[Part], seg: Segmentation, options: Options, report: Progress, repaired: list[dict[str, Any]]
) -> Surface:
    """Template surface of the body that encloses some surfaces; what it took is added to ``repaired``."""
    body = Envelope(parts)
    obj = replace(body.object(seg.grid, "epi"), frame=seg.frame)
    vertices = min(int(_EPI_SHARE[options.anatomy] * options.surface.vertices), 20000)
    # Its vertices are moved onto the body afterwards, so that it only has to be near.
    rough = outline_surface(obj, vertices)
    report("surface", 0.5)
    # The apex of the left ventricle may have been extrapolated, which the run's record tells of its epicardium.
    boundary = parts[0].surface.info.get("boundary", {})
    rough = replace(rough, info={**rough.info, "boundary": boundary})
    best: tuple[int, float, Surface] | None = None
    for below in (np.inf, *_BELOW):
        envelope = body.filled(rough, below) if below < np.inf else body
        try:
            found = envelope.settle(rough)
        except StageError as error:
            logger.warning("%s", error)
            continue
        folds = envelope.folds(found)
        if best is None or folds < best[0]:
            best = folds, below, found
        if folds == 0:
            break
        logger.warning("the epicardium folds at %d triangles in a groove, which is filled up further", folds)
    if best is None:
        raise StageError(
            "the epicardium does not follow the body it encloses", advice=[MORE_VERTICES, "mend the labels"]
        )
    folds, below, found = best  # what folds are left is mended, or refused, where the wall is built
    if below < np.inf:
        record = {"filled": "grooves of the epicardium, in which it folds", "up_to_mm_below_an_outline": below}
        repaired.append(noted({**record, "folded_triangles": folds}, filled_groove(body, found, folds)))
    return found


#: What makes the parts of each anatomy from its layout.
ANATOMIES: Final[Mapping[str, Callable[[Segmentation, Layout, Options, Stages], WallSurfaces]]] = {
    "lv": left_ventricle,
    "biv": both_ventricles,
    "whole-heart": whole_heart,
}
