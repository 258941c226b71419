"""Command line options made from the fields of femprep.options, so that help, range and default stand once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Literal, get_args, get_origin

import typer

from femprep.options import StageOptions


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
    return typer.Option(
        *(names or (f"--{field.replace('_', '-')}",)),
        help=text,
        metavar=metavar or ("CHOICE" if choices else None),
        autocompletion=one_of(choices) if choices else None,
        rich_help_panel=panel,
    )


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
