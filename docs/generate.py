"""What the pages say of options, commands, formats, tags and records, made from the code while the pages are built.

A hook of MkDocs: a line ``<!-- generated: NAME -->`` of a page is replaced by what the function of that name in
``PARTS`` gives, so that nothing of it is written twice. Links to ``examples/pictures`` are those of the
repository in the sources, and those of the site in its pages.
"""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, Final

PICTURES: Final = Path(__file__).resolve().parent.parent / "examples" / "pictures"
_MARK: Final = re.compile(r"^<!-- generated: ([\w-]+) -->$", re.MULTILINE)


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    head = tuple(head)
    lines = [head, ("---",) * len(head), *(tuple(cell.replace("|", r"\|") for cell in row) for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def formats() -> str:
    """The formats a mesh is written in."""
    from femprep.export.table import markdown_table

    return markdown_table()


def exit_statuses() -> str:
    """What each exit status means, and the errors that end in it."""
    from femprep import cli, errors

    words = cli.main.__doc__ or ""
    meanings = dict(re.findall(r"(\d+) ([^;.]+)", " ".join(words[words.index("0 done") :].split())))
    kinds = [kind for _, kind in inspect.getmembers(errors, inspect.isclass) if issubclass(kind, errors.FemprepError)]
    rows = []
    for status, meaning in meanings.items():
        mine = [kind for kind in kinds if str(kind.exit_status) == status and kind is not errors.FemprepError]
        told_by = "<br>".join(f"`{kind.__name__}`: {(kind.__doc__ or '').splitlines()[0]}" for kind in mine)
        rows.append((status, meaning, told_by or "-"))
    return _table(("exit status", "means", "errors of the library"), rows)


def tags() -> str:
    """Numbers of regions and facets."""
    from femprep.model import FACET_TAGS, REGION_TAGS

    tables = (("region", REGION_TAGS), ("facets", FACET_TAGS))
    return "\n".join(
        _table((f"{what}", "tag"), ((f"`{k}`", str(v)) for k, v in table.items())) for what, table in tables
    )


def presets() -> str:
    """Label numbers of known data sets."""
    from femprep.options import PRESETS

    return _table(
        ("preset", "structures"),
        (
            (f"`{name}`", ", ".join(f"{part}={'+'.join(map(str, labels))}" for part, labels in table.items()))
            for name, table in PRESETS.items()
        ),
    )


def qualities() -> str:
    """What each quality asks of fTetWild."""
    from femprep.options import QUALITY

    names = ("smallest dihedral angle, degrees", "mean of the mean ratio", "stop energy", "envelope, edge lengths")
    return _table(
        ("`--quality`", *names, "further runs", "improved afterwards below, degrees"),
        ((f"`{name}`", *(f"{value:g}" for value in target)) for name, target in QUALITY.items()),
    )


def limits() -> str:
    """Limits a mesh is judged by: the defaults, those of the sweep, those of each purpose."""
    from femprep.options import MESHER_LIMITS, PURPOSE_LIMITS, CheckOptions

    purposes = [name for name, values in PURPOSE_LIMITS.items() if values]
    columns: list[Mapping[str, Any]] = [MESHER_LIMITS["sweep"], *(PURPOSE_LIMITS[name] for name in purposes)]
    rows = []
    for name, field in CheckOptions.model_fields.items():
        if not name.startswith(("minimum_", "maximum_", "mean_", "plane_")):
            continue
        values = [field.default, *(column.get(name) for column in columns)]
        rows.append((f"`{name}`", field.description or "", *("" if v is None else f"{v:g}" for v in values)))
    return _table(("limit", "what", "default", "of the sweep", *(f"`{name}`" for name in purposes)), rows)


def options() -> str:
    """Every option, by group."""
    from femprep.options import AnnotateOptions, Options

    schema = Options.model_json_schema()
    own = {name: entry for name, entry in schema["properties"].items() if not _group(entry)}
    parts = ["## The run\n\n" + _table(_OPTION_HEAD, map(_option, own.items()))]
    for name, entry in schema["properties"].items():
        if group := _group(entry):
            found = schema["$defs"][group]
            words = inspect.cleandoc(found.get("description", "")).splitlines()[0]
            parts.append(
                f"## `[{name}]`\n\n{words}\n\n" + _table(_OPTION_HEAD, map(_option, found["properties"].items()))
            )
    named = AnnotateOptions.model_json_schema()["properties"]
    alone = {name: entry for name, entry in named.items() if not _group(entry)}
    words = "Of `femprep annotate`, beside the groups `check`, `fibres` and `export`, which are those above."
    parts.append(f"## Annotating a mesh\n\n{words}\n\n" + _table(_OPTION_HEAD, map(_option, alone.items())))
    return "\n".join(parts)


_OPTION_HEAD: Final = ("option", "default", "takes", "what")


def _group(entry: Mapping[str, Any]) -> str | None:
    kinds = [entry, *entry.get("anyOf", ())]
    return next((kind["$ref"].rpartition("/")[2] for kind in kinds if "$ref" in kind), None)


def _option(item: tuple[str, Mapping[str, Any]]) -> tuple[str, str, str, str]:
    name, entry = item
    default = entry.get("default")
    shown = "" if default in (None, {}, []) else f"`{json.dumps(default)}`"
    return f"`{name}`", shown, _takes(entry), entry.get("description", "")


_BOUNDS: Final = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}


def _takes(entry: Mapping[str, Any]) -> str:
    kinds = [kind for kind in entry.get("anyOf", [entry]) if kind.get("type") != "null"]
    said = []
    for kind in kinds:
        if "enum" in kind:
            said.append(" or ".join(f"`{value}`" for value in kind["enum"]))
        elif "const" in kind:
            said.append(f"`{kind['const']}`")
        else:
            bounds = " and ".join(f"{sign} {kind[key]:g}" for key, sign in _BOUNDS.items() if key in kind)
            said.append(f"{_KINDS.get(kind.get('type', ''), kind.get('type', ''))} {bounds}".strip())
    return " or ".join(said)


_KINDS: Final = {
    "number": "number",
    "integer": "whole number",
    "boolean": "true or false",
    "string": "text",
    "array": "list",
    "object": "table",
}


def commands() -> str:
    """Every command with its arguments and options."""
    from femprep.cli._app import COMMANDS, load

    parts = []
    for name in COMMANDS:
        command = load(name)
        arguments = [param for param in command.params if param.param_type_name == "argument"]
        usage = " ".join(
            [
                f"femprep {name}",
                *(a.metavar or a.name.upper() if a.required else f"[{a.name.upper()}]" for a in arguments),
            ]
        )
        text = inspect.cleandoc(command.help or "")
        rows = [(", ".join(f"`{flag}`" for flag in _flags(param)), _said(param)) for param in command.params]
        parts.append(f"## femprep {name}\n\n`{usage} [OPTIONS]`\n\n{text}\n\n" + _table(("", "what"), rows))
    return "\n".join(parts)


def _flags(param: Any) -> list[str]:
    if param.param_type_name == "argument":
        return [param.metavar or param.name.upper()]
    return [*param.opts, *param.secondary_opts]


def _said(param: Any) -> str:
    text = re.sub(r"\[/?dim\]", "", param.help or "").replace(r"\[", "[").replace("<", "&lt;")
    text = re.sub(r"\[(default: [^\]]*)\]", r"(\1)", text)
    choices = (param.metavar or "").split("|") if "|" in (param.metavar or "") else []
    return f"{text} Takes {', '.join(f'`{choice}`' for choice in choices)}." if choices else text


def record_run() -> str:
    """What stands in run.json."""
    return _record("run.json")


def record_quality() -> str:
    """What stands in quality.json."""
    return _record("quality.json")


def record_cohort() -> str:
    """What stands in cohort.json, and in a row of it."""
    from femprep.cohort.records import SubjectRecord

    rows = ((f"`{name}`", field.description or "") for name, field in SubjectRecord.model_fields.items())
    return _record("cohort.json") + "\n" + _table(("of a subject", "what"), rows)


def reasons() -> str:
    """Every way a subject of a cohort can end, by code."""
    from femprep.cohort.reasons import REASONS

    rows = ((f"`{one.code}`", one.status, one.what, one.remedy) for one in REASONS)
    return _table(("reason", "status", "what", "what to do"), rows)


def record_sequence() -> str:
    """What stands in run.json of a sequence."""
    return _record("sequence.json")


def _record(name: str) -> str:
    from femprep.cli.schema import schema_texts

    schema = json.loads(schema_texts()[name])
    rows = []
    for field, entry in schema["properties"].items():
        inner, more = entry.get("items", entry), entry.get("additionalProperties")
        below = _group(inner) or (isinstance(more, dict) and _group(more))
        words = entry.get("description", "")
        if below:
            found = schema["$defs"][below]
            words = words or inspect.cleandoc(found.get("description", "")).splitlines()[0]
            words += " Holds " + ", ".join(f"`{key}`" for key in found["properties"]) + "."
        rows.append((f"`{field}`", words.strip()))
    return _table((f"`{name}`" if name != "sequence.json" else "`run.json` of a sequence", "what"), rows)


def _docstring(module: str) -> str:
    """What the docstring of a module says after its first paragraph; drawings as they stand there, tables as tables."""
    text = inspect.getdoc(import_module(module)) or ""
    parts: list[str] = []
    for block in text.partition("\n\n")[2].split("\n\n"):
        lines = block.splitlines()
        if lines[0].startswith("==="):
            at = lines[0].index(" =")
            parts.append(_table(("", ""), ((f"`{line[:at].strip()}`", line[at:].strip()) for line in lines[1:-1])))
        elif not lines[0].startswith(" "):
            parts.append(_prose(block))
        elif parts and parts[-1].endswith("```"):
            parts[-1] = f"{parts[-1][:-3]}\n{block}\n```"
        else:
            parts.append(f"```text\n{block}\n```")
    return "\n\n".join(parts) + "\n"


def _prose(text: str) -> str:
    """A paragraph of a docstring without what only Sphinx reads."""
    return re.sub(r":\w+:(?=`)", "", text).replace("``", "`").removesuffix("::") + (":" if text.endswith("::") else "")


def coordinates() -> str:
    """Ventricular coordinates."""
    return _docstring("femprep.anatomy.coordinates")


def segments() -> str:
    """How AHA segments are numbered."""
    return _docstring("femprep.anatomy.aha")


def signs() -> str:
    """The signs of fibre angles, drawn."""
    return _docstring("femprep.anatomy.fibres")


def api() -> str:
    """Every public function and class from its docstring, by room; nouns, options and errors last."""
    import femprep

    rooms: dict[str, list[str]] = {}
    for name in femprep.__all__:
        found = getattr(femprep, name)
        if callable(found):
            room = found.__module__.split(".")[1]
            rooms.setdefault(room, []).append(f"::: {found.__module__}.{found.__qualname__}\n")
    last = [room for room in ("model", "options", "errors") if room in rooms]
    ordered = [*(room for room in rooms if room not in last), *last]
    return "\n".join(f"## {room}\n\n" + "\n".join(rooms[room]) for room in ordered)


#: What a page may ask for.
PARTS: Final[Mapping[str, Callable[[], str]]] = {
    "formats": formats,
    "exit-statuses": exit_statuses,
    "tags": tags,
    "presets": presets,
    "qualities": qualities,
    "limits": limits,
    "options": options,
    "commands": commands,
    "record-run": record_run,
    "record-quality": record_quality,
    "record-sequence": record_sequence,
    "record-cohort": record_cohort,
    "reasons": reasons,
    "coordinates": coordinates,
    "segments": segments,
    "signs": signs,
    "api": api,
}


def fill(text: str) -> str:
    """A page with all that it asks for in its place.

    Raises
    ------
    KeyError
        It asks for something that is not made here.
    """
    return _MARK.sub(lambda mark: PARTS[mark[1]](), text)


def on_files(files: Any, config: Any) -> Any:
    """MkDocs asks which files there are: pictures of the examples are pictures of the pages."""
    from mkdocs.structure.files import File

    for path in sorted(PICTURES.glob("*.png")):
        files.append(File.generated(config, f"pictures/{path.name}", abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """MkDocs hands over the text of a page."""
    text = fill(markdown)
    return re.sub(r"\(((?:\.\./)*)\.\./examples/pictures/", r"(\1pictures/", text)


def on_page_content(html: str, page: Any, config: Any, files: Any) -> str:
    """MkDocs hands over a page as HTML: roles and footnotes of docstrings are shown as plain text."""
    html = re.sub(r":(?:func|class|mod|meth|data|attr):(?=<code>)", "", html)
    html = re.sub(r"<code>~[\w.]*\.(?=\w+</code>)", "<code>", html)
    return re.sub(r"\.\. \[(\d+)\]|\[(\d+)\]_", r"[\1\2]", html)
