"""Paths that no random choice comes to, each by name: folders, loops, devices, files in the way."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from fuzz.common import SWEEP, Made, mesh, without_base, write
from fuzz.sources import Sources

Odd = Callable[[Sources, Path], Made]


def plain_map(sources: Sources, folder: Path, whole: bool = False) -> Path:
    """The phantom's map, most often the one that is refused when all else was read."""
    seg, path = sources.maps["lv"], folder / "map.nii.gz"
    write(path, np.array(seg.labels) if whole else without_base(seg), seg.grid.spacing)
    return path


def with_words(*words: str) -> Odd:
    """Further words of the main job."""

    def made(sources: Sources, folder: Path) -> Made:
        return Made("", mesh(plain_map(sources, folder), "lv", *SWEEP, *words), "out")

    return made


def _input(make: Callable[[Path], str]) -> Odd:
    """A label map that is something else."""

    def made(sources: Sources, folder: Path) -> Made:
        return Made("", mesh(Path(make(folder)), "lv", *SWEEP), "out")

    return made


def _folder(folder: Path, *files: str) -> str:
    place = folder / "in.nii"
    place.mkdir()
    for name in files:
        (place / name).write_bytes(b"\0" * 300)
    return str(place)


def _loop(folder: Path) -> str:
    (folder / "a.nii").symlink_to(folder / "b.nii")
    (folder / "b.nii").symlink_to(folder / "a.nii")
    return str(folder / "a.nii")


def _broken(folder: Path) -> str:
    (folder / "a.nii").symlink_to(folder / "none.nii")
    return str(folder / "a.nii")


def _output(make: Callable[[Path], str], whole: bool = True) -> Odd:
    """An output that is something else."""

    def made(sources: Sources, folder: Path) -> Made:
        out = make(folder)
        words = ["mesh", str(plain_map(sources, folder, whole)), "-o", out, "--preset", "acdc", *SWEEP]
        return Made("", words, "" if os.path.isabs(out) else out, whole)

    return made


def _below(sources: Sources, folder: Path) -> Made:
    return Made("", [*mesh(plain_map(sources, folder), "lv", *SWEEP), "-o", "a/b/c/d/e/out"], "a")


def _file(folder: Path) -> str:
    (folder / "kept").write_text("mine")
    return "kept"


def _full(folder: Path) -> str:
    (folder / "kept").mkdir()
    (folder / "kept" / "mine.txt").write_text("mine")
    (folder / "kept" / "mesh.vtu").mkdir()
    (folder / "kept" / "mesh.vtu" / "mine.txt").write_text("mine")
    return "kept"


def _linked(folder: Path) -> str:
    (folder / "kept").symlink_to(folder / "none")
    return "kept"


def _itself(command: str, *more: str) -> Odd:
    """A mesh written over itself."""

    def made(sources: Sources, folder: Path) -> Made:
        path = folder / "out.vtu"
        path.write_bytes(sources.hearts[0].read_bytes())
        words = {"transfer": [str(path), str(path), "-o"], "convert": [str(path)]}.get(command, [str(path), "-o"])
        return Made("", [command, *words, str(path), "-q", *more])

    return made


def _onto(target: str, *words: str) -> Odd:
    """A mesh converted to something that is no file to write."""

    def made(sources: Sources, folder: Path) -> Made:
        (folder / "out.vtu").mkdir()
        return Made("", ["convert", str(sources.hearts[0]), target, "-q", *words])

    return made


def _piped(command: str, target: str) -> Odd:
    """A mesh written to where a pipe is."""

    def made(sources: Sources, folder: Path) -> Made:
        os.mkfifo(folder / target)
        return Made("", [command, str(sources.hearts[0]), target])

    return made


def _circled(command: str, target: str) -> Odd:
    def made(sources: Sources, folder: Path) -> Made:
        name = target.rpartition("=")[2]
        (folder / name).symlink_to(folder / "other")
        (folder / "other").symlink_to(folder / name)
        return Made("", [command, str(sources.hearts[0]), target])

    return made


def _schemas(sources: Sources, folder: Path) -> Made:
    (folder / "kept").write_text("mine")
    return Made("", ["schema", "kept"])


def _read(command: str, *words: str) -> Odd:
    def made(sources: Sources, folder: Path) -> Made:
        return Made("", [command, *words])

    return made


def _cohort(*words: str, files: tuple[str, ...] = ()) -> Odd:
    def made(sources: Sources, folder: Path) -> Made:
        (folder / "in").mkdir()
        for name in files:
            (folder / "in" / name).write_bytes(b"\0" * 400)
        return Made("", ["cohort", *words, "-o", "out", "--preset", "acdc", "--workers", "1", *SWEEP], "out")

    return made


PATHS: dict[str, Odd] = {
    "a folder as a map": _input(_folder),
    "a folder of files as a map": _input(lambda folder: _folder(folder, "1.dcm", "2.dcm", "x.txt")),
    "links in a circle": _input(_loop),
    "a link to nothing": _input(_broken),
    "no name": with_words("--mask", "lv=", "--mask", "myo="),
    "a map without a name": _input(lambda folder: ""),
    "a map that never ends": _input(lambda folder: "/dev/zero"),
    "standard input": _input(lambda folder: "-"),
    "/dev/stdin": _input(lambda folder: "/dev/stdin"),
    "memory of a process": _input(lambda folder: "/proc/self/mem"),
    "a name of four bytes a letter": _input(lambda folder: "\N{ANATOMICAL HEART}" * 60 + ".nii"),
    "a name that is no text": _input(lambda folder: os.fsdecode(b"\xff\xfe.nii")),
    "a name of 5000 letters": _input(lambda folder: "a/" * 2500 + "a.nii"),
    "a name of lines": _input(lambda folder: "a\nb\x1b[31m.nii"),
    "an output that is a file": _output(_file),
    "an output with folders in the way": _output(_full),
    "an output that is a link to nothing": _output(_linked),
    "an output of no name": _output(lambda folder: "", False),
    "an output of a null": _output(lambda folder: "a\0b", False),
    "an output in a file": _output(lambda folder: str(_map_beside(folder) / "out"), False),
    "an output in /proc": _output(lambda folder: "/proc/out", False),
    "an output in /dev/full": _output(lambda folder: "/dev/full", False),
    "an output far below what is there": _below,
    "an output of 300 letters": _output(lambda folder: "a" * 300, False),
    "an output of the map's name": _output(lambda folder: "map.nii.gz", False),
    "convert onto itself": _itself("convert"),
    "refine onto itself": _itself("refine"),
    "transfer onto itself": _itself("transfer", "--field", "aha"),
    "activate onto itself": _itself("activate", "--no-purkinje"),
    "convert onto a folder": _onto("out.vtu"),
    "convert into nothing": _onto("none/out.vtu"),
    "convert to no ending": _onto("out"),
    "convert to an ending alone": _onto(".vtu"),
    "convert onto a pipe": _piped("convert", "out.inp"),
    "convert onto a name of links in a circle": _circled("convert", "out.inp"),
    "bullseye onto a name of links in a circle": _circled("bullseye", "out.svg"),
    "page of a check onto a name of links in a circle": _circled("check", "--html=out.html"),
    "convert to an ending nobody knows": _onto("out.heart"),
    "convert to no name": _onto(""),
    "check of nothing": _read("check", ""),
    "check of a folder": _read("check", "."),
    "check of a device": _read("check", "/dev/zero"),
    "compare of folders": _read("compare", ".", ".."),
    "bullseye of nothing": _read("bullseye", "none.vtu", "out.svg"),
    "schemas into a file": _schemas,
    "a demo into a device": _read("demo", "-o", "/dev/full"),
    "no words": _read("mesh"),
    "no such command": _read("heart"),
    "log into a folder": with_words("--log", "."),
    "log into a full disk": with_words("--log", "/dev/full"),
    "log into nothing": with_words("--log", "none/log.txt"),
    "cohort of nothing": _cohort("none"),
    "cohort of an empty folder": _cohort("in"),
    "cohort of another pattern": _cohort("in", "--pattern", "../../**/*"),
    "cohort of an absolute pattern": _cohort("in", "--pattern", "/etc/*"),
    "cohort of a pattern that is none": _cohort("in", "--pattern", "[", files=("a.nii",)),
    "cohort of an empty pattern": _cohort("in", "--pattern", "", files=("a.nii",)),
    "cohort with an empty table": _cohort("/dev/null"),
    "cohort with no workers": _cohort("in", "--workers", "0", files=("a.nii",)),
    "cohort with a billion workers": _cohort("in", "--workers", "1000000000", files=("a.nii",)),
    "cohort with a scheduler that is none": _cohort("in", "--scheduler", "://", files=("a.nii",)),
}


def _map_beside(folder: Path) -> Path:
    (folder / "file").write_text("mine")
    return folder / "file"
