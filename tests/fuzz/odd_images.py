"""Label maps that no random damage comes to, each by name: types, shapes, sizes, hearts that are none, odd headers."""

from __future__ import annotations

import gzip
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import SimpleITK as sitk
from fuzz.common import QUICK, SWEEP, Made, mesh, write
from fuzz.sources import Sources

Odd = Callable[[Sources, Path], Made]


def _of(change: Callable[[np.ndarray], np.ndarray], *more: str, anatomy: str = "lv", spacing: object = None) -> Odd:
    """The phantom's labels changed, and meshed."""

    def made(sources: Sources, folder: Path) -> Made:
        seg, path = sources.maps[anatomy], folder / "map.nii"
        array = change(np.array(seg.labels))
        write(path, array, np.array(spacing if spacing is not None else seg.grid.spacing))
        return Made("", mesh(path, anatomy, *SWEEP, *more), "out", True)

    return made


def _cells(labels: np.ndarray, number: int, where: tuple[object, ...], kind: object = None) -> np.ndarray:
    out = labels.astype(kind) if kind is not None else labels.copy()
    out[where] = number
    return out


def _noise(shape: tuple[int, int, int]) -> np.ndarray:
    return np.random.default_rng(1).integers(0, 4, shape).astype(np.uint8)


def _ball(shape: tuple[int, int, int], inner: float, outer: float) -> np.ndarray:
    """A hollow ball that fills the grid: a cavity with a wall all around, closed at both ends."""
    at = np.stack(np.meshgrid(*(np.linspace(-1, 1, n) for n in shape), indexing="ij"))
    radius = np.linalg.norm(at, axis=0)
    return np.where(radius < inner, 3, np.where(radius < outer, 2, 0)).astype(np.uint8)


def _diagonal(labels: np.ndarray) -> np.ndarray:
    out = np.zeros_like(labels)
    n = min(labels.shape[:2])
    for k in range(labels.shape[2]):
        out[np.arange(n), np.arange(n), k] = 3
    return out


def _two_hearts(labels: np.ndarray) -> np.ndarray:
    return np.concatenate([labels, labels], axis=0)


def _sunk(labels: np.ndarray) -> np.ndarray:
    """The cavity beside the wall."""
    out = np.where(labels == 2, 2, 0)
    return np.where((np.roll(labels, 25, axis=0) == 3) & (out == 0), 3, out).astype(labels.dtype)


MAPS: dict[str, Odd] = {
    "one voxel": _of(lambda a: np.full((1, 1, 1), 3, np.uint8)),
    "one slice": _of(lambda a: a[:, :, 4:5]),
    "two slices": _of(lambda a: a[:, :, 4:6]),
    "three slices": _of(lambda a: a[:, :, 3:6]),
    "one row": _of(lambda a: a[20:21]),
    "all cavity": _of(lambda a: np.full_like(a, 3)),
    "all wall": _of(lambda a: np.full_like(a, 2)),
    "all background": _of(np.zeros_like),
    "wall everywhere but one voxel": _of(lambda a: _cells(np.full_like(a, 2), 3, (20, 20, 4))),
    "wall everywhere but the cavity": _of(lambda a: np.where(a == 3, 3, 2).astype(a.dtype)),
    "checkerboard": _of(lambda a: ((np.indices(a.shape).sum(0) % 2) + 2).astype(np.uint8)),
    "noise": _of(lambda a: _noise(a.shape)),
    "noise of two hundred slices": _of(lambda a: _noise((30, 30, 200))),
    "cavity alone": _of(lambda a: np.where(a == 3, 3, 0).astype(a.dtype)),
    "cavity beside the wall": _of(_sunk),
    "cavity in one slice": _of(lambda a: np.where((a == 3) & (np.arange(a.shape[2]) != 5), 2, a).astype(a.dtype)),
    "a wall one voxel thick": _of(lambda a: _ball((40, 40, 12), 0.85, 0.9)),
    "a closed ball": _of(lambda a: _ball((40, 40, 12), 0.6, 0.9)),
    "a closed ball that fills the grid": _of(lambda a: _ball((40, 40, 12), 0.6, 2.0)),
    "a ball of thirty thousandths": _of(lambda a: _ball((40, 40, 12), 0.03, 0.9)),
    "a flat disk": _of(lambda a: _ball((40, 40, 12), 0.6, 0.9), spacing=(3.0, 3.0, 0.2)),
    "a long tube": _of(lambda a: np.repeat(_ball((40, 40, 3), 0.6, 0.9)[:, :, 1:2], 120, axis=2)),
    "a diagonal line": _of(_diagonal),
    "two hearts": _of(_two_hearts),
    "voxels of 1, 1 and 1000 mm": _of(lambda a: a, spacing=(1.0, 1.0, 1000.0)),
    "voxels of .001, 1 and 1 mm": _of(lambda a: a, spacing=(0.001, 1.0, 1.0)),
    "voxels of .05 mm": _of(lambda a: a, spacing=(0.05, 0.05, 0.16)),
    "voxels of 1e-300 mm": _of(lambda a: a, spacing=(1e-30, 1e-30, 1e-30)),
    "half labels": _of(lambda a: a.astype(np.float32) + 0.5),
    "labels that are not a number": _of(lambda a: _cells(a, np.nan, (slice(5),), np.float32)),  # type: ignore[arg-type]
    "infinite labels": _of(lambda a: _cells(a, np.inf, (slice(5),), np.float64)),  # type: ignore[arg-type]
    "negative labels": _of(lambda a: -a.astype(np.int16)),
    "labels of 2^62": _of(lambda a: _cells(a, 2**62, (slice(5),), np.int64)),
    "labels of 1e300": _of(lambda a: _cells(a, 1e300, (slice(5),), np.float64)),  # type: ignore[arg-type]
    "a thousand labels": _of(lambda a: (np.arange(a.size).reshape(a.shape) % 1000).astype(np.int16)),
    "both ventricles of a left one": _of(lambda a: a, "--anatomy", "biv"),
    "four chambers of a left ventricle": _of(lambda a: a, "--anatomy", "whole-heart"),
    "a right ventricle of one voxel": _of(lambda a: _cells(a, 1, (2, 20, 4)), "--anatomy", "biv"),
    "a right ventricle all around": _of(lambda a: np.where(a == 0, 1, a).astype(a.dtype), "--anatomy", "biv"),
    "ventricles whose cavities touch": _of(
        lambda a: np.where(a == 2, 1, a).astype(a.dtype), anatomy="biv", spacing=(2.5, 2.5, 8.0)
    ),
}


def _nifti(dimensions: tuple[int, ...], kind: int = 2, bits: int = 8, data: bytes = b"", zipped: bool = False) -> Odd:
    """A NIfTI header that says so, with some bytes behind it."""

    def made(sources: Sources, folder: Path) -> Made:
        head = bytearray(352)
        struct.pack_into("<i", head, 0, 348)
        struct.pack_into(f"<{1 + len(dimensions)}h", head, 40, len(dimensions), *dimensions)
        struct.pack_into("<hh", head, 70, kind, bits)
        struct.pack_into("<8f", head, 76, *[1.0] * 8)
        struct.pack_into("<fff", head, 108, 352.0, 1.0, 0.0)
        head[344:348] = b"n+1\0"
        path = folder / ("map.nii.gz" if zipped else "map.nii")
        path.write_bytes(gzip.compress(bytes(head) + data) if zipped else bytes(head) + data)
        return Made("", mesh(path, "lv", *SWEEP), "out")

    return made


def _file(name: str, content: bytes | str) -> Odd:
    def made(sources: Sources, folder: Path) -> Made:
        path = folder / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return Made("", mesh(path, "lv", *SWEEP), "out")

    return made


_NRRD = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 40 40 9\nencoding: raw\nspacings: 2 2 8\n{}\n"
_MHD = "ObjectType = Image\nNDims = 3\nDimSize = 40 40 9\nElementSpacing = 2 2 8\nElementType = MET_UCHAR\n{}\n"


def _vector(sources: Sources, folder: Path) -> Made:
    image = sitk.GetImageFromArray(np.zeros((9, 40, 40, 3), np.uint8), isVector=True)
    sitk.WriteImage(image, str(folder / "map.nrrd"))
    return Made("", mesh(folder / "map.nrrd", "lv", *SWEEP), "out")


def _complex(sources: Sources, folder: Path) -> Made:
    image = sitk.GetImageFromArray(np.ones((9, 40, 40), np.complex64))
    sitk.WriteImage(image, str(folder / "map.nii"))
    return Made("", mesh(folder / "map.nii", "lv", *SWEEP), "out")


def _members(sources: Sources, folder: Path) -> Made:
    """Two gzip members one after the other, and something else behind them."""
    seg = sources.maps["lv"]
    write(folder / "one.nii", np.asarray(seg.labels), seg.grid.spacing)
    data = (folder / "one.nii").read_bytes()
    (folder / "one.nii").unlink()
    (folder / "map.nii.gz").write_bytes(gzip.compress(data[:5000]) + gzip.compress(data[5000:]) + b"and so on")
    return Made("", mesh(folder / "map.nii.gz", "lv", *SWEEP), "out", True)


def _png(sources: Sources, folder: Path) -> Made:
    sitk.WriteImage(sitk.GetImageFromArray(np.zeros((40, 40), np.uint8)), str(folder / "map.png"))
    return Made("", ["surface", str(folder / "map.png"), "-o", "out", "--preset", "acdc", *QUICK], "out")


FILES: dict[str, Odd] = {
    "five axes": _nifti((40, 40, 9, 2, 3), data=bytes(40 * 40 * 9 * 6)),
    "five axes, two of one": _nifti((40, 40, 9, 1, 1), data=bytes(40 * 40 * 9)),
    "seven axes": _nifti((4, 4, 4, 2, 2, 2, 2), data=bytes(64 * 16)),
    "an axis of none": _nifti((40, 0, 9)),
    "a negative axis": _nifti((40, -40, 9), data=bytes(40 * 40 * 9)),
    "32767 by 32767 by 32767": _nifti((32767, 32767, 32767)),
    "32767 by 32767 by 32767, packed": _nifti((32767, 32767, 32767), zipped=True),
    "bits": _nifti((40, 40, 9), 1, 1, bytes(1800)),
    "colours": _nifti((40, 40, 9), 128, 24, bytes(43200)),
    "no type": _nifti((40, 40, 9), 0, 0, bytes(14400)),
    "floats of 128 bits": _nifti((40, 40, 9), 1536, 128, bytes(16 * 14400)),
    "empty .nii": _file("map.nii", b""),
    "empty .nii.gz": _file("map.nii.gz", b""),
    "nothing, packed": _file("map.nii.gz", gzip.compress(b"")),
    "empty .nrrd": _file("map.nrrd", b""),
    "empty .seg.nrrd": _file("map.seg.nrrd", b""),
    "empty .mha": _file("map.mha", b""),
    "empty .mhd": _file("map.mhd", b""),
    "empty .dcm": _file("map.dcm", b""),
    "text as .nii": _file("map.nii", "a heart\n" * 200),
    "text as .nii.gz": _file("map.nii.gz", "a heart\n" * 200),
    "no ending": _file("map", b"\0" * 400),
    "another ending": _file("map.stl", "solid\nendsolid\n"),
    "NRRD whose data are elsewhere": _file("map.nhdr", _NRRD.format("data file: /dev/zero")),
    "NRRD whose data are itself": _file("map.nhdr", _NRRD.format("data file: map.nhdr")),
    "NRRD whose data are a list": _file("map.nhdr", _NRRD.format("data file: LIST\na\nb")),
    "NRRD whose data are a pattern": _file("map.nhdr", _NRRD.format("data file: %9999999d 1 999999999 1")),
    "NRRD of sizes beyond all": _file("map.nrrd", _NRRD.replace("40 40 9", "99999999 99999999 99999999").format("")),
    "NRRD of negative sizes": _file("map.nrrd", _NRRD.replace("40 40 9", "-40 -40 9").format("")),
    "NRRD of spacings that are not a number": _file("map.nrrd", _NRRD.replace("2 2 8", "nan nan 8").format("")),
    "NRRD, blocks": _file("map.nrrd", _NRRD.replace("uint8", "block").format("block size: 999999999")),
    "NRRD, text": _file("map.nrrd", _NRRD.replace("raw", "ascii").format("") + "3 " * 14400),
    "MetaImage of a folder": _file("map.mhd", _MHD.format("ElementDataFile = .")),
    "MetaImage of itself": _file("map.mhd", _MHD.format("ElementDataFile = map.mhd")),
    "MetaImage of what never ends": _file("map.mhd", _MHD.format("ElementDataFile = /dev/zero")),
    "MetaImage of nothing": _file("map.mhd", _MHD.format("ElementDataFile = none.raw")),
    "MetaImage of a list": _file("map.mhd", _MHD.format("ElementDataFile = LIST\na.raw\nb.raw")),
    "MetaImage of a pattern": _file("map.mhd", _MHD.format("ElementDataFile = a%999999d.raw 1 99999999 1")),
    "MetaImage, packed": _file("map.mhd", _MHD.format("CompressedData = True\nElementDataFile = map.mhd")),
    "MetaImage of zero spacing": _file("map.mha", _MHD.replace("2 2 8", "0 0 0").format("ElementDataFile = LOCAL")),
    "MetaImage of no axes": _file("map.mha", _MHD.replace("NDims = 3", "NDims = 0").format("ElementDataFile = LOCAL")),
    "vectors": _vector,
    "complex numbers": _complex,
    "gzip in parts": _members,
    "a picture": _png,
}
