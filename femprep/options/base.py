"""What all option groups share, and how a stage takes them: the options given, with changes by name."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from difflib import get_close_matches
from typing import Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from femprep.errors import OptionError, did_you_mean, quoted

#: What is done with input that has to be mended: mend and report, or refuse.
Policy = Literal["repair", "strict"]


class StageOptions(BaseModel):
    """Base of all option groups: frozen, no unknown names, no NaN."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True)

    def __repr_args__(self) -> list[tuple[str | None, Any]]:
        """What was given; the rest are the defaults, which the class tells."""
        return [(name, getattr(self, name)) for name in type(self).model_fields if name in self.model_fields_set]


T = TypeVar("T", bound=StageOptions)
F = TypeVar("F", bound=Callable[..., Any])


def takes(kind: type[StageOptions]) -> Callable[[F], F]:
    """Let a function that takes ``**changes`` to one option class show each option in its signature.

    ``help()``, ``inspect``, notebooks and pages made from docstrings then name every keyword with type and default,
    and all of it still stands once, in the class. A ``TypedDict`` for ``Unpack`` would have to be written out, as
    checkers read no class that is made at run time, and ``help()`` would show its name alone.

    Examples
    --------
    >>> from femprep.options import FibreOptions
    >>> @takes(FibreOptions)
    ... def add(mesh, *, options=None, **changes): ...
    >>> list(inspect.signature(add).parameters)[:4]
    ['mesh', 'options', 'endo_angle', 'epi_angle']
    """

    def show(function: F) -> F:
        signature = inspect.signature(function)
        own = [each for each in signature.parameters.values() if each.kind is not inspect.Parameter.VAR_KEYWORD]
        named = {each.name for each in own}
        more = [
            inspect.Parameter(
                name,
                inspect.Parameter.KEYWORD_ONLY,
                default=field.get_default(call_default_factory=True),
                annotation=field.annotation,
            )
            for name, field in kind.model_fields.items()
            if name not in named
        ]
        function.__signature__ = signature.replace(parameters=[*own, *more])  # type: ignore[attr-defined]
        return function

    return show


def choose(kind: type[T], options: T | None, changes: dict[str, Any]) -> T:
    """Options of one stage: those given (or the defaults) with the changes made, all checked.

    Raises
    ------
    OptionError
        A name is unknown or a value out of range; one line naming the option, the value and what was expected. Or
        what was given are no options of this stage.
    """
    if options is not None and not isinstance(options, kind):
        raise OptionError(
            f"options are {quoted(options)}, expected {kind.__name__}(...); or give each option by its name, without "
            "'options'"
        )
    # Those given alone, so that what was left to the defaults can still be told from what was asked for.
    values = {name: getattr(options, name) for name in options.model_fields_set} if options is not None else {}
    try:
        return kind(**{**values, **changes})
    except ValidationError as error:
        raised = [item.get("ctx", {}).get("error") for item in error.errors()]
        advice = [one for own in raised for one in getattr(own, "advice", ())]
        raise OptionError(describe(error, kind), advice=advice) from None


def with_groups(options: T, **groups: dict[str, Any]) -> T:
    """Options with some of a group's changed, the others as given."""
    own = {name: getattr(options, name) for name in groups}
    return choose(type(options), options, {name: choose(type(own[name]), own[name], groups[name]) for name in groups})


def require_number(name: str, value: float, least: float, most: float = math.inf) -> None:
    """Refuse an argument that no class of options holds, where it lies outside its limits or is no finite number.

    Raises
    ------
    OptionError
    """
    if not least <= value <= most or math.isinf(value):
        limits = f"at least {least:g}" if math.isinf(most) else f"from {least:g} to {most:g}"
        raise OptionError(f"{name} is {quoted(value)}, expected a number {limits}")


def describe(error: ValidationError, kind: type[StageOptions] | None = None) -> str:
    """One line for what pydantic found: each option with its value and what it should be, or the name meant."""
    parts = []
    for item in error.errors():
        name = ".".join(str(part) for part in item["loc"])
        if item["type"] == "extra_forbidden":
            parts.append(f"unknown option {name!r}" + did_you_mean(nearest(name, kind)))
        elif item["type"] == "value_error" and not name:  # options that do not go together
            parts.append(str(item["ctx"]["error"].args[0]))
        else:
            parts.append(f"option {name!r} is {quoted(item['input'])}: {item['msg'][:1].lower()}{item['msg'][1:]}")
    return "; ".join(parts)


def nearest(name: str, kind: type[StageOptions] | None) -> list[str]:
    """Options, groups before them (``volume.edge_length``), whose name is that of an unknown one, or nearly."""
    group, _, last = name.rpartition(".")
    known: dict[str, list[str]] = {}
    for full in [] if kind is None else option_names(kind):
        known.setdefault(full.rpartition(".")[2], []).append(full)
    found = [full for close in get_close_matches(last, known, n=3, cutoff=0.75) for full in known[close]]
    same = [full for full in found if full.rpartition(".")[0] == group]
    return same[:1] or found[:2]


def option_names(kind: type[StageOptions], before: str = "") -> list[str]:
    """Names of all options of a group and of the groups in it."""
    found = []
    for name, field in kind.model_fields.items():
        found.append(before + name)
        # A group that may be left out is one of a union.
        for part in (field.annotation, *getattr(field.annotation, "__args__", ())):
            if isinstance(part, type) and issubclass(part, StageOptions):
                found += option_names(part, f"{before}{name}.")
    return found
