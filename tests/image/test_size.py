"""Voxel sizes in another unit are said before anything grows with them."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import femprep as fp
from femprep.cli import main
from femprep.image.resample import isotropic
from femprep.image.topology import used_box
from femprep.phantoms import biventricular, four_chambers, lv_ellipsoid

HEARTS: dict[str, tuple[Callable[[], object], str]] = {
    "lv": (lv_ellipsoid, "acdc"),
    "biv": (biventricular, "acdc"),
    "whole-heart": (four_chambers, "rodero"),
}


def scaled(seg: fp.Segmentation, factor: float | tuple[float, float, float]) -> fp.Segmentation:
    return replace(seg, grid=replace(seg.grid, spacing=seg.grid.spacing * factor))


@pytest.mark.parametrize("anatomy", HEARTS)
@pytest.mark.parametrize("factor", [1000.0, 0.001])
@pytest.mark.parametrize("mesher", ["tetwild", "sweep"])
def test_voxels_a_thousand_times_too_large_or_small(
    anatomy: str, factor: float, mesher: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if mesher == "sweep" and anatomy != "lv":
        pytest.skip("the sweep meshes the left ventricle alone")
    make, preset = HEARTS[anatomy]
    path, out = tmp_path / "heart.nrrd", tmp_path / "out"
    fp.write_segmentation(scaled(make().segmentation((4.0, 4.0, 8.0)), factor), path)
    start = time.process_time()
    status = main(
        ["mesh", str(path), "-o", str(out), "--preset", preset, "--anatomy", anatomy, "--mesher", mesher, "-q"]
    )
    said = capsys.readouterr().err
    assert status == 2
    assert said.count("\n") == 1
    assert "mL by voxels of" in said
    assert "--spacing" in said
    assert not out.exists()
    assert time.process_time() - start < 20.0  # where it was not said, it did not end within 240 s


@pytest.mark.parametrize("factor", [1000.0, 0.001, 10.0, (1.0, 1.0, 1000.0), (0.001, 1.0, 1.0)])
def test_the_sizes_told_are_those_that_make_it_a_heart(factor: float | tuple[float, float, float]) -> None:
    seg = lv_ellipsoid().segmentation((4.0, 4.0, 8.0))
    with pytest.raises(fp.InputError, match="would make it") as caught:
        fp.fit_surfaces(scaled(seg, factor), {"lv": ("lv",)})
    told = str(caught.value).partition("--spacing ")[2].split()[:3]
    assert [float(size) for size in told] == pytest.approx(seg.grid.spacing)


@pytest.mark.parametrize("factor", [1000.0, 0.001])
def test_surfaces_alone(factor: float) -> None:
    seg = scaled(lv_ellipsoid().segmentation((4.0, 4.0, 8.0)), factor)
    with pytest.raises(fp.InputError, match="nothing of a heart has less than"):
        fp.fit_surfaces(seg, {"lv": ("lv",)})


def test_one_voxel_size_of_another_unit() -> None:
    seg = scaled(lv_ellipsoid().segmentation((4.0, 4.0, 8.0)), (1.0, 1.0, 50.0))
    with pytest.raises(fp.InputError, match=r"fills a box of 48 x 48 x 4e\+03 mm.*which is no heart's"):
        fp.fit_surfaces(seg, {"lv": ("lv",)})


@pytest.mark.parametrize("axis", range(3))
def test_a_heart_ten_times_as_long_as_it_is_wide_is_told_with_the_size_that_is_off(axis: int) -> None:
    """Slices 80 mm apart for 8: 880 mm of heart took 200 s to be swept, or not to be."""
    seg = lv_ellipsoid().segmentation((4.0, 4.0, 8.0))
    factor = tuple(10.0 if number == axis else 1.0 for number in range(3))
    with pytest.raises(
        fp.InputError, match=r"'lv\+myo' fills a box of .*, which is no heart's.*would make it"
    ) as caught:
        fp.mesh_segmentation(scaled(seg, factor))
    told = str(caught.value).partition("--spacing ")[2].split()[:3]
    assert [float(size) for size in told] == pytest.approx(seg.grid.spacing)


@pytest.mark.slow
@pytest.mark.data
def test_no_heart_comes_near_to_being_too_long(data: Path) -> None:
    """What ``THINNEST`` says of ACDC's maps: cavity and wall together, and cavities alone, which are not asked."""
    longest = {"lv": 0.0, "lv+myo": 0.0, "lv+myo+rv": 0.0}
    for path in sorted((data / "acdc" / "training").glob("*/*_gt.nii.gz")):
        seg = fp.read_segmentation(path, preset="acdc")
        for names in longest:
            box = used_box(seg.mask(*names.split("+")))
            sides = np.sort([part.stop - part.start for part in box] * seg.grid.spacing)
            longest[names] = max(longest[names], sides[2] / sides[1])
    assert longest["lv"] == pytest.approx(2.64, abs=0.01)
    assert max(longest["lv+myo"], longest["lv+myo+rv"]) == pytest.approx(1.50, abs=0.01)


@pytest.mark.parametrize(("spacing", "millilitres"), [((0.1, 0.1, 0.2), 0.04), ((8.0, 8.0, 10.0), 4000.0)])
def test_hearts_of_a_mouse_and_of_an_elephant_pass(spacing: tuple[float, ...], millilitres: float) -> None:
    from femprep.image.size import require_heart_size

    labels = np.zeros((40, 40, 40), dtype=np.uint8)
    side = round(float(np.cbrt(millilitres * 1000.0 / np.prod(spacing))))
    labels[:side, :side, :side] = 1
    grid = fp.Grid(labels.shape, np.array(spacing), np.zeros(3), np.eye(3))
    seg = fp.Segmentation(labels, grid, {"lv": (1,)})
    require_heart_size(seg, [("lv",)])
    with pytest.raises(fp.InputError, match="mL"):
        require_heart_size(scaled(seg, 1000.0), [("lv",)])


def test_resampling_says_what_it_would_take() -> None:
    obj = lv_ellipsoid().segmentation((4.0, 4.0, 8.0)).object("lv")
    with pytest.raises(fp.ResourceError, match=r"would take .* voxels of 0.01 mm, more than"):
        isotropic(obj, 0.01)
