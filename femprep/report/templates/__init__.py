"""The pages' templates and what is inlined into them: a page is one file, which opens from a disk with no network."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("femprep.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["figure"] = figure
    environment.globals["asset"] = asset
    return environment


def render(template: str, **content: Any) -> str:
    """A page.

    Parameters
    ----------
    template : str
        File name below ``templates/``.
    **content
        What it names; text is escaped unless it is Markup.
    """
    return str(_environment().get_template(template).render(**content))


def asset(name: str) -> Markup:
    """A script or style sheet of the package, as it is."""
    return Markup((files("femprep.report") / "assets" / name).read_text(encoding="utf-8"))


def figure(value: Any, digits: int = 3) -> str:
    """A number with as many digits as mean something; a whole number whole; nothing as a dash."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return f"{value:.{digits}g}" if abs(value) < 10.0**digits else f"{value:.0f}"
    return str(value)
