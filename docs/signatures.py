"""Signatures of the pages as ``help()`` has them: each option that ``**changes`` stands for by name, type and default.

Griffe reads the source without running it, and so without what :func:`femprep.options.base.takes` tells.
"""

from __future__ import annotations

import inspect
import re
from importlib import import_module
from operator import attrgetter
from typing import Any

import griffe


class Signatures(griffe.Extension):
    """Puts the options in place of ``**changes``."""

    def on_function(self, *, func: griffe.Function, **_: Any) -> None:
        """A function was read."""
        if not any(re.match(r"takes\(", str(each.value)) for each in func.decorators):
            return
        where = func.path.removeprefix(f"{func.module.path}.")
        shown = inspect.signature(attrgetter(where)(import_module(func.module.path)))
        own = [each for each in func.parameters if each.kind is not griffe.ParameterKind.var_keyword]
        named = {each.name for each in own}
        more = [
            griffe.Parameter(
                each.name,
                annotation=inspect.formatannotation(each.annotation).replace("typing.", ""),
                kind=griffe.ParameterKind.keyword_only,
                default=_said(each.default),
            )
            for each in shown.parameters.values()
            if each.name not in named
        ]
        func.parameters = griffe.Parameters(*own, *more)


def _said(default: Any) -> str:
    return f"{type(default).__name__}()" if hasattr(default, "model_fields_set") else repr(default)
