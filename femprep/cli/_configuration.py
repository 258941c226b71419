"""Options of a run from a TOML file, with what the command line says in their place."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
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
    return choose(Options, None, merged(config, **changes))


def merged(config: Path | None, **changes: Any) -> dict[str, Any]:
    """Values from a file with those of the command line in their place, by ``name`` or ``group__name``."""
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
    return values


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))  # with the mark that Windows puts in front
    except OSError as error:
        raise FileError(f"configuration {str(path)!r} cannot be read: {error.strerror}; check --config") from None
    except ValueError as error:  # of the grammar, of bytes that are no text, of numbers of thousands of digits
        raise FileError(f"configuration {str(path)!r} is not valid TOML: {error}") from None
    except RecursionError:  # tables within tables, by the thousand
        raise FileError(f"configuration {str(path)!r} is not valid TOML: it is nested too deeply") from None


@dataclass(frozen=True)
class _Form:
    """How an option is written: its name, the form of its value, and an example."""

    option: str
    form: str
    example: str

    def pairs(self, items: Sequence[str] | None) -> Iterator[tuple[str, str, str]]:
        """Name, value and text of each item."""
        for item in items or ():
            name, _, value = (part.strip() for part in item.partition("="))
            if not (name and value):
                raise self.wrong(item)
            yield name, value, item

    def wrong(self, item: str) -> OptionError:
        """What is said of a text of another form."""
        return OptionError(f"--{self.option} {item!r} is not {self.form}; write for example {self.example}")

    def numbers(self, text: str, count: int, item: str | None = None) -> tuple[float, ...]:
        """So many finite numbers between commas, in a text or in an item that holds it."""
        try:
            values = tuple(float(number) for number in text.split(","))
        except ValueError:
            values = ()
        if len(values) != count or not all(map(math.isfinite, values)):
            raise self.wrong(item or text)
        return values


def parse_structures(items: Sequence[str] | None) -> dict[str, tuple[int | str, ...]] | None:
    """``["lv=3", "myo=2,4", "rv=RV blood"]`` as label numbers, or names of segments, by structure name."""
    way = _Form("structure", "NAME=LABEL[,LABEL...]", "--structure lv=3")
    found: dict[str, tuple[int | str, ...]] = {}
    for name, labels, item in way.pairs(items):
        found[name] = tuple(_number_or_name(label.strip()) for label in labels.split(","))
        if "" in found[name]:
            raise way.wrong(item)
    return found or None


def _number_or_name(text: str) -> int | str:
    return int(text) if re.fullmatch(r"[+-]?\d+", text) else text


def parse_masks(items: Sequence[str] | None) -> dict[str, list[Path]]:
    """``["lv=heart_ventricle_left.nii.gz"]`` as files by structure name; a name given again adds a file.

    Raises
    ------
    OptionError
        A text of another form.
    """
    found: dict[str, list[Path]] = {}
    for name, file, _ in _Form("mask", "NAME=FILE", "--mask lv=left_ventricle.nii.gz").pairs(items):
        found.setdefault(name, []).append(Path(file))
    return found


def split_tissues(items: Sequence[Path]) -> tuple[list[Path], dict[str, tuple[int | str, ...]]]:
    """Files, and what reads ``scar=1`` and is no file: labels by tissue."""
    tissues = [str(item) for item in items if re.fullmatch(r"[A-Za-z_]+=[^/\\\\]+", str(item)) and not item.exists()]
    files = [item for item in items if str(item) not in tissues]
    return files, parse_structures(tissues) or {}


def parse_samples(items: Sequence[str] | None) -> dict[str, Path]:
    """``["t1.nii.gz", "late=lge.nii.gz"]`` as files by the name of their field.

    Raises
    ------
    OptionError
        Two fields have one name, or a file's name is none for a field.
    """
    found: dict[str, Path] = {}
    for item in items or ():
        name, equals, file = item.partition("=")
        if not equals:
            name, file = Path(item).name.partition(".")[0], item
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or not file:
            raise OptionError(f"--sample {item!r} names no field; write NAME=FILE, as in --sample t1=map.nii.gz")
        if name in found:
            raise OptionError(f"--sample gives two images the name {name!r}; write NAME=FILE")
        found[name] = Path(file)
    return found


def parse_surfaces(items: Sequence[str] | None) -> dict[str, Path]:
    """``["lv=endo.stl", "epi=epi.stl"]`` as files by name; files without names by their numbers.

    Raises
    ------
    OptionError
        A text of another form, or a name given twice.
    """
    found: dict[str, Path] = {}
    unnamed = [item for item in items or () if "=" not in item or Path(item).exists()]
    if unnamed and len(unnamed) < len(items or ()):
        raise OptionError(f"--surface {unnamed[0]} has no name and others have one; name all of them or none")
    if unnamed:
        return {str(number): Path(item) for number, item in enumerate(unnamed, 1)}
    for name, file, _ in _Form("surface", "NAME=FILE", "--surface lv=endo.stl").pairs(items):
        if name in found:
            raise OptionError(f"--surface {name} is given twice; one file per name")
        found[name] = Path(file)
    return found


def parse_valves(items: Sequence[str] | None) -> dict[str, tuple[float, ...]] | None:
    """Openings given as ``mitral=X,Y,Z,NX,NY,NZ,R``; None where there are none, so that a file's stand.

    Raises
    ------
    OptionError
        A text of another form, or a name given twice.
    """
    way = _Form("valve", "NAME=X,Y,Z,NX,NY,NZ,R", "--valve mitral=10,20,30,0,0,1,12")
    return _numbers_by_name(way, items, 7) or None


def parse_places(items: Sequence[str] | None) -> dict[str, tuple[float, ...]] | None:
    """Places given as ``endo_lv=X,Y,Z``; None where there are none, so that a file's stand.

    Raises
    ------
    OptionError
        A text of another form, or a name given twice.
    """
    return _numbers_by_name(_Form("at", "NAME=X,Y,Z", "--at endo_lv=10,20,30"), items, 3) or None


def _numbers_by_name(way: _Form, items: Sequence[str] | None, count: int) -> dict[str, tuple[float, ...]]:
    """So many finite numbers by name."""
    found: dict[str, tuple[float, ...]] = {}
    for name, numbers, item in way.pairs(items):
        values = way.numbers(numbers, count, item)
        if name in found:
            raise OptionError(f"--{way.option} {name} is given twice; one for each name")
        found[name] = values
    return found


def parse_names(items: Sequence[str] | None) -> dict[str, str] | None:
    """Names given as ``4=epi``; None where there are none.

    Raises
    ------
    OptionError
        A text of another form.
    """
    return {theirs: ours for theirs, ours, _ in _Form("name", "THEIRS=OURS", "--name 4=epi").pairs(items)} or None


def parse_pressure(items: Sequence[str] | None) -> float | dict[str, float] | None:
    """A pressure given as ``1.5``, or one for each cavity as ``lv=1.5``; None where there is none.

    Raises
    ------
    OptionError
        A text of another form, or a cavity given twice.
    """
    way = _Form("pressure", "a number of kPa, or CAVITY=KPA for each cavity", "--pressure lv=1.5 --pressure rv=0.5")
    if not items or (len(items) == 1 and "=" not in items[0]):
        return way.numbers(items[0], 1)[0] if items else None
    return {name: number for name, (number,) in _numbers_by_name(way, items, 1).items()}


def parse_point(text: str, name: str) -> tuple[float, float, float]:
    """A point given as ``X,Y,Z``.

    Raises
    ------
    OptionError
        The text has another form.
    """
    x, y, z = _Form(name.replace("_", "-"), "X,Y,Z", "10.5,-20,31").numbers(text, 3)
    return x, y, z


def parse_plane(text: str | None, *words: str) -> tuple[float, ...] | str | None:
    """A plane given as ``X,Y,Z,NX,NY,NZ`` or by one of some words.

    Raises
    ------
    OptionError
        The text has another form.
    """
    if text is None or text in words:
        return text
    return _Form("base", " or ".join(["X,Y,Z,NX,NY,NZ", *words]), "--base 10,20,30,0,0,1").numbers(text, 6)


def parse_objects(items: Sequence[str] | None, labels: Mapping[str, Sequence[int | str]]) -> dict[str, tuple[str, ...]]:
    """``["epi=lv+myo", "rv"]`` as structure names by object name; sensible objects where nothing is given."""
    found: dict[str, tuple[str, ...]] = {}
    if not items:
        return _files(Options(structures=labels).objects)
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
