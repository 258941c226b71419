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
from same_heart import WAYS, moved
from scipy.spatial.transform import Rotation
from slow_params import slow_but

import femprep as fp
from femprep.model.stages import Stages
from femprep.options import Options
from femprep.phantoms import biventricular
from femprep.pipeline import begin, fit_surfaces
from femprep.wall.anatomies import both_ventricles

OPTIONS = Options(preset="acdc", surface={"vertices": 300})
OBJECTS = {"lv": ("lv",)}
STRUCTURES = {"rv": 1, "myo": 2, "lv": 3}
#: Agreement of surfaces, mm: files hold places in single precision, and rounding grows in the fit.
CLOSE = 1e-3
TURN = Rotation.from_euler("xyz", [0.3, -0.2, 0.5]).as_matrix()


@pytest.fixture(scope="module")
def heart() -> fp.Segmentation:
    """Both ventricles, oblique, so that no axis is a special one."""
    return biventricular().moved(rotation=TURN, origin=(10.0, -35.0, 60.0)).segmentation((2.5, 2.5, 8.0))


@pytest.fixture(scope="module")
def surface(heart: fp.Segmentation) -> fp.Surface:
    return _fitted(heart)


def _fitted(seg: fp.Segmentation, objects: dict[str, tuple[str, ...]] = OBJECTS) -> fp.Surface:
    return next(iter(fit_surfaces(seg, objects, OPTIONS).surfaces.values()))


QUICK = ("axes j, k, i, one backwards", "cropped", "another way in all")


@pytest.mark.parametrize("way", slow_but(QUICK, [way for way in WAYS if "I" not in way]))
def test_the_same_surface_to_rounding(heart: fp.Segmentation, surface: fp.Surface, way: str) -> None:
    other = _fitted(WAYS[way].change(heart))
    assert np.array_equal(other.triangles, surface.triangles)
    assert np.abs(WAYS[way].back(other.points) - surface.points).max() < WAYS[way].rounding


@pytest.mark.slow
def test_the_paper_s_surface_is_the_same_as_well(heart: fp.Segmentation) -> None:
    """Without axes of the heart its template is turned by the object's own storage."""
    way = WAYS["another way in all"]
    one, other = (fp.fit_surface(seg.object("rv"), method="paper", vertices=300) for seg in (heart, way.change(heart)))
    assert np.array_equal(other.triangles, one.triangles)
    assert np.abs(way.back(other.points) - one.points).max() < 1e-6


@pytest.mark.parametrize("anatomy", ["lv", "biv"])
@pytest.mark.parametrize("spacing", [pytest.param((2.0, 2.0, 2.0), marks=pytest.mark.slow), (2.5, 2.5, 8.0)])
def test_the_same_planes_and_axes(anatomy: str, spacing: tuple[float, float, float]) -> None:
    """Of cubic voxels as well, which do not tell the stack."""
    heart = biventricular().moved(rotation=TURN).segmentation(spacing)
    options = OPTIONS.model_copy(update={"anatomy": anatomy})
    seg, layout, _ = begin(heart, options, Stages(None))
    assert seg.stack_axis == 2
    assert layout.base is not None
    assert seg.frame is not None
    for name, way in WAYS.items():
        if "I" in name:
            continue
        there, other, _ = begin(way.change(heart), options, Stages(None))
        assert other.base is not None
        assert np.abs(other.base.normal @ way.turn - layout.base.normal).max() < 1e-9, name
        assert abs(layout.base.signed_distance(way.back(other.base.point[None]))[0]) < 1e-9, name
        assert np.abs(way.turn.T @ there.frame - seg.frame).max() < 1e-8, name


@pytest.mark.slow
def test_both_ventricles_are_the_same(heart: fp.Segmentation) -> None:
    """All surfaces a wall is built from; the epicardium is drawn in the world's coordinates and amplifies rounding."""
    options, way = Options(preset="acdc", anatomy="biv", surface={"vertices": 300}), WAYS["another way in all"]
    one, other = (
        both_ventricles(*begin(seg, options, Stages(None))[:2], options, Stages(None)).surfaces
        for seg in (heart, way.change(heart))
    )
    for name, surface in one.items():
        assert np.array_equal(other[name].cells, surface.cells)
        assert np.abs(way.back(other[name].points) - surface.points).max() < 1e-6, name


@pytest.mark.slow
def test_mirrored_is_nearly_a_mirrored_surface(heart: fp.Segmentation, surface: fp.Surface) -> None:
    """Not to rounding: a template has a hand, and is turned to a heart's right ventricle, not mirrored."""
    mirror = np.diag([-1.0, 1.0, 1.0])
    other = _fitted(moved(heart, mirror, np.zeros(3)))
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
    for way in ("axes k, i, j", "padded"):
        assert reason(WAYS[way].change(broken)) == expected


def test_slices_are_told_by_the_numbers_of_the_file(heart: fp.Segmentation) -> None:
    labels = np.array(heart.labels)
    labels[..., 8] = 0
    broken, count = fp.Segmentation(labels, heart.grid, heart.structures), labels.shape[2]
    for seg, words in (
        (broken, "slice 8 holds"),
        (WAYS["slices backwards"].change(broken), f"slice {count - 9} holds"),
        (WAYS["axes k, j, i"].change(broken), r"axis i, \d+ to \d+"),
    ):
        with pytest.raises(fp.InputError, match=words):
            begin(seg, OPTIONS, Stages(None))


@pytest.mark.slow
@pytest.mark.data
@pytest.mark.parametrize("case", ["patient007/patient007_frame01", "patient021/patient021_frame13"])
def test_real_maps_stored_another_way(data: Path, case: str) -> None:
    seg = fp.read_segmentation(data / "acdc" / "training" / f"{case}_gt.nii.gz", structures=STRUCTURES)
    for objects in ({"lv": ("lv",)}, {"epi": ("lv", "myo")}, {"rv": ("rv",)}):
        plain = _fitted(seg, objects)
        for name in ("axes k, j, i", "another way in all", "NIfTI, axes j, i, k"):
            other = _fitted(WAYS[name].change(seg), objects)
            assert np.array_equal(other.triangles, plain.triangles), name
            assert np.abs(WAYS[name].back(other.points) - plain.points).max() < WAYS[name].rounding, name
