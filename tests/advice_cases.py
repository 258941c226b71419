"""Inputs that are refused with advice, small ones, and what comes of each advice that is followed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from own_shapes import bent, closed, cup, gable, heart, without

import femprep as fp
from femprep.cohort.reasons import _place
from femprep.errors import Advice, FemprepError, OptionError
from femprep.model import Surface
from femprep.options import Options, choose
from femprep.options.advice import changed
from femprep.phantoms import biventricular, four_chambers, lv_ellipsoid

#: A plane through the phantoms' middle, where their true base is not.
BASE = (0.0, 0.0, 8.0, 0.0, 0.0, 1.0)
VOXELS = (2.5, 2.5, 8.0)
QUICK: dict[str, Any] = {
    "preset": "acdc",
    "surface": {"vertices": 300},
    "volume": {"mesher": "sweep", "edge_length": 8.0},
}
TETRAHEDRA = QUICK | {"volume": {"edge_length": 6.0}}
WHOLE: dict[str, Any] = {
    "anatomy": "whole-heart",
    "preset": None,
    "surface": {"vertices": 600},
    "volume": {"edge_length": 4.5},
}
#: Between left atrium and ventricle of the whole heart.
MITRAL = (0.0, 0.0, 49.0, 0.0, 0.0, 1.0, 10.0)
Run = Callable[[Options], object]


@dataclass(frozen=True)
class Case:
    """An input that is refused.

    Attributes
    ----------
    name : str
    run : callable
        Of options: meshes the input.
    options : mapping
        With which it is refused.
    give : mapping
        Values of options that advice leaves to the user, by their paths.
    mended : callable, optional
        The same for the input with what is wrong in it put right, or without an option, where advice names no option.
    slow : bool
        Takes more than about ten seconds.
    """

    name: str
    run: Run
    options: Mapping[str, Any] = field(default_factory=lambda: QUICK)
    give: Mapping[str, object] = field(default_factory=dict)
    mended: Run | None = None
    slow: bool = False


def heart_map(**given: Any) -> fp.Segmentation:
    """The left ventricle."""
    return lv_ellipsoid().segmentation(VOXELS, **given)


def relabelled(seg: fp.Segmentation, change: Callable[[np.ndarray], None]) -> fp.Segmentation:
    """A label map changed in place."""
    labels = np.array(seg.labels)
    change(labels)
    return replace(seg, labels=labels)


def gap(slices: slice | list[int], seg: fp.Segmentation) -> fp.Segmentation:
    """The wall left out on one side of some slices."""

    def cut(labels: np.ndarray) -> None:
        middle = labels.shape[0] // 2
        part = labels[middle:, :, slices]
        part[part == seg.structures["myo"][0]] = 0

    return relabelled(seg, cut)


def displaced(millimetres: float, *numbers: int) -> fp.Segmentation:
    """Slices displaced, or all of them at random by the same."""
    count = lv_ellipsoid().grid(VOXELS).shape[2]
    shifts = np.zeros((count, 2))
    shifts[list(numbers), 0] = millimetres
    every = np.random.default_rng(5).normal(0.0, millimetres, (count, 2))
    return heart_map(shifts=shifts if numbers else every)


def tube() -> fp.Segmentation:
    """A heart whose ends are alike."""
    seg = heart_map()

    def repeat(labels: np.ndarray) -> None:
        middle = labels[:, :, 8].copy()
        labels[:] = 0
        labels[:, :, 3:11] = middle[:, :, None]

    return relabelled(seg, repeat)


def mesh(seg: fp.Segmentation) -> Run:
    return lambda options: fp.mesh_segmentation(seg, options)


def open_chambers() -> fp.Segmentation:
    """A whole heart whose left ventricle reaches up to the atrium in a column, its mitral valve."""
    seg = four_chambers().segmentation((2.5, 2.5, 2.5))
    x, y, z = seg.grid.to_world(np.argwhere(seg.labels >= 0)).T.reshape(3, *seg.grid.shape)
    column = (np.hypot(x, y) < 10.0) & (z > 30.0) & (z < 60.0) & ~seg.mask("la")
    return replace(seg, labels=np.where(column, seg.structures["lv"][0], seg.labels))


def without_options(seg: fp.Segmentation, **options: Any) -> Run:
    """Meshes a map with quick options, whatever is given."""
    return lambda _: fp.mesh_segmentation(seg, Options(**(QUICK | options)))


def phases(seg: fp.Segmentation) -> Run:
    return lambda options: fp.mesh_sequence([seg, seg], options)


def surfaces(given: Mapping[str, Surface]) -> Run:
    return lambda options: fp.mesh_surfaces(given, options)


def with_wall(**wall: Any) -> dict[str, Any]:
    """Quick options with some of the wall's."""
    return QUICK | {"wall": wall}


def with_volume(**volume: Any) -> dict[str, Any]:
    """Options of tetrahedra with some of the volume's."""
    return QUICK | {"volume": volume}


def cases() -> list[Case]:
    """All of them; the inputs are made when they are asked for."""
    sound = heart_map()
    thicker = lv_ellipsoid(epi=(42.0, 42.0, 78.0)).segmentation(VOXELS)
    open_base = {name: cup(name) for name in ("lv", "epi")}
    own = {key: value for key, value in QUICK.items() if key != "preset"}
    shell = own | {"wall": {"base": (0.0, 0.0, 20.0, 0.0, 0.0, 1.0)}}
    low = {**open_base, "lv": without(open_base["lv"], (0.0, 25.0, -5.0), 14.0)}
    wide = closed("lv").points
    wide = wide + np.outer(np.maximum(wide[:, 2], 0.0), [0.9, 0.0, 0.0])
    outside = {**heart(), "lv": replace(closed("lv"), points=wide)}
    limits = {"minimum_thickness": 8.7, "maximum_push": 0.02}
    strict = {"policy": "strict", "minimum_thickness": 8.7}
    pieces, swept = displaced(15.0), QUICK["volume"]
    both, turned, beyond = biventricular().segmentation(VOXELS), tube(), {"base": (0.0, 0.0, -20.0, 0.0, 0.0, 1.0)}
    chambers = open_chambers()
    legs = {name: bent(one) for name, one in heart().items()}
    return [
        Case(
            "both ventricles, swept",
            mesh(both),
            with_volume(mesher="sweep", edge_length=6.0) | {"anatomy": "biv"},
            slow=True,
        ),
        Case(
            "both ventricles, few vertices",
            mesh(both),
            TETRAHEDRA | {"anatomy": "biv", "surface": {"vertices": 60}},
            {"surface.vertices": 300},
            slow=True,
        ),
        Case("blood, swept", mesh(sound), QUICK | {"blood_pool": True}, mended=without_options(sound), slow=True),
        Case(
            "an option of the other mesher",
            mesh(sound),
            TETRAHEDRA | {"sweep": {"layers": 3}},
            mended=without_options(sound),
        ),
        Case("phases of both ventricles", phases(both), TETRAHEDRA | {"anatomy": "biv"}, mended=mesh(both), slow=True),
        Case(
            "ends alike, fibres",
            mesh(turned),
            with_wall(**beyond) | {"fibres": {}},
            {"wall.basal_end": "last"},
        ),
        Case(
            "a closed whole heart, fibres",
            mesh(chambers),
            WHOLE | {"fibres": {}},
            {"wall.valves": {"mitral": MITRAL}},
            without_options(chambers, **WHOLE),
            slow=True,
        ),
        Case(
            "walls of a whole heart too thin, strict",
            mesh(four_chambers().segmentation((2.5, 2.5, 2.5))),
            WHOLE | {"wall": {"policy": "strict", "minimum_thickness": 3.0}},
            mended=mesh(four_chambers(7.0, 7.0).segmentation((2.5, 2.5, 2.5))),
            slow=True,
        ),
        Case(
            "rims that fall away",
            surfaces({name: gable(name) for name in ("lv", "epi")}),
            own,
            {"wall.base": (0.0, 0.0, -38.0, 0.0, 0.0, 1.0)},
        ),
        Case(
            "a base across both ends of a bent heart",
            surfaces(legs),
            own | {"volume": {"edge_length": 8.0}, "wall": {"base": (0.0, 0.0, -10.0, 0.0, 0.0, 1.0)}},
            {"wall.base": (25.0, 0.0, -20.0, 1.0, 0.0, 0.0), "wall.base_offset": 20.0},
            slow=True,
        ),
        Case("a cavity in pieces, slices displaced", mesh(pieces)),
        Case("surfaces cross, a slice displaced", mesh(displaced(30.0, 6)), slow=True),
        Case(
            "a slice displaced at the base",
            mesh(displaced(25.0, 8)),
            give={"wall.base": BASE},
            mended=mesh(sound),
            slow=True,
        ),
        Case(
            "the ring open from a slice on",
            mesh(gap(slice(4, 99), sound)),
            give={"wall.base": BASE},
            mended=mesh(sound),
            slow=True,
        ),
        Case("no ring closed", mesh(gap(slice(0, 99), sound)), mended=mesh(sound), slow=True),
        Case("a base far off", mesh(sound), QUICK | {"wall": {"base_offset": 200.0}}, {"wall.base_offset": 0.0}),
        Case(
            "a base given far off",
            mesh(sound),
            QUICK | {"wall": {"base": (0, 0, 300, 0, 0, 1)}},
            {"wall.base": BASE},
            slow=True,
        ),
        Case("ends alike", mesh(tube()), give={"wall.basal_end": "last"}, slow=True),
        Case(
            "a small heart",
            mesh(lv_ellipsoid((2.5, 2.5, 6.0), (3.4, 3.4, 6.9), 2.0).segmentation((0.2, 0.2, 0.6))),
            QUICK | {"volume": swept | {"edge_length": 0.8}},
        ),
        Case("edges too long", mesh(sound), QUICK | {"volume": {"edge_length": 60.0}}, slow=True),
        Case(
            "too many elements",
            mesh(sound),
            QUICK | {"volume": {"edge_length": 2.5, "memory_limit": 0.2}},
            {"volume.memory_limit": 8.0},
            slow=True,
        ),
        Case("a wall too thin, strict", mesh(sound), TETRAHEDRA | {"wall": strict}, mended=mesh(thicker), slow=True),
        Case("a wall not thickened so far", mesh(sound), QUICK | {"wall": limits}, mended=mesh(thicker)),
        Case("the same, tetrahedra", mesh(sound), TETRAHEDRA | {"wall": limits}, mended=mesh(thicker), slow=True),
        Case("phases in pieces", phases(pieces), slow=True),
        Case(
            "phases, a slice displaced at the base",
            phases(displaced(25.0, 8)),
            give={"wall.base": BASE},
            mended=phases(sound),
            slow=True,
        ),
        Case(
            "closed surfaces, fibres",
            surfaces(heart()),
            TETRAHEDRA | {"preset": None, "fibres": {}},
            {"wall.base": BASE},
            slow=True,
        ),
        Case("closed surfaces, swept", surfaces(heart()), own, {"wall.base": BASE}),
        Case(
            "a hole in the side of a surface",
            surfaces(low),
            shell,
            {"wall.base": (0, 0, -20, 0, 0, 1)},
            surfaces(open_base),
            slow=True,
        ),
        Case("an endocardium outside", surfaces(outside), shell, {"wall.base": (0, 0, 5, 0, 0, 1)}, surfaces(heart())),
        Case(
            "surfaces of a rat",
            surfaces({name: replace(one, points=0.1 * one.points) for name, one in open_base.items()}),
            own | {"volume": swept | {"edge_length": 0.8}, "unit": "mm"},
        ),
        Case(
            "a base beyond the surfaces",
            surfaces(heart()),
            own | {"wall": {"base": (0, 0, 300, 0, 0, 1)}},
            {"wall.base": BASE, "wall.base_offset": 290.0},
            slow=True,
        ),
    ]


@dataclass(frozen=True)
class Followed:
    """What came of one advice."""

    case: str
    site: str
    line: str
    advice: str
    outcome: str


def followed(case: Case) -> Iterator[Followed]:
    """Each advice of a case's refusal, followed by itself."""
    try:
        case.run(choose(Options, None, dict(case.options)))
    except FemprepError as caught:
        error = caught
    else:
        yield Followed(case.name, "", "", "", "not refused")
        return
    site, line = ":".join(_place(error)), str(error)
    if not error.advice:
        yield Followed(case.name, site, line, "", "no advice")
    for one in error.advice:
        yield Followed(case.name, site, line, one.words, _outcome(case, one, error))


def _changed(options: Mapping[str, Any], one: Advice) -> Options:
    """The options with advice followed, also where they are refused together."""
    try:
        return changed(choose(Options, None, dict(options)), one)
    except OptionError:
        group, _, name = one.option.rpartition(".")
        own = {group: {**options.get(group, {}), name: one.value}} if group else {name: one.value}
        return choose(Options, None, {**options, **own})


def _outcome(case: Case, one: Advice, error: FemprepError) -> str:
    run, options = case.run, Options()
    if one.option and one.option != "labels":
        value = case.give.get(one.option) if one.value is None else one.value
        if value is None:
            return "no value to follow it with"
        options = _changed(case.options, one._replace(value=value))
    elif case.mended is not None:
        run = case.mended
        with suppress(OptionError):
            options = choose(Options, None, dict(case.options))
    else:
        return "nothing to follow it with"
    try:
        made = run(options)
    except FemprepError as again:
        return "the same words" if again.args == error.args else f"refused: {again}"
    passed = made.quality.passed if isinstance(made, fp.Run) else made.passed
    return "meshed" if passed else "meshed, a check failed"
