"""A subject and its folder in, whether that is what is asked for out: same input, options and version."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from femprep import __version__
from femprep.cohort.subjects import Subject
from femprep.options import Options, choose
from femprep.options.volume import VolumeOptions
from femprep.report.manifest import file_sha256


def asked(subject: Subject) -> Options:
    """Options as the record of a run holds them: a sequence is swept, whatever the mesher."""
    if subject.kind != "sequence":
        return subject.options
    volume = choose(VolumeOptions, subject.options.volume, {"mesher": "sweep"})
    return choose(Options, subject.options, {"volume": volume})


def is_done(subject: Subject, folder: Path) -> bool:
    """Whether a folder holds a whole run of just this input, with these options, by this version.

    A folder is whole or not there; that nobody took files away since is looked at, what stands in them is not.
    """
    try:
        record = json.loads((folder / "run.json").read_bytes())
        return (
            record["femprep"] == __version__
            and record["options"] == asked(subject).model_dump(mode="json")
            and _hashes(record) == [file_sha256(image) for image in subject.images]
            and _kind(record) == subject.kind
            and (
                subject.kind == "surfaces"
                or _shown(record) == [(file_sha256(one.path), one.frame) for one in subject.shown]
            )
            and all((folder / name).is_file() for name in record["files"])
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return False


def _hashes(record: dict[str, Any]) -> list[str]:
    return [phase["sha256"] for phase in record["phases"]] if "phases" in record else [record["input"]["sha256"]]


def _shown(record: dict[str, Any]) -> list[tuple[str, int | None]]:
    """Hash and frame of the images that its pages show."""
    found = [own.get("image") for own in record.get("phases", [record])]
    return [(one["sha256"], one["frame"]) for one in found if one]


def _kind(record: dict[str, Any]) -> str:
    if "phases" in record:
        return "sequence"
    return "mesh" if "mesh.vtu" in record["files"] else "surfaces"
