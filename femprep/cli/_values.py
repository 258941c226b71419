"""What a help calls the value of an option: ``PATH``, ``TEXT``, ``N`` or ``NUMBER``, not a type of Python."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, Literal, get_args, get_origin

from typer.core import TyperArgument, TyperCommand

_WORDS: Final = {bool: "", int: "N", float: "NUMBER", Path: "PATH", str: "TEXT"}


class PlainCommand(TyperCommand):
    """A command whose parameters without a word for their value get one by their types."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Parameters of the command's function and of every command, as ``--help``."""
        params = super().get_params(ctx)
        words = {"help": "", **(values_of(self.callback) if self.callback else {})}
        for each in params:
            if each.metavar is None:
                each.metavar = each.name.upper() if isinstance(each, TyperArgument) else words.get(each.name)
        return params


def values_of(function: Callable[..., Any]) -> dict[str, str | None]:
    """A word for the value of each parameter of a function; "" for switches, none where choices are shown."""
    parameters = inspect.signature(function, eval_str=True).parameters.values()
    return {each.name: _value_of(each.annotation) for each in parameters}


def _value_of(annotation: Any) -> str | None:
    inner = [each for each in get_args(annotation) if each is not type(None)]
    if get_origin(annotation) is Literal or not inner:
        return _WORDS.get(annotation)
    return _value_of(inner[0])
