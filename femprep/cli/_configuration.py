"""Options of a run from a TOML file, with what the command line says in their place."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from femprep.errors import FileError, OptionError
from femprep.options import Options, choose


def read_options(config: Path | None, **changes: Any) -> Options:
    """Options from a file (where given) and from the command line, which wins.

    Parameters
    ----------
    config : Path, optional
        TOML file with the names of :class:`femprep.options.Options`.
    changes : mapping
        Values by ``name`` or ``group__name``; ``None`` leaves what the file, or the default, says.

    Raises
    ------
    FileError
        The file is missing or not TOML.
    OptionError
        A name is unknown or a value out of range.
    """
    values = _read_toml(config) if config is not None else {}
    for key, value in changes.items():
        if value is None:
            continue
        group, _, name = key.rpartition("__")
        target = values
        if group:
            target = values.setdefault(group, {})
            if not isinstance(target, dict):
                raise OptionError(f"option {group!r} is {target!r}: expected a table [{group}] in {config}")
        if isinstance(value, dict):
            value = {**target.get(name, {}), **value}
        target[name] = value
    return choose(Options, None, values)


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as stream:
            return tomllib.load(stream)
    except OSError as error:
        raise FileError(f"configuration {str(path)!r} cannot be read: {error.strerror}; check --config") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise FileError(f"configuration {str(path)!r} is not valid TOML: {error}") from None


def parse_structures(items: Sequence[str] | None) -> dict[str, tuple[int, ...]] | None:
    """``["lv=3", "myo=2,4"]`` as label numbers by structure name."""
    if not items:
        return None
    found: dict[str, tuple[int, ...]] = {}
    for item in items:
        name, equals, labels = item.partition("=")
        try:
            numbers = tuple(int(label) for label in labels.split(","))
        except ValueError:
            numbers = ()
        if not (name.strip() and equals and numbers):
            raise OptionError(f"--structure {item!r} is not NAME=LABEL[,LABEL...]; write for example --structure lv=3")
        found[name.strip()] = numbers
    return found


#: Structures that are no ball-like object on their own: a wall is fitted together with its cavity.
WALLS = frozenset({"myo", "rv_wall", "la_wall", "ra_wall"})


def parse_valves(items: Sequence[str] | None) -> dict[str, tuple[float, ...]] | None:
    """Openings given as ``mitral=X,Y,Z,NX,NY,NZ,R``; None where there are none, so that a file's stand.

    Raises
    ------
    OptionError
        A text of another form, or a name given twice.
    """
    found: dict[str, tuple[float, ...]] = {}
    for item in items or ():
        name, equals, numbers = item.partition("=")
        try:
            values = tuple(float(number) for number in numbers.split(","))
        except ValueError:
            values = ()
        if not equals or len(values) != 7 or not all(map(math.isfinite, values)):
            raise OptionError(
                f"--valve {item!r} is not NAME=X,Y,Z,NX,NY,NZ,R; write for example --valve mitral=10,20,30,0,0,1,12"
            )
        if name in found:
            raise OptionError(f"--valve {name} is given twice; one plane per name")
        found[name] = values
    return found or None


def parse_objects(items: Sequence[str] | None, labels: dict[str, tuple[int, ...]]) -> dict[str, tuple[str, ...]]:
    """``["epi=lv+myo", "rv"]`` as structure names by object name; sensible objects where nothing is given."""
    found: dict[str, tuple[str, ...]] = {}
    if not items:
        found = {name: (name,) for name in labels if name not in WALLS}
        if {"lv", "myo"} <= set(labels):
            found["epi"] = ("lv", "myo")
        return _files(found)
    for item in items:
        name, equals, parts = item.partition("=")
        structures = tuple(part.strip() for part in (parts if equals else name).split("+"))
        unknown = [part for part in structures if part not in labels]
        if unknown or not name.strip():
            raise OptionError(
                f"--object {item!r} names the structure {(unknown or [''])[0]!r}, which is not among "
                f"{', '.join(labels) or 'those given'}; name it with --structure NAME=LABEL"
            )
        found[name.strip()] = structures
    return _files(found)


def _files(objects: dict[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
    """The same, if their names may be those of files: a configuration of somebody else's names no folder of yours."""
    for name in objects:
        if not re.fullmatch(r"\w[\w .+-]{0,99}", name):
            raise OptionError(
                f"{name!r} cannot be the name of an object, which is that of its file; use letters, digits, '_' and '-'"
            )
    return objects
