"""Command line options made from the fields of femprep.options, so that help, range and default stand once."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

import typer

from femprep.options import Options, StageOptions

F = TypeVar("F", bound=Callable[..., Any])
#: Names on the command line by those of fields without their groups; of the command that is run, others are not loaded.
_ON_THE_LINE: dict[str, str] = {}


def option(
    group: type[StageOptions],
    field: str,
    *names: str,
    panel: str,
    default: str | None = None,
    metavar: str | None = None,
) -> Any:
    """A typer option for one field: its description as help, its default shown but not set.

    An option that is not given stays ``None``, so that it does not override a configuration file.
    """
    info = group.model_fields[field]
    shown = default
    if shown is None and info.default is not None and info.default is not False:
        shown = f"{info.default:g}" if isinstance(info.default, float) else str(info.default)
    choices = _choices(info.annotation)
    # Choices stand in the help: beside the name they leave no room for either at 80 columns.
    notes = "; ".join(filter(None, [", ".join(choices), f"default: {shown}" if shown else ""]))
    text = (info.description or "") + (f" [dim]\\[{notes}][/dim]" if notes else "")
    names = names or (f"--{field.replace('_', '-')}",)
    _ON_THE_LINE[field] = names[0]
    made = typer.Option(
        *names,
        help=text,
        metavar=metavar or ("CHOICE" if choices else None),
        autocompletion=one_of(choices) if choices else None,
        rich_help_panel=panel,
    )
    made.path = f"{_place(group)}{field}"
    return made


def as_given(words: str, arguments: Iterable[str]) -> str:
    """What is said of options, with those that the command line holds named as they are there; others are a file's."""
    there = {argument.partition("=")[0] for argument in arguments}

    def name(found: re.Match[str]) -> str:
        option = _ON_THE_LINE.get(found[1].rpartition(".")[2])
        return f"option {option}" if option in there else found[0]

    return re.sub(r"option '([\w.]+)'", name, words)


def _place(group: type[StageOptions]) -> str:
    """Where the options of a run hold a group, as ``volume__``."""
    fields = Options.model_fields.items()
    return next((f"{name}__" for name, info in fields if group in (info.annotation, *get_args(info.annotation))), "")


def by_path(command: Callable[..., Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Values of a command's arguments that are options of a run, by ``name`` or ``group__name``."""
    hints = get_type_hints(command, include_extras=True).items()
    notes = [(name, note) for name, hint in hints for note in getattr(hint, "__metadata__", ())]
    return {note.path: values[name] for name, note in notes if hasattr(note, "path")}


def _choices(annotation: Any) -> list[str]:
    """Words or numbers a field may be; none where it is free."""
    return [str(value) for value in get_args(annotation)] if get_origin(annotation) is Literal else []


def one_of(choices: Iterable[str]) -> Callable[[str], list[str]]:
    """What the shell offers for the value of an option."""
    known = list(choices)

    def complete(incomplete: str) -> list[str]:
        return [choice for choice in known if choice.startswith(incomplete)]

    return complete


def given(group: type[StageOptions], values: Mapping[str, Any]) -> dict[str, Any]:
    """The options of a group among a command's arguments that were given: others are ``None`` and leave the default."""
    return {name: values[name] for name in group.model_fields if values.get(name) is not None}


def takes_options_of(other: Callable[..., Any]) -> Callable[[F], F]:
    """Let a command that takes ``**given`` show the keywords of another function as options of its own."""

    def show(command: F) -> F:
        signature = inspect.signature(command, eval_str=True)
        own = [each for each in signature.parameters.values() if each.kind is not inspect.Parameter.VAR_KEYWORD]
        needed = [each for each in own if each.default is inspect.Parameter.empty]
        more = inspect.signature(other, eval_str=True).parameters.values()
        rest = [each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in own if each not in needed]
        command.__signature__ = signature.replace(parameters=[*needed, *more, *rest])  # type: ignore[attr-defined]
        return command

    return show
