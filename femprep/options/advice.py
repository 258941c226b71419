"""Advice and the options in force in; what of it can still be followed out."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final

from femprep.errors import Advice, FemprepError, OptionError, as_advice
from femprep.options.base import choose, with_groups
from femprep.options.run import Options

#: Options, or groups of them, that a command does not let change; what to do in place of that, if anything.
Fixed = Mapping[str, str]
SEQUENCE: Final[Fixed] = {"volume.mesher": "mesh each phase by itself, without --sequence"}
TEMPLATE: Final[Fixed] = {"volume.mesher": "leave --template out"}
GIVEN_SURFACES: Final[Fixed] = {
    **dict.fromkeys(("image", "wall.basal_end", "anatomy"), ""),
    "labels": "mend the surfaces there",
}
#: A mesh with these has the connectivity of another one.
_TEMPLATE: Final = {"sweep.columns", "sweep.rows"}
SURFACES_ALONE: Final[Fixed] = dict.fromkeys(("wall", "volume", "sweep", "anatomy"), "")

#: What errors of several stages advise.
MEND: Final = Advice("mend the labels there", "labels")
GIVE_BASE: Final = Advice("give the base plane by --base X,Y,Z,NX,NY,NZ", "wall.base")
MOVE_BASE: Final = Advice("move the base by --base-offset", "wall.base_offset")
SHIFTS: Final = Advice("--correct-shifts", "image.correct_shifts", True)
GIVE_END: Final = Advice("give --basal-end first or last", "wall.basal_end")
MORE_VERTICES: Final = Advice("give more --vertices", "surface.vertices")
LONGER_EDGES: Final = Advice("choose a larger --edge-length", "volume.edge_length")
SHORTER_EDGES: Final = Advice("choose a smaller --edge-length", "volume.edge_length")


def thinner(reached: float) -> list[Advice]:
    """Advice where a wall cannot be made as thick as asked, but so thick, mm."""
    least = math.floor(10.0 * reached) / 10.0
    less = Advice(f"give --minimum-thickness {least:g}", "wall.minimum_thickness", least)
    return [MEND, less] if least > 0.0 else [MEND]


@contextmanager
def advice_within(options: Options | None, fixed: Fixed) -> Iterator[None]:
    """Leave out of an error of the block what :func:`followable` leaves out."""
    try:
        yield
    except FemprepError as error:
        error.advice = followable(error.advice, options, fixed)
        raise


def followable(advice: Iterable[Advice | str], options: Options | None, fixed: Fixed) -> tuple[Advice, ...]:
    """Advice without what is in force already, or what the command or another option rules out.

    Parameters
    ----------
    advice : iterable of Advice or str
    options : Options or None
        In force; None where they are what is wrong.
    fixed : mapping of str to str
        Options, or groups of them, that the command does not let change; what to do in place of that.

    Returns
    -------
    tuple of Advice
    """
    left: list[Advice] = []
    for one in map(as_advice, advice):
        held = [words for path, words in fixed.items() if path in (one.option, one.option.rpartition(".")[0])]
        found = Advice(held[0]) if held else one if options is None or not one.option else _followable(one, options)
        if found is not None and found.words:
            left.append(found)
    return tuple(dict.fromkeys(left))


def changed(options: Options, one: Advice) -> Options:
    """The options with advice followed; slices to leave out are added to others.

    Raises
    ------
    OptionError
        Another option rules it out.
    """
    group, _, name = one.option.rpartition(".")
    value: Any = one.value
    if name == "leave_out":
        value = tuple(sorted({*getattr(getattr(options, group), name), *value}))
    changes: dict[str, dict[str, Any]] = {group: {name: value}} if group else {}
    for path in options.unread(str(value)) if one.option == "volume.mesher" else ():
        other, _, unread = path.rpartition(".")
        default = type(getattr(options, other)).model_fields[unread].default
        changes.setdefault(other, {})[unread] = default
    return with_groups(options if group else choose(Options, options, {name: value}), **changes)


def _followable(one: Advice, options: Options) -> Advice | None:
    """The advice in the words that other options ask for; None where it cannot be followed."""
    group, _, name = one.option.rpartition(".")
    now = getattr(getattr(options, group) if group else options, name)
    if one.value is None:
        return one._replace(words=f"change --{name.replace('_', '-')}") if name == "base" and now is not None else one
    unread = options.unread(str(one.value)) if one.option == "volume.mesher" else []
    try:
        if now == one.value or _TEMPLATE.intersection(unread) or changed(options, one) == options:
            return None
    except OptionError:
        return None
    without = " and ".join(f"--{path.rpartition('.')[2].replace('_', '-')}" for path in unread)
    return one._replace(words=f"{one.words}, without {without}") if without else one
