"""Command line options made from the fields of femprep.options, so that help, range and default stand once."""

from __future__ import annotations

from typing import Any, Literal, get_args, get_origin

import typer

from femprep.options import StageOptions


def option(group: type[StageOptions], field: str, *names: str, panel: str, default: str | None = None) -> Any:
    """A typer option for one field: its description as help, its default shown but not set.

    An option that is not given stays ``None``, so that it does not override a configuration file.
    """
    info = group.model_fields[field]
    shown = default
    if shown is None and info.default is not None:
        shown = f"{info.default:g}" if isinstance(info.default, float) else str(info.default)
    text = (info.description or "") + (f" [dim]\\[default: {shown}][/dim]" if shown else "")
    choices = [str(value) for value in get_args(info.annotation)] if get_origin(info.annotation) is Literal else []
    metavar = "|".join(choices) or None
    return typer.Option(
        *(names or (f"--{field.replace('_', '-')}",)), help=text, metavar=metavar, rich_help_panel=panel
    )


def given(**values: Any) -> dict[str, Any]:
    """The values that were given: an option that was not is ``None`` and leaves its default."""
    return {name: value for name, value in values.items() if value is not None}
