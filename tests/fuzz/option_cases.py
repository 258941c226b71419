"""Cases of options: command lines, configuration files, tables of cohorts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from fuzz.common import FILLED, SWEEP, Made, map_for_options, mesh, one_of, without_base, write
from fuzz.damage import NUMBERS, Random, bytes_of, text_of
from fuzz.sources import CONFIGURATION, HEARTS, Sources

_OPTIONS = (
    *("--vertices", "--edge-length", "--layers", "--base-offset", "--minimum-thickness", "--elements-through-wall"),
    *("--singularities", "--control-points", "--time-limit", "--endo-angle", "--rv-wall-thickness", "--order"),
    *("--structure", "--spacing", "--valve", "--anatomy", "--preset", "--mesher", "--quality", "--element", "--apex"),
    *("--basal-end", "--openings", "--sizing", "--format", "--length-unit", "--step", "--purpose", "--policy"),
    *("--method", "--mirrored", "--config", "--template", "--nonsense", "-o", "--base", "--frame", "--mask"),
    *("--surface", "--regions", "--sample", "--unit", "--pericardium", "--solve", "--atrial-wall-thickness"),
    "--leave-out",
)
_FLAGS = (
    "--fibres",
    "--blood-pool",
    "--correct-shifts",
    "--flip",
    "--purkinje",
    "--activation",
    "--sequence",
    "--json",
)
_WORDS = (
    *("lv", "biv", "whole-heart", "sweep", "tetwild", "hexahedron", "wedge", "open", "clipped", "labels", "abaqus"),
    *("med", "best", "fast", "2", "3", "0.5", "12", "100", "1000000", "lv=3", "myo=0", "lv=9,9", "=", "a=b", "é"),
    *("mitral=0,0,0,0,0,1,10", "mitral=0,0,0,0,0,0,0", "0,0,0,0,0,1", "0,0,0,0,0,0", "lv=none.stl", "/", ".", ".."),
    *("/dev/null", "none.toml", "a" * 5000, "\n", "-1"),
)


def options(random: Random, sources: Sources, folder: Path) -> Made:
    """A command line with up to three options of any kind, with any value."""
    anatomy = one_of(random, HEARTS) if random.random() < 0.2 else "lv"
    seg, path = sources.maps[anatomy], folder / "map.nii.gz"
    whole = map_for_options(random, seg, path)
    given = []
    for _ in range(int(random.integers(1, 4))):
        name = one_of(random, _OPTIONS)
        count = 3 if name == "--spacing" else 1
        given += [name, *(one_of(random, NUMBERS + _WORDS) for _ in range(count))]
    if random.random() < 0.3:
        given.append(one_of(random, _FLAGS))
    base = mesh(path, anatomy, *(SWEEP if anatomy == "lv" else FILLED))
    out = given[len(given) - given[::-1].index("-o")] if "-o" in given else "out"
    return Made(" ".join(word[:30] for word in given), [*base, *given], out, whole)


def toml(random: Random, sources: Sources, folder: Path) -> Made:
    """A configuration file with numbers, lines or bytes changed."""
    seg, path, config = sources.maps["lv"], folder / "map.nii.gz", folder / "options.toml"
    whole = map_for_options(random, seg, path)
    text, done = CONFIGURATION, []
    for _ in range(int(random.integers(1, 4))):
        text, what = text_of(random, text)
        done.append(what)
    data = text.encode()
    if random.random() < 0.3:
        data, what = bytes_of(random, data)
        done.append(what)
    elif random.random() < 0.1:
        data += b"x = " + b"[" * 3000
        done.append("3000 brackets")
    config.write_bytes(data)
    return Made("; ".join(done), ["mesh", str(path), "-o", "out", "--config", str(config), "--quiet"], "out", whole)


_TABLE = """\
subject\timage\tphase\tvolume.edge_length\tsurface.vertices\tanatomy
one\tmap.nii.gz\ted\t8.0\t300\tlv
one\tmap.nii.gz\tes\tn/a\t400\tlv
two\tother.nii.gz\tn/a\t9.5\tn/a\tn/a
"""
_CELLS = (
    *NUMBERS,
    *("../x", "/tmp", "a/b", ".", "", "failures", "é", "<b>", "=1+1", "[1, 2]", "{}", "true", "null", "[" * 3000),
    *("one", "ED", "map.nii.gz", "/dev/null", "biv", "whole-heart", "\0", '"'),
)


def table(random: Random, sources: Sources, folder: Path) -> Made:
    """A table of a cohort with cells, names of columns, lines or bytes changed."""
    seg = sources.maps["lv"]
    whole = bool(random.random() < 0.1)  # workers take seconds to begin
    write(folder / "map.nii.gz", without_base(seg), seg.grid.spacing)
    write(folder / "other.nii.gz", np.asarray(seg.labels), seg.grid.spacing)
    rows, done = [line.split("\t") for line in _TABLE.splitlines()], []
    for _ in range(int(random.integers(1, 4))):
        at, column, cell = int(random.integers(len(rows))), int(random.integers(6)), one_of(random, _CELLS)
        done.append(f"{rows[at][column]!r} made {cell[:20]!r}")
        rows[at][column] = cell
    if not whole:  # refused behind all else
        rows.append(["last", "none.nii.gz", "n/a", "n/a", "n/a", "n/a"])
    data = "\n".join("\t".join(row) for row in rows).encode()
    if random.random() < 0.3:
        data, what = bytes_of(random, data)
        done.append(what)
    path = folder / "cohort.tsv"
    path.write_bytes(data)
    arguments = ["cohort", str(path), "-o", "out", "--preset", "acdc", "--workers", "1", *SWEEP]
    kind = one_of(random, ("", "--surfaces", "--sequence"))
    return Made("; ".join(done), [*arguments, *kind.split()], "out", whole)
