"""Output folders as runs and their users leave them: small ones, for tests of how one replaces another."""

from __future__ import annotations

import json
from pathlib import Path

from femprep.report.folder.output_folder import MARKER, whole_folder
from femprep.report.manifest import hashes

#: Files of a run, by what they hold.
FIRST = {"mesh.vtu": "mesh one", "surfaces/lv.vtp": "lv one", "cavities/lv.vtp": "cavity one"}
SECOND = {"mesh.vtu": "mesh two", "surfaces/lv.vtp": "lv two", "mesh.inp": "deck two"}
#: What a user puts beside them: files, a subfolder, one within a folder of ours, and an empty one.
MINE = {"notes.txt": "mine", "sim/run1/result.frd": "result", "surfaces/own.vtp": "own", "cavities/seen.txt": "seen"}


def write(folder: Path, files: dict[str, str]) -> None:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def make(out: Path, files: dict[str, str]) -> None:
    """Make the output folder of a run that writes some files."""
    with whole_folder(out) as folder:
        write(folder, files)
        listed = sorted([*files, MARKER])
        (folder / MARKER).write_text(json.dumps({"files": listed, "sha256": hashes(folder, listed)}))


def held(folder: Path) -> dict[str, str]:
    """All files below a folder but its record, by what they hold."""
    return {
        path.relative_to(folder).as_posix(): path.read_text()
        for path in folder.rglob("*")
        if path.is_file() and path.name != MARKER
    }
