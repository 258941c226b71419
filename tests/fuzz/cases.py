"""A kind, a seed and a number in; a command of femprep on inputs damaged accordingly out, the same every time."""

from __future__ import annotations

import gzip
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import SimpleITK as sitk
from fuzz.damage import LABELS, NUMBERS, SCALES, Random, bytes_of, choose, file_of, header_of, text_of
from fuzz.sources import CONFIGURATION, HEARTS, Sources

from femprep import Segmentation

#: Options that make a run a matter of seconds.
_QUICK = ("--vertices", "300", "--quiet")
_SWEEP = ("--mesher", "sweep", "--edge-length", "8", *_QUICK)
#: Share of damaged files and options that may come to be meshed; the others are read, or refused, alone.
_MESHED = 0.25
_FILLED = ("--edge-length", "6", "--quality", "fast", "--time-limit", "60", *_QUICK)


@dataclass(frozen=True)
class Case:
    """One command.

    Attributes
    ----------
    kind : str
    number : int
    what : str
        What was done to its input.
    arguments : list of str
        Of ``femprep``.
    out : str
        File or folder it writes, relative to its folder; empty where it writes none.
    meshes : bool
        Whether it may come to meshing, which takes seconds.
    """

    kind: str
    number: int
    what: str
    arguments: list[str]
    out: str = ""
    meshes: bool = False


def _write(path: Path, labels: np.ndarray, spacing: np.ndarray, direction: np.ndarray | None = None) -> None:
    image = sitk.GetImageFromArray(np.ascontiguousarray(labels.T))
    image.SetSpacing([float(s) for s in spacing])
    if direction is not None:
        image.SetDirection(direction.ravel().tolist())
    sitk.WriteImage(image, str(path), useCompression=True)


def _mesh(path: Path, anatomy: str, *arguments: str) -> list[str]:
    return ["mesh", str(path), "-o", "out", "--preset", HEARTS[anatomy], "--anatomy", anatomy, *arguments]


def _read(random: Random, path: Path, sources: Sources) -> tuple[list[str], str, bool]:
    """Arguments, what is made and whether it may be meshed: for a damaged file most often a command that reads it."""
    if random.random() < _MESHED:
        return _mesh(path, "lv", *_SWEEP), "out", True
    ball = str(sources.surfaces[0])
    return ["compare", ball, ball, "--json", "--slices", str(path)], "", False


def _map_for_options(random: Random, seg: Segmentation, path: Path) -> bool:
    """Write the map, or most often one whose base is not to be found: refused when all options have been read.

    Whether it may be meshed.
    """
    array, whole = np.array(seg.labels), bool(random.random() < _MESHED)
    if not whole:
        array[array == seg.structures["myo"][0]] = 0
        array[0, 0, 0] = seg.structures["myo"][0]
    _write(path, array, seg.grid.spacing)
    return whole


def labels(random: Random, sources: Sources, folder: Path) -> tuple[str, list[str], str, bool]:
    anatomy = str(choose(random, ("lv",) * 8 + ("biv", "whole-heart")))
    seg = sources.maps[anatomy]
    array, spacing = np.asarray(seg.labels), np.array(seg.grid.spacing)
    names = [str(choose(random, LABELS)) for _ in range(int(random.integers(1, 4)))]
    for name in names:
        if len(np.unique(array)) > 1:
            array = LABELS[name](random, array)
    scale = float(choose(random, SCALES))  # type: ignore[arg-type]
    scales = np.full(3, scale) if random.random() < 0.7 else np.array([1.0, 1.0, scale])
    path = folder / "map.nii.gz"
    _write(path, array, spacing * scales)
    way = _SWEEP if anatomy == "lv" and random.random() < 0.85 else _FILLED
    if random.random() < 0.1:
        return ", ".join(names), ["surface", str(path), "-o", "out", "--preset", HEARTS[anatomy], *_QUICK], "out", True
    more = ["--correct-shifts"] if random.random() < 0.1 else []
    if np.any(scales != 1.0):
        names.append(f"voxels x {scale:g}")
    return f"{anatomy}: {', '.join(names)}", _mesh(path, anatomy, *way, *more), "out", True


def header(random: Random, sources: Sources, folder: Path) -> tuple[str, list[str], str, bool]:
    seg = sources.maps["lv"]
    way = int(random.integers(4))
    if way < 2:
        path = folder / "map.nii"
        _write(path, np.asarray(seg.labels), seg.grid.spacing)
        data, done = header_of(random, path.read_bytes())
        if way:
            path = folder / "map.nii.gz"
            data = gzip.compress(data)
        path.write_bytes(data)
    else:
        path = folder / ("map.nrrd" if way == 2 else "map.mha")
        _write(path, np.asarray(seg.labels), seg.grid.spacing)
        whole = path.read_bytes()
        end = whole.find(b"\n\n") if way == 2 else whole.find(b"ElementDataFile")
        text, done = text_of(random, whole[:end].decode("latin-1"))
        path.write_bytes(text.encode("latin-1") + whole[end:])
    return done, *_read(random, path, sources)


def raw_bytes(random: Random, sources: Sources, folder: Path) -> tuple[str, list[str], str, bool]:
    seg = sources.maps["lv"]
    path = folder / str(choose(random, ("map.nii", "map.nii.gz", "map.nrrd", "map.mha", "map.mhd")))
    _write(path, np.asarray(seg.labels), seg.grid.spacing)
    near = None if random.random() < 0.5 else 400
    data, done = bytes_of(random, path.read_bytes(), 0, near)
    path.write_bytes(data)
    return f"{path.suffix}: {done}", *_read(random, path, sources)


def affine(random: Random, sources: Sources, folder: Path) -> tuple[str, list[str], str, bool]:
    seg = sources.maps["lv"]
    path = folder / "map.nii"
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    _write(path, np.asarray(seg.labels), seg.grid.spacing, turn)
    data = bytearray(path.read_bytes())
    way = int(random.integers(5))
    rows = np.frombuffer(bytes(data[280:328]), dtype="<f4").reshape(3, 4).copy()
    if way == 1:
        rows[:, :3] *= float(choose(random, (1e3, 1e-3, -1.0, 0.1, 1e-12)))  # type: ignore[arg-type]
    elif way == 2:
        rows[:, int(random.integers(3))] = 0.0
    elif way == 3:
        rows[:, :3] += random.normal(size=(3, 3)) * float(choose(random, (1e-4, 1e-2, 1.0)))  # type: ignore[arg-type]
    elif way == 4:
        rows[:, 3] = float(choose(random, (1e6, 1e30, np.nan, -1e12)))  # type: ignore[arg-type]
    data[280:328] = rows.astype("<f4").tobytes()
    if random.random() < 0.5:  # the sform alone counts
        data[252:254] = b"\0\0"
    path.write_bytes(bytes(data))
    done = ("turned", "scaled", "a column of zeros", "sheared", "far away")[way]
    return done, *_read(random, path, sources)


_OPTIONS = (
    *("--vertices", "--edge-length", "--layers", "--base-offset", "--minimum-thickness", "--elements-through-wall"),
    *("--singularities", "--control-points", "--time-limit", "--endo-angle", "--rv-wall-thickness", "--order"),
    *("--structure", "--spacing", "--valve", "--anatomy", "--preset", "--mesher", "--quality", "--element", "--apex"),
    *("--basal-end", "--openings", "--sizing", "--format", "--length-unit", "--step", "--purpose", "--policy"),
    *("--method", "--mirrored", "--config", "--template", "--nonsense", "-o"),
)
_WORDS = (
    *("lv", "biv", "whole-heart", "sweep", "tetwild", "hexahedron", "wedge", "open", "clipped", "labels", "abaqus"),
    *(
        "med",
        "best",
        "fast",
        "2",
        "3",
        "0.5",
        "12",
        "100",
        "1000000",
        "lv=3",
        "myo=0",
        "lv=9,9",
        "=",
        "a=b",
        "é",
    ),
    *(
        "mitral=0,0,0,0,0,1,10",
        "mitral=0,0,0,0,0,0,0",
        "/",
        ".",
        "..",
        "/dev/null",
        "none.toml",
        "a" * 5000,
        "\n",
        "-1",
    ),
)


def options(random: Random, sources: Sources, folder: Path) -> tuple[str, list[str], str, bool]:
    anatomy = str(choose(random, HEARTS)) if random.random() < 0.2 else "lv"
    seg, path = sources.maps[anatomy], folder / "map.nii.gz"
    whole = _map_for_options(random, seg, path)
    given = []
    for _ in range(int(random.integers(1, 4))):
        name = str(choose(random, _OPTIONS))
        count = 3 if name == "--spacing" else 1
        given += [name, *(str(choose(random, NUMBERS + _WORDS)) for _ in range(count))]
    base = _mesh(path, anatomy, *(_SWEEP if anatomy == "lv" else _FILLED))
    out = given[len(given) - given[::-1].index("-o")] if "-o" in given else "out"
    return " ".join(word[:30] for word in given), [*base, *given], out, whole


def toml(random: Random, sources: Sources, folder: Path) -> tuple[str, list[str], str, bool]:
    seg, path, config = sources.maps["lv"], folder / "map.nii.gz", folder / "options.toml"
    whole = _map_for_options(random, seg, path)
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
    return "; ".join(done), ["mesh", str(path), "-o", "out", "--config", str(config), "--quiet"], "out", whole


def mesh_file(random: Random, sources: Sources, folder: Path) -> tuple[str, list[str], str, bool]:
    source = choose(random, sources.meshes)
    assert isinstance(source, Path)
    place = folder / "in"
    shutil.copytree(source.parent, place)
    path = place / source.name
    files = sorted(p for p in place.rglob("*") if p.is_file())
    victim = path if path.is_file() and random.random() < 0.7 else choose(random, files)
    assert isinstance(victim, Path)
    done = f"{victim.name} of {source.parent.name}: {file_of(random, victim)}"
    if random.random() < 0.5:
        return done, ["check", str(path), "-q"], "", False
    target = str(choose(random, ("out.vtu", "out.inp", "out.msh", "out.med", "out.feb", "out.xdmf", "out.mesh")))
    return done, ["convert", str(path), target, "-q"], target, False


def surface_file(random: Random, sources: Sources, folder: Path) -> tuple[str, list[str], str, bool]:
    source = choose(random, sources.surfaces)
    assert isinstance(source, Path)
    path = folder / source.name
    shutil.copy(source, path)
    return f"{source.name}: {file_of(random, path)}", ["compare", str(path), str(source), "--json"], "", False


#: What makes the cases of each kind; the share of each in a run.
KINDS: dict[str, Callable[[Random, Sources, Path], tuple[str, list[str], str, bool]]] = {
    "labels": labels,
    "header": header,
    "bytes": raw_bytes,
    "affine": affine,
    "options": options,
    "toml": toml,
    "mesh file": mesh_file,
    "surface file": surface_file,
}


def make_case(kind: str, seed: int, number: int, sources: Sources, folder: Path) -> Case:
    """The case of a kind with a number, its files written into a folder."""
    random = np.random.default_rng([seed, list(KINDS).index(kind), number])
    what, arguments, out, meshes = KINDS[kind](random, sources, folder)
    return Case(kind, number, what, arguments, out, meshes)
