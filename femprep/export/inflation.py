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
        There is no ``base`` to hold, no endocardium to press on, or there are blood pools; a pressure is given for a
        cavity that is not there; or the material needs fibres that are not there.
    """
    if options.step == "none":
        return
    if content.blood:
        raise InputError("an inflation step is for a wall alone; this mesh has blood pools, and the deck one material")
    if "base" not in content.facets or not endocardium(content.facets):
        found = ", ".join(content.facets) or "none"
        raise InputError(f"an inflation step needs facets tagged base and endo; this mesh has {found}")
    cavities = [cavity_of(name) for name in endocardium(content.facets)]
    unknown = [name for name in options.pressure if name not in cavities] if isinstance(options.pressure, dict) else []
    if unknown:
        raise InputError(f"a pressure is given for {unknown[0]!r}; the cavities of this mesh are {', '.join(cavities)}")
    if options.material == "orthotropic" and not content.fibres:
        raise InputError("the orthotropic material needs fibres; add them (add_fibres, or --fibres) or choose linear")


def endocardium(names: Iterable[str]) -> list[str]:
    """Those of the names of facets that an inflation step presses on."""
    return [name for name in names if name == "endo" or name.startswith("endo_")]


def cavity_of(name: str) -> str:
    """The cavity inside an endocardium: ``rv`` of ``endo_rv``; of a mesh with a single one ``lv``."""
    return name.removeprefix("endo_") if name != "endo" else "lv"


def pressures(names: Iterable[str], options: ExportOptions) -> dict[str, float]:
    """Pressure on each endocardium among the names of facets, kPa, by its name."""
    given = options.pressure
    return {name: given.get(cavity_of(name), 0.0) if isinstance(given, dict) else given for name in endocardium(names)}
