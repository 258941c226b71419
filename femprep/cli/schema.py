"""``femprep schema``: write the JSON Schemas of options, run manifest and quality report."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer


def schema_texts() -> dict[str, str]:
    """The JSON Schemas as text, by file name."""
    from pydantic import BaseModel

    from femprep.options import Options
    from femprep.report.manifest import RunManifest
    from femprep.volume import QualityReport

    kinds: dict[str, type[BaseModel]] = {
        "options.json": Options,
        "run.json": RunManifest,
        "quality.json": QualityReport,
    }
    return {
        name: json.dumps(
            {"$schema": "https://json-schema.org/draft/2020-12/schema", **kind.model_json_schema()}, indent=2
        )
        + "\n"
        for name, kind in kinds.items()
    }


def schema(
    folder: Annotated[Path, typer.Argument(help="Folder to write the schemas to.")] = Path("schemas"),
) -> None:
    """Write the JSON Schemas of the options, of run.json and of quality.json."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in schema_texts().items():
        (folder / name).write_text(text, encoding="utf-8")
        typer.echo(folder / name)
