"""What a mesh holds in, whether a deck can inflate it and what the pressure acts on out."""

from __future__ import annotations

from collections.abc import Iterable

from femprep.errors import InputError
from femprep.export.content import Content
from femprep.options import ExportOptions


def require(content: Content, options: ExportOptions) -> None:
    """Make sure that a mesh has what the step in its deck needs.

    Raises
    ------
    InputError
        There is no ``base`` to hold, no endocardium to press on, or there are blood pools; or the material needs fibres
        that are not there.
    """
    if options.step == "none":
        return
    if content.blood:
        raise InputError("an inflation step is for a wall alone; this mesh has blood pools, and the deck one material")
    if "base" not in content.facets or not endocardium(content.facets):
        found = ", ".join(content.facets) or "none"
        raise InputError(f"an inflation step needs facets tagged base and endo; this mesh has {found}")
    if options.material == "orthotropic" and not content.fibres:
        raise InputError("the orthotropic material needs fibres; add them (add_fibres, or --fibres) or choose linear")


def endocardium(names: Iterable[str]) -> list[str]:
    """Those of the names of facets that an inflation step presses on."""
    return [name for name in names if name == "endo" or name.startswith("endo_")]
