"""Cases of maps that are more than one array: masks, Slicer's segments, frames, second images."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from fuzz.common import MESHED, SWEEP, Made, damaged_labels, map_for_options, mesh, one_of, scaled, without_base, write
from fuzz.damage import NUMBERS, Random, bytes_of, choose, file_of, header_of, text_of
from fuzz.sources import Sources

_ENDINGS = (".nii", ".nii.gz", ".nrrd", ".mha")
#: What ``--frame`` is asked for.
_FRAMES = ("1", "2", "3", "4", "0", "-1", "1000000", "1.5", "nan", "")
#: Names of segments: those the preset knows, and others.
_NAMES = ("LV blood pool", "Myocardium", "RV", "lv", "", "=", "@@", "a" * 3000, "Myocardium", "../x", "<b>")


def _image(random: Random, array: np.ndarray, spacing: np.ndarray, path: Path) -> tuple[str, bool]:
    """Write an image, damaged in its labels, its header, its bytes or not at all; what was done, whether to labels."""
    way = int(random.integers(6))
    names: list[str] = []
    of_labels = way < 2 and len(np.unique(array)) > 1
    if of_labels:
        array, names = damaged_labels(random, array, 1)
        spacing = scaled(random, spacing, names)
    write(path, array, spacing)
    if way == 2 and path.suffix == ".nii":
        data, done = header_of(random, path.read_bytes())
        path.write_bytes(data)
        names = [done]
    elif way in (2, 3):
        names = [file_of(random, path)]
    elif way == 4:
        data, done = bytes_of(random, path.read_bytes(), 0, 400)
        path.write_bytes(data)
        names = [done]
    return f"{path.suffix}: {', '.join(names) or 'as it is'}", of_labels


def masks(random: Random, sources: Sources, folder: Path) -> Made:
    """A file for each structure; one of them damaged, left out, empty or given twice."""
    seg = sources.maps["lv"]
    whole = bool(random.random() < MESHED)
    labels = np.asarray(seg.labels) if whole else without_base(seg)
    names: Any = choose(random, (("lv", "myo"), ("lv", "myo"), ("lv", "lv", "myo"), ("myo",), ("lv", "myo", "none")))
    hurt, given, done, of_labels = int(random.integers(len(names))), [], "", False
    for number, name in enumerate(names):
        path = folder / f"{number}{one_of(random, _ENDINGS)}"
        array = np.isin(labels, seg.structures.get(name, (77,))).astype(np.uint8)
        if number == hurt:
            done, of_labels = _image(random, array, np.array(seg.grid.spacing), path)
        else:
            write(path, array, seg.grid.spacing)
        given += ["--mask", f"{name}={path}"]
    meshes = whole or of_labels  # half of the image made myocardium has a base again
    return Made(f"{name} of {' '.join(names)}, {done}", ["mesh", "-o", "out", *given, *SWEEP], "out", meshes)


def segments(random: Random, sources: Sources, folder: Path) -> Made:
    """A ``.seg.nrrd`` as 3D Slicer writes it, of one layer or two, its names, header or bytes damaged."""
    import nrrd

    seg = sources.maps["lv"]
    whole = bool(random.random() < MESHED)
    labels = np.asarray(seg.labels) if whole else without_base(seg)
    lv, myo = (np.isin(labels, seg.structures[name]) for name in ("lv", "myo"))
    several = bool(random.integers(2))
    layers = np.stack([lv, lv | myo]).astype(np.uint8) if several else (7 * lv + 3 * myo).astype(np.uint8)
    rows = [("LV blood pool", "1", "0"), ("Myocardium", "1", "1")]
    rows = rows if several else [("LV blood pool", "7", "0"), ("Myocardium", "3", "0")]
    done = []
    if random.random() < 0.5:
        which, field = int(random.integers(2)), int(random.integers(3))
        value = one_of(random, _NAMES if field == 0 else (*NUMBERS[:12], "3", "7", "300", "-7", "two"))
        row = list(rows[which])
        row[field] = value
        rows[which] = (row[0], row[1], row[2])
        done.append(f"{('name', 'label', 'layer')[field]} made {value[:20]!r}")
    directions = np.diag(np.asarray(seg.grid.spacing))
    header: dict[str, Any] = {
        "space": "left-posterior-superior",
        "space directions": np.vstack([[np.nan] * 3, directions]) if several else directions,
        "space origin": np.zeros(3),
        "kinds": [*(["list"] if several else []), "domain", "domain", "domain"],
        "encoding": one_of(random, ("gzip", "raw")),
    }
    for number, (name, label, layer) in enumerate(rows):
        own = f"Segment{number}_"
        header |= {f"{own}ID": f"Segment_{number + 1}", f"{own}Name": name}
        header |= {f"{own}LabelValue": label, f"{own}Layer": layer}
    path = folder / "map.seg.nrrd"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        nrrd.write(str(path), layers, header)
    path.write_bytes(path.read_bytes().replace(b"@@", b"\xe9\xe9", 1))  # no UTF-8, which the writer would not write
    if not done or random.random() < 0.3:
        data = path.read_bytes()
        end = data.find(b"\n\n")
        if random.random() < 0.7:
            text, what = text_of(random, data[:end].decode("latin-1"))
            path.write_bytes(text.encode("latin-1", "replace") + data[end:])
        else:
            data, what = bytes_of(random, data)
            path.write_bytes(data)
        done.append(what)
    given: Any = choose(random, ((), ("--preset", "slicer"), ("--structure", "lv=7", "--structure", "myo=Myocardium")))
    return Made("; ".join(done), ["mesh", str(path), "-o", "out", *given, *SWEEP], "out", whole)


def frames(random: Random, sources: Sources, folder: Path) -> Made:
    """A map of three frames, its header damaged or not, and a frame asked for; or several maps as phases."""
    seg = sources.maps["lv"]
    whole = bool(random.random() < MESHED)
    labels = np.asarray(seg.labels) if whole else without_base(seg)
    if random.random() < 0.3:
        paths = [folder / f"phase{number}{one_of(random, _ENDINGS)}" for number in range(2)]
        write(paths[0], np.asarray(seg.labels), seg.grid.spacing)
        done, _ = _image(random, labels, np.array(seg.grid.spacing), paths[1])
        return Made(f"phases, {done}", [*mesh(paths[0], "lv", *SWEEP, "--sequence"), str(paths[1])], "out", True)
    image = sitk.JoinSeries([sitk.GetImageFromArray(np.ascontiguousarray(labels.T)) for _ in range(3)])
    image.SetSpacing([*map(float, seg.grid.spacing), 1.0])
    path = folder / f"map{one_of(random, ('.nii', '.nrrd', '.mha'))}"
    sitk.WriteImage(image, str(path))
    done = "as it is"
    if random.random() < 0.7:
        if path.suffix == ".nii":
            data, done = header_of(random, path.read_bytes())
        else:
            data, done = bytes_of(random, path.read_bytes(), 0, 500)
        path.write_bytes(data)
    frame = one_of(random, _FRAMES)
    return Made(f"{path.suffix}: {done}, frame {frame}", mesh(path, "lv", *SWEEP, "--frame", frame), "out", whole)


def second_images(random: Random, sources: Sources, folder: Path) -> Made:
    """Regions of a second label map, or an image to sample, damaged; a whole map or one that is refused later."""
    seg, path = sources.maps["lv"], folder / "map.nii.gz"
    whole = map_for_options(random, seg, path)
    other = folder / f"other{one_of(random, _ENDINGS)}"
    array = np.isin(seg.labels, seg.structures["myo"]).astype(np.uint8)
    given: list[str]
    if random.random() < 0.5:
        array[: array.shape[0] // 2] *= 2
        tissues: Any = choose(
            random,
            (("scar=1", "border=2"), ("scar=1",), ("scar=9",), ("scar=-1",), ("lv=1",), ("healthy=1", "scar=2"), ()),
        )
        given = ["--regions", str(other), *tissues]
        done = f"{' '.join(tissues)}, {_image(random, array, np.array(seg.grid.spacing), other)[0]}"
    else:
        values = (array * random.normal(1000.0, 100.0, array.shape)).astype(np.float32)
        if random.random() < 0.3:
            values[random.random(values.shape) < 0.5] = float(one_of(random, ("nan", "inf", "1e38", "-1e38")))
        name = one_of(random, ("t1=", "", "scar=", "../x=", "fiber=", "region=", "=", "1="))
        given = ["--sample", f"{name}{other}"]
        done = f"{name} {_image(random, values, np.array(seg.grid.spacing), other)[0]}"
    return Made(done, [*mesh(path, "lv", *SWEEP, "--fibres"), *given], "out", whole)
