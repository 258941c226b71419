"""A filled folder, and what is told of it, in; its record ``run.json``, with stages and hashes of all files, out."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import TypeVar

from femprep.report.folder.earlier import MARKER
from femprep.report.manifest import AnnotationManifest, RunManifest, SequenceManifest, StageRecord, hashes

Manifest = TypeVar("Manifest", RunManifest, AnnotationManifest, SequenceManifest)


def files_with(folder: Path, *more: str) -> list[str]:
    """Names of all files of a folder, of its record, and of those that are still to come."""
    found = {str(file.relative_to(folder)) for file in folder.rglob("*") if file.is_file()}
    return sorted(found | {MARKER, *more})


def stage_records(seconds: Mapping[str, float]) -> list[StageRecord]:
    """Stages as a record has them."""
    return [StageRecord(name=name, seconds=round(value, 3)) for name, value in seconds.items()]


def write_record(manifest: Manifest, folder: Path, seconds: Mapping[str, float], start: float) -> Manifest:
    """Write the record; the stage ``write``, which began at ``start``, ends with the hashes of all files."""
    sha256 = hashes(folder, manifest.files)
    stages = stage_records({**seconds, "write": time.perf_counter() - start})
    manifest = manifest.model_copy(update={"sha256": sha256, "stages": stages})
    (folder / MARKER).write_text(manifest.model_dump_json(indent=2) + "\n", encoding="utf-8")
    return manifest
