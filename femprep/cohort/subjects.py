"""A folder of label maps, or a table that names them, in; the subjects of a cohort out, each with its options."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple

from femprep.errors import FileError, InputError, OptionError
from femprep.model.image_file import ImageFile, image_file
from femprep.options import Options, choose
from femprep.options.base import nearest, option_names

#: What is made of a subject: a mesh of each label map, one sequence of all its phases, or closed surfaces alone.
Kind = Literal["mesh", "sequence", "surfaces"]

#: Columns of a table that are no options.
_OWN: Final = ("subject", "image", "phase", "intensity_image")
#: What stands in a cell for nothing.
_NOTHING: Final = ("", "n/a")
#: Files and folders of the cohort itself, which no subject may be called.
RESERVED: Final = frozenset({"failures"})


@dataclass(frozen=True)
class Subject:
    """One heart of a cohort.

    Attributes
    ----------
    name : str
        Its folder below that of the cohort.
    images : tuple of Path
        Its label map, or those of its phases in order.
    options : Options
    kind : {"mesh", "sequence", "surfaces"}
    shown : tuple of ImageFile
        The images that the labels were drawn on, for the pages: as many as label maps, or none.

    Examples
    --------
    >>> from femprep.cohort import Subject
    >>> Subject("patient007", (Path("patient007_gt.nii.gz"),), fp.Options(preset="acdc")).kind
    'mesh'
    """

    name: str
    images: tuple[Path, ...]
    options: Options
    kind: Kind = "mesh"
    shown: tuple[ImageFile, ...] = ()


def read_subjects(
    source: Path, options: Options, *, pattern: str = "**/*.nii.gz", kind: Kind = "mesh"
) -> list[Subject]:
    """The subjects of a folder or a table, by name.

    Parameters
    ----------
    source : path
        A folder; or a table, ``.tsv``, with columns ``subject``, ``image`` (its label map, relative to the table),
        ``phase``, ``intensity_image`` (what it was drawn on, ``FILE`` or ``FILE:FRAME``, for the page), and any option
        by its name in a configuration file, as ``volume.edge_length``.
    options : Options
        Of all; columns of a table win.
    pattern : str
        Which files of a folder are label maps. Each is a subject; of a sequence, all in one folder are one.
    kind : {"mesh", "sequence", "surfaces"}

    Raises
    ------
    FileError
        Folder or table cannot be read, or an image is not there.
    OptionError
        A column is no option, or a value out of range: with its line.
    InputError
        There is no subject, or two would have one folder.
    """
    folder = source.is_dir()
    found = _of_folder(source, options, pattern, kind) if folder else _of_table(source, options, kind)
    if not found:
        where = f"no file matches {pattern!r} in" if folder else "no line with a subject in"
        raise InputError(f"{where} {str(source)!r}; check {'--pattern' if folder else 'the table'}")
    names = [subject.name.casefold() for subject in found]
    for subject in found:
        if not re.fullmatch(r"\w[\w .+-]{0,99}", subject.name) or subject.name.casefold() in RESERVED:
            raise InputError(
                f"{subject.name!r} cannot name a subject, which names a folder; use letters, digits, '_', '-'"
            )
        if names.count(subject.name.casefold()) > 1:
            raise InputError(f"two subjects are called {subject.name!r}; each needs a folder of its own")
    return sorted(found, key=lambda subject: subject.name)


def _of_folder(source: Path, options: Options, pattern: str, kind: Kind) -> list[Subject]:
    try:
        paths = sorted(path for path in source.glob(pattern) if path.is_file())
    except (ValueError, NotImplementedError) as error:
        raise OptionError(f"--pattern {pattern!r} is no pattern: {error}; write for example '**/*_gt.nii.gz'") from None
    if kind == "sequence":
        folders: dict[Path, list[Path]] = {}
        for path in paths:
            folders.setdefault(path.parent, []).append(path)
        return [
            Subject(_plain(folder.relative_to(source).parts or (source.resolve().name,)), tuple(own), options, kind)
            for folder, own in folders.items()
        ]
    stems = [_stem(path) for path in paths]
    if len({stem.casefold() for stem in stems}) < len(stems):  # then with the folders they lie in
        named = [_plain((*path.relative_to(source).parts[:-1], stem)) for path, stem in zip(paths, stems)]
    else:
        named = [_plain((stem,)) for stem in stems]
    return [Subject(name, (path,), options, kind) for name, path in zip(named, paths)]


def _stem(path: Path) -> str:
    return path.name.partition(".")[0] or path.name


def _plain(parts: Iterable[str]) -> str:
    """A name made of those of folders and files, with nothing in it that a folder may not be called."""
    return re.sub(r"[^\w.+-]+", "_", "_".join(parts)).lstrip(".+-")


class _Line(NamedTuple):
    """A line of a table: its number, and what stands in it."""

    number: int
    image: Path
    phase: str | None
    options: Options
    shown: ImageFile | None


def _of_table(source: Path, options: Options, kind: Kind) -> list[Subject]:
    rows: dict[str, list[_Line]] = {}
    for line, row in _rows(source):
        where = f"{source.name!r}, line {line}"
        values = {key: text.strip() for key, text in row.items() if (text or "").strip() not in _NOTHING}
        for needed in ("subject", "image"):
            if needed not in values:
                raise InputError(f"{where}: no {needed}; every line needs a subject and an image")
        image = source.parent / values["image"]
        under = values.get("intensity_image")
        shown = None if under is None else image_file(under, source.parent)
        for path in (image, *(() if shown is None else (shown.path,))):
            if not path.is_file():
                raise FileError(f"{where}: image {str(path)!r} is not there")
        try:
            own = choose(Options, options, _changes(options, values))
        except OptionError as error:
            raise OptionError(f"{where}: {error}") from None
        rows.setdefault(values["subject"], []).append(_Line(line, image, values.get("phase"), own, shown))
    found = []
    for name, lines in rows.items():
        if kind != "sequence":
            for one in lines:
                if len(lines) > 1 and one.phase is None:
                    raise InputError(
                        f"{source.name!r}, line {one.number}: {name!r} has {len(lines)} lines; tell them apart by the "
                        "column phase, or add --sequence"
                    )
                own_name = f"{name}_{one.phase}" if len(lines) > 1 else name
                found.append(Subject(own_name, (one.image,), one.options, kind, (one.shown,) if one.shown else ()))
            continue
        if any(one.options != lines[0].options for one in lines):
            raise OptionError(f"{source.name!r}: the phases of {name!r} have different options; one sequence has one")
        shown_of = tuple(one.shown for one in lines if one.shown)
        if shown_of and len(shown_of) < len(lines):
            raise InputError(
                f"{source.name!r}: {len(shown_of)} of the {len(lines)} phases of {name!r} have an intensity_image; "
                "give one for all, or for none"
            )
        found.append(Subject(name, tuple(one.image for one in lines), lines[0].options, kind, shown_of))
    return found


def _rows(source: Path) -> list[tuple[int, dict[str, str]]]:
    """Lines of a table with their numbers, by the names of its columns."""
    try:
        with source.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file, delimiter="\t", strict=True)
            columns = [name for name in reader.fieldnames or () if name]
            if not {"subject", "image"} <= set(columns):
                raise FileError(
                    f"table {str(source)!r} has columns {', '.join(columns) or 'none'}; needed are subject and image, "
                    "divided by tabs"
                )
            known = {*_OWN, *option_names(Options)}
            for name in columns:
                if name not in known and not name.startswith("structures."):
                    near = nearest(name, Options)
                    meant = f"; did you mean {' or '.join(map(repr, near))}?" if near else ""
                    raise OptionError(f"table {str(source)!r}: column {name!r} is no option{meant}")
            rows = []
            for row in reader:
                if row.get(None) or None in row.values():
                    raise FileError(f"{source.name!r}, line {reader.line_num}: it has not {len(columns)} cells")
                rows.append((reader.line_num, row))
            return rows
    except (FileError, OptionError):
        raise
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FileError(f"{str(source)!r} is no folder, and cannot be read as a table: {reason}") from None


def _changes(options: Options, values: Mapping[str, str]) -> dict[str, Any]:
    """What a line of a table changes of the options, group by group."""
    changes: dict[str, Any] = {}
    for name, text in values.items():
        if name in _OWN:
            continue
        group, _, last = name.partition(".")
        if not last:
            changes[group] = _value(text)
            continue
        before = getattr(options, group)
        if group == "structures":
            table = changes.setdefault(group, dict(before))
            table[last] = _labels(text)
        else:
            known = {} if before is None else {key: getattr(before, key) for key in before.model_fields_set}
            changes.setdefault(group, known)[last] = _value(text)
    return changes


def _labels(text: str) -> Any:
    """``"2,4"`` as label numbers."""
    try:
        return tuple(int(number) for number in text.split(","))
    except ValueError:
        return text


def _value(text: str) -> Any:
    """A cell as what it is in JSON, a number, true or a list; else as text."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):  # lists within lists, by the thousand
        return text
