"""``femprep schema``: write the JSON Schemas of options, run manifest and quality report."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Literal

import typer


def schema_texts() -> dict[str, str]:
    """The JSON Schemas as text, by file name."""
    from pydantic import BaseModel

    from femprep.options import Options
    from femprep.report.manifest import RunManifest, SequenceManifest
    from femprep.volume import QualityReport

    # Options are read, the records are written: a schema describes what stands in the file.
    kinds: dict[str, tuple[type[BaseModel], Literal["validation", "serialization"]]] = {
        "options.json": (Options, "validation"),
        "run.json": (RunManifest, "serialization"),
        "sequence.json": (SequenceManifest, "serialization"),
        "quality.json": (QualityReport, "serialization"),
    }
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return {
        name: json.dumps({**head, **kind.model_json_schema(mode=mode)}, indent=2) + "\n"
        for name, (kind, mode) in kinds.items()
    }


def schema(
    folder: Annotated[Path, typer.Argument(help="Folder to write the schemas to.")] = Path("schemas"),
) -> None:
    """Write the JSON Schemas of the options, of run.json (of a run and of a sequence) and of quality.json."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in schema_texts().items():
        (folder / name).write_text(text, encoding="utf-8")
        typer.echo(folder / name)
