"""Values of options that no random choice comes to, each by name: on the command line and in configurations."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from fuzz.common import Made
from fuzz.odd_paths import plain_map, with_words
from fuzz.sources import Sources

Odd = Callable[[Sources, Path], Made]


def _configured(text: str | bytes | None) -> Odd:
    def made(sources: Sources, folder: Path) -> Made:
        path = folder / "options.toml"
        if text is None:
            path.mkdir()
        else:
            path.write_bytes(text if isinstance(text, bytes) else text.encode())
        words = ["mesh", str(plain_map(sources, folder)), "-o", "out", "--config", str(path), "--preset", "acdc", "-q"]
        return Made("", words, "out")

    return made


CONFIGURATIONS: dict[str, Odd] = {
    "configuration: a folder": _configured(None),
    "configuration: nothing": _configured(""),
    "configuration: bytes": _configured(b"\xff\xfe\0\0"),
    "configuration: no such table": _configured("[heart]\nx = 1"),
    "configuration: a number for a table": _configured("volume = 3"),
    "configuration: a table for a number": _configured("[volume.edge_length]\nx = 1"),
    "configuration: a list for a number": _configured("volume.edge_length = [1, 2]"),
    "configuration: a date": _configured("volume.edge_length = 2026-01-01"),
    "configuration: inf": _configured("volume.edge_length = inf"),
    "configuration: a billion digits": _configured("volume.edge_length = " + "9" * 100000),
    "configuration: true": _configured("volume.edge_length = true\nsurface.vertices = true"),
    "configuration: words": _configured('anatomy = ["lv"]\npreset = {}'),
    "configuration: a thousand tables": _configured("[" + ".".join(["a"] * 1000) + "]\nx=1"),
    "configuration: labels": _configured("[structures]\nlv = -3\nmyo = 1e9"),
}

#: Values of options, each of which is refused, or does no harm.
VALUES: dict[str, Odd] = {
    " ".join(words)[:60]: with_words(*words)
    for words in (
        *(("--edge-length", v) for v in ("1e-9", "1e9", "1e400", "-inf", "1_0", "٨", "0x8", " 8", "8mm", "8,5", "")),
        *(("--vertices", v) for v in ("0", "-1", "3", "4", "1e3", "9223372036854775807", "1" * 5000)),
        *(("--layers", v) for v in ("0", "1000000000", "1.5")),
        *(("--elements-through-wall", v) for v in ("0", "1000000", "-3")),
        *(("--time-limit", v) for v in ("0", "1e-9", "nan", "inf", "-1")),
        *(("--structure", v) for v in ("lv=", "lv=1-3", "lv=3,3", "lv=nan", "=3", "lv=1=2", "LV=3", "lv=3.0", "lv=2")),
        *(("--spacing", *v.split()) for v in ("0 0 0", "nan 2 8", "-2 -2 -8", "inf 2 8", "1e-30 2 8", "2 2")),
        *(("--base", v) for v in ("", "0,0,0", "nan,0,0,0,0,1", "0,0,0,0,0,1e-300", "0,0,0,0,0,0,0", "a,b,c,d,e,f")),
        *(("--format", v) for v in ("", "VTU", "abaqus,gmsh", "../x")),
        *(("--minimum-thickness", v) for v in ("1e9", "-1", "nan")),
        *(("--base-offset", v) for v in ("1e9", "-1e9", "nan")),
        *(("--purpose", v) for v in ("", "General", "\0")),
        *(("--valve", v) for v in ("mitral", "mitral=", "mitral=0,0,0,0,0,1,nan", "x=0,0,0,0,0,1,10")),
        *(("--frame", v) for v in ("1", "99999999999999999999")),
        *(("--regions", v) for v in (".", "none.nii", "/dev/zero", "map.nii.gz")),
        *(("--sample", v) for v in (".", "=", "t1=none.nii", "t1=/dev/zero", "t1=map.nii.gz")),
        *(("--image", v) for v in (".", "none.nii", "/dev/zero", "")),
        *(("--template", v) for v in (".", "none.vtu", "/dev/zero", "map.nii.gz")),
        *(("--sizing", v) for v in (".", "none.vtu", "/dev/zero", "map.nii.gz")),
        *(("--surface", v) for v in ("lv=.", "lv=", "=", "lv=/dev/zero", "lv=map.nii.gz")),
        *(("--preset", v) for v in ("", "ACDC", "../acdc", "\N{ANATOMICAL HEART}")),
        *(("--endo-angle", v) for v in ("nan", "1e300", "-1e300")),
        ("--json", "--quiet"),
        ("--structure", "lv=3", "--structure", "lv=2"),
        ("--order", "3"),
        ("--sequence",),
        ("none.nii", "none.nii", "none.nii"),
    )
}
