"""The same heart, stored another way, gives the same answer: the same surfaces to rounding, or the same refusal.

Turned, mirrored and shifted hearts are the same up to that motion; labels, data types, padding, the order of axes and
compression of a file are no part of a heart at all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk

import femprep as fp
from femprep.model.stages import Stages
from femprep.options import Options
from femprep.phantoms import biventricular
from femprep.pipeline import begin, fit_surfaces

OPTIONS = Options(preset="acdc", surface={"vertices": 300})
OBJECTS = {"lv": ("lv",)}
STRUCTURES = {"rv": 1, "myo": 2, "lv": 3}
#: Agreement of surfaces, mm: files hold places in single precision, and rounding grows in the fit.
CLOSE = 1e-3


@pytest.fixture(scope="module")
def heart() -> fp.Segmentation:
    """Both ventricles, oblique, so that no axis is a special one."""
    turn = _rotation((0.3, -0.2, 0.5))
    return biventricular().moved(rotation=turn, origin=(10.0, -35.0, 60.0)).segmentation((2.5, 2.5, 8.0))


@pytest.fixture(scope="module")
def surface(heart: fp.Segmentation) -> fp.Surface:
    return _fitted(heart)


def _rotation(angles: tuple[float, float, float]) -> np.ndarray:
    turn = np.eye(3)
    for axis, angle in enumerate(angles):
        c, s = np.cos(angle), np.sin(angle)
        a, b = [n for n in range(3) if n != axis]
        one = np.eye(3)
        one[a, a], one[a, b], one[b, a], one[b, b] = c, -s, s, c
        turn = one @ turn
    return turn


def _fitted(seg: fp.Segmentation, objects: dict[str, tuple[str, ...]] = OBJECTS) -> fp.Surface:
    return next(iter(fit_surfaces(seg, objects, OPTIONS).surfaces.values()))


def _stored(seg: fp.Segmentation, order: tuple[int, ...], flipped: tuple[int, ...]) -> fp.Segmentation:
    """The same voxels at the same places, stored along other axes."""
    grid, labels = seg.grid, np.flip(np.transpose(seg.labels, order), flipped)
    direction = np.array(grid.direction)[:, order]
    corner = np.zeros(3)
    for axis in flipped:
        corner[order[axis]] = grid.shape[order[axis]] - 1
        direction[:, axis] *= -1.0
    origin = grid.to_world(corner[None])[0]
    return fp.Segmentation(
        np.ascontiguousarray(labels),
        fp.Grid(labels.shape, np.array(grid.spacing)[list(order)], origin, direction),
        seg.structures,
    )


def _padded(seg: fp.Segmentation, low: tuple[int, int, int], high: tuple[int, int, int]) -> fp.Segmentation:
    labels = np.pad(seg.labels, list(zip(low, high, strict=True)))
    origin = seg.grid.to_world(-np.array([low], dtype=float))[0]
    grid = fp.Grid(labels.shape, seg.grid.spacing, origin, seg.grid.direction)
    return fp.Segmentation(labels, grid, seg.structures)


def _cropped(seg: fp.Segmentation) -> fp.Segmentation:
    used = np.argwhere(seg.labels > 0)
    low, high = used.min(axis=0), used.max(axis=0) + 1
    labels = seg.labels[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
    grid = fp.Grid(labels.shape, seg.grid.spacing, seg.grid.to_world(low[None].astype(float))[0], seg.grid.direction)
    return fp.Segmentation(np.array(labels), grid, seg.structures)


def _renumbered(seg: fp.Segmentation, numbers: dict[str, int]) -> fp.Segmentation:
    labels = np.zeros(seg.labels.shape, dtype=np.int32)
    for name, number in numbers.items():
        labels[seg.mask(name)] = number
    return fp.Segmentation(labels, seg.grid, {name: (number,) for name, number in numbers.items()})


#: A fit is done along the axes of the image, in their order and sense, and its decisions follow them.
TURNED: dict[str, Callable[[fp.Segmentation], fp.Segmentation]] = {
    "stored along other axes": lambda seg: _stored(seg, (2, 0, 1), ()),
    "stored backwards": lambda seg: _stored(seg, (0, 1, 2), (0, 2)),
    "stored along other axes, backwards": lambda seg: _stored(seg, (1, 2, 0), (1,)),
}
SAME: dict[str, Callable[[fp.Segmentation], fp.Segmentation]] = {
    "padded": lambda seg: _padded(seg, (3, 0, 2), (0, 7, 1)),
    "cropped": _cropped,
    "other numbers": lambda seg: _renumbered(seg, {"rv": 700, "myo": 50000, "lv": 4}),
}


@pytest.mark.parametrize("way", SAME)
def test_stored_another_way(heart: fp.Segmentation, surface: fp.Surface, way: str) -> None:
    other = _fitted(SAME[way](heart))
    assert np.array_equal(other.triangles, surface.triangles)
    assert np.abs(other.points - surface.points).max() < 1e-6


@pytest.mark.parametrize("way", TURNED)
def test_stored_along_other_axes(heart: fp.Segmentation, surface: fp.Surface, way: str) -> None:
    """Within a twentieth of a pixel in the mean, and a third of one at most: not yet to rounding."""
    found = fp.compare_surfaces(_fitted(TURNED[way](heart)), surface).distance
    assert found.mean < 0.05 * 2.5
    assert found.max < 0.33 * 2.5


@pytest.mark.parametrize("kind", ["turned", "shifted far away"])
def test_moved(heart: fp.Segmentation, surface: fp.Surface, kind: str) -> None:
    turn = _rotation((1.1, 0.4, -2.0)) if kind == "turned" else np.eye(3)
    shift = np.array([5.0, 0.0, -3.0]) if kind == "turned" else np.array([2000.0, -1500.0, 800.0])
    grid = fp.Grid(
        heart.grid.shape, heart.grid.spacing, turn @ heart.grid.origin + shift, turn @ np.array(heart.grid.direction)
    )
    other = _fitted(fp.Segmentation(heart.labels, grid, heart.structures))
    assert np.array_equal(other.triangles, surface.triangles)
    assert np.abs(other.points - (surface.points @ turn.T + shift)).max() < 1e-6


def test_mirrored_is_a_mirrored_surface(heart: fp.Segmentation, surface: fp.Surface) -> None:
    """Vertices are numbered by the side of the right ventricle, so that the two are compared as bodies."""
    mirror = np.diag([-1.0, 1.0, 1.0])
    grid = fp.Grid(
        heart.grid.shape, heart.grid.spacing, mirror @ heart.grid.origin, mirror @ np.array(heart.grid.direction)
    )
    other = _fitted(fp.Segmentation(heart.labels, grid, heart.structures))
    assert other.volume > 0.0
    assert abs(other.volume / surface.volume - 1.0) < 2e-3
    back = replace(other, points=other.points @ mirror, cells=other.cells[:, ::-1])
    assert fp.compare_surfaces(back, surface).distance.mean < 0.1


@pytest.mark.parametrize("ending", [".nii", ".nii.gz", ".nrrd", ".mha", ".mhd"])
@pytest.mark.parametrize("kind", [sitk.sitkUInt8, sitk.sitkInt16, sitk.sitkFloat32, sitk.sitkFloat64])
def test_files_of_any_kind_hold_the_same_map(heart: fp.Segmentation, tmp_path: Path, ending: str, kind: int) -> None:
    if ending != ".nii" and kind == sitk.sitkFloat64:
        pytest.skip("one format shows it")
    path = tmp_path / f"heart{ending}"
    image = sitk.Cast(sitk.GetImageFromArray(np.ascontiguousarray(heart.labels.T)), kind)
    image.SetSpacing(heart.grid.spacing.tolist())
    image.SetOrigin(heart.grid.origin.tolist())
    image.SetDirection(np.array(heart.grid.direction).ravel().tolist())
    for compressed in (True, False):
        sitk.WriteImage(image, str(path), useCompression=compressed)
        found = fp.read_segmentation(path, structures=STRUCTURES)
        assert np.array_equal(found.labels, heart.labels)
        corners = np.array([[0, 0, 0], np.array(heart.grid.shape) - 1], dtype=float)
        assert np.abs(found.grid.to_world(corners) - heart.grid.to_world(corners)).max() < CLOSE


REFUSED: dict[str, Callable[[np.ndarray], None]] = {
    "an empty slice": lambda labels: labels.__setitem__((..., 8), 0),
    "no cavity": lambda labels: labels.__setitem__(labels == 3, 0),
    "no wall": lambda labels: labels.__setitem__(labels == 2, 0),
}


@pytest.mark.parametrize("damage", REFUSED)
def test_refused_for_the_same_reason(heart: fp.Segmentation, damage: str) -> None:
    labels = np.array(heart.labels)
    REFUSED[damage](labels)
    broken = fp.Segmentation(labels, heart.grid, heart.structures)

    def reason(seg: fp.Segmentation) -> tuple[type[Exception], str]:
        with pytest.raises(fp.FemprepError) as caught:
            begin(seg, OPTIONS, Stages(None))
        words = "".join(c for c in str(caught.value) if not c.isdigit())
        return caught.type, words.split("(axis")[0].split(" near ")[0]

    expected = reason(broken)
    for change in (TURNED["stored along other axes"], SAME["padded"]):
        assert reason(change(broken)) == expected


@pytest.mark.slow
@pytest.mark.data
@pytest.mark.parametrize("case", ["patient007/patient007_frame01", "patient021/patient021_frame13"])
def test_real_maps_stored_another_way(data: Path, case: str) -> None:
    seg = fp.read_segmentation(data / "acdc" / "training" / f"{case}_gt.nii.gz", structures=STRUCTURES)
    for objects in ({"lv": ("lv",)}, {"epi": ("lv", "myo")}):
        plain = _fitted(seg, objects)
        for way, change in SAME.items():
            other = _fitted(change(seg), objects)
            assert np.abs(other.points - plain.points).max() < 1e-6, way
