"""``femprep schema``: the JSON Schemas of options, run manifest and quality report: where they lie, or written."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal

import typer

from femprep.errors import FileError, cannot_write

#: What a schema is known by, whatever folder it lies in.
_NAME = "urn:femprep:schema:"
#: Bytes at the beginning of a schema in which that stands.
_HEAD = 200


def schema_folder() -> Path:
    """Folder of the schemas: in the package where it was installed, beside it in a checkout."""
    package = Path(__file__).parents[1]
    for folder in (package / "schemas", package.parent / "schemas"):
        if folder.is_dir():
            return folder
    raise FileError(f"no folder of schemas in {str(package)!r}; write them anew: femprep schema FOLDER")


def schema_texts() -> dict[str, str]:
    """The JSON Schemas as text, by file name."""
    from pydantic import BaseModel

    from femprep.cohort.records import CohortRecord
    from femprep.image.contour_file import ContourFile
    from femprep.model.shared_records.transfer import TransferRecord
    from femprep.options import AnnotateOptions, Options
    from femprep.report.manifest import AnnotationManifest, RunManifest, SequenceManifest
    from femprep.volume import QualityReport

    # Options are read, the records are written: a schema describes what stands in the file.
    kinds: dict[str, tuple[type[BaseModel], Literal["validation", "serialization"]]] = {
        "options.json": (Options, "validation"),
        "contours.json": (ContourFile, "validation"),
        "annotate.json": (AnnotateOptions, "validation"),
        "annotation.json": (AnnotationManifest, "serialization"),
        "run.json": (RunManifest, "serialization"),
        "sequence.json": (SequenceManifest, "serialization"),
        "quality.json": (QualityReport, "serialization"),
        "cohort.json": (CohortRecord, "serialization"),
        "transfer.json": (TransferRecord, "serialization"),
    }
    head = "https://json-schema.org/draft/2020-12/schema"
    found = {}
    for name, (kind, mode) in kinds.items():
        schema = {"$schema": head, "$id": _NAME + name.removesuffix(".json"), **kind.model_json_schema(mode=mode)}
        for part in (schema, *schema.get("$defs", {}).values()):
            # What is described there is a file: examples in Python are none of it.
            if "description" in part:
                part["description"] = part["description"].partition("\n\nExamples\n")[0]
        found[name] = json.dumps(schema, indent=2) + "\n"
    return found


def schema(
    folder: Annotated[
        Path | None, typer.Argument(help="Folder to write the schemas to. [dim]\\[default: schemas][/dim]")
    ] = None,
    where: Annotated[
        bool, typer.Option("--where", help="Print the folder that the installed schemas are in; write nothing.")
    ] = False,
) -> None:
    """Where the JSON Schemas of options and records lie, for editors; or write them.

    options.json is that of a TOML file of options: with the line "#:schema FOLDER/options.json" at its top, editors
    offer names and mark what is out of range. run.json, sequence.json, quality.json, cohort.json and transfer.json are
    those of the records.
    """
    if where:
        typer.echo(schema_folder())
        return
    folder = folder or Path("schemas")
    texts = schema_texts()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _require_no_others(folder, texts)
        for name, text in texts.items():
            (folder / name).write_text(text, encoding="utf-8")
            typer.echo(folder / name)
    except OSError as error:
        raise cannot_write(f"folder {str(folder)!r}", error, "choose another") from None


def _require_no_others(folder: Path, names: Iterable[str]) -> None:
    """Refuse where a file that is no schema of ours would be replaced: the records of a run have the same names."""
    there = (folder / name for name in sorted(names) if (folder / name).exists())
    others = [path.name for path in there if _NAME.encode() not in path.read_bytes()[:_HEAD]]
    if others:
        raise FileError(
            f"folder {str(folder)!r} holds {', '.join(map(repr, others))}, no schema of femprep's: it would be "
            "replaced; write the schemas into a folder of their own"
        )
