"""Cases of one label map: its labels, header, bytes and affine; maps of patients."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
from fuzz.common import FILLED, QUICK, SWEEP, Made, damaged_labels, mesh, one_of, read, scaled, write
from fuzz.damage import Random, bytes_of, choose, header_of, text_of
from fuzz.sources import HEARTS, Sources

import femprep as fp


def labels(random: Random, sources: Sources, folder: Path) -> Made:
    anatomy = one_of(random, ("lv",) * 8 + ("biv", "whole-heart"))
    seg = sources.maps[anatomy]
    array, names = damaged_labels(random, np.asarray(seg.labels), 1)
    path = folder / "map.nii.gz"
    write(path, array, scaled(random, np.array(seg.grid.spacing), names))
    way = SWEEP if anatomy == "lv" and random.random() < 0.85 else FILLED
    done = f"{anatomy}: {', '.join(names)}"
    if random.random() < 0.1:
        return Made(done, ["surface", str(path), "-o", "out", "--preset", HEARTS[anatomy], *QUICK], "out", True)
    more = ["--correct-shifts"] if random.random() < 0.1 else []
    return Made(done, mesh(path, anatomy, *way, *more), "out", True)


def real_labels(random: Random, sources: Sources, folder: Path) -> Made:
    """Label maps of patients, as they are or damaged, by ways a modeller may choose."""
    source = choose(random, sources.patients)
    assert isinstance(source, Path)
    seg = fp.read_segmentation(source, preset="acdc")
    array, names = damaged_labels(random, np.asarray(seg.labels), 0)
    path = folder / "map.nii.gz"
    write(path, array, scaled(random, np.array(seg.grid.spacing), names), seg.grid.direction)
    way = SWEEP if random.random() < 0.8 else FILLED
    more = one_of(random, ("", "", "", "--correct-shifts", "--fibres", "--blood-pool", "--apex=clipped")).split()
    done = f"{source.name.partition('_gt')[0]}: {', '.join(names) or 'as it is'}"
    return Made(f"{done} {' '.join(more)}".strip(), mesh(path, "lv", *way, *more), "out", True)


def header(random: Random, sources: Sources, folder: Path) -> Made:
    seg = sources.maps["lv"]
    way = int(random.integers(4))
    if way < 2:
        path = folder / "map.nii"
        write(path, np.asarray(seg.labels), seg.grid.spacing)
        data, done = header_of(random, path.read_bytes())
        if way:
            path = folder / "map.nii.gz"
            data = gzip.compress(data, mtime=0)
        path.write_bytes(data)
    else:
        path = folder / ("map.nrrd" if way == 2 else "map.mha")
        write(path, np.asarray(seg.labels), seg.grid.spacing)
        whole = path.read_bytes()
        end = whole.find(b"\n\n") if way == 2 else whole.find(b"ElementDataFile")
        text, done = text_of(random, whole[:end].decode("latin-1"))
        path.write_bytes(text.encode("latin-1") + whole[end:])
    return read(random, path, sources, done)


def raw_bytes(random: Random, sources: Sources, folder: Path) -> Made:
    seg = sources.maps["lv"]
    path = folder / one_of(random, ("map.nii", "map.nii.gz", "map.nrrd", "map.mha", "map.mhd"))
    write(path, np.asarray(seg.labels), seg.grid.spacing)
    near = None if random.random() < 0.5 else 400
    data, done = bytes_of(random, path.read_bytes(), 0, near)
    path.write_bytes(data)
    return read(random, path, sources, f"{path.suffix}: {done}")


def affine(random: Random, sources: Sources, folder: Path) -> Made:
    seg = sources.maps["lv"]
    path = folder / "map.nii"
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    write(path, np.asarray(seg.labels), seg.grid.spacing, turn)
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
    return read(random, path, sources, done)
