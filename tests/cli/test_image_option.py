"""``--image``: what is given is checked before any work, shown on the page, and told in the record."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import SimpleITK as sitk
from greys import cine, linear, write_image

import femprep as fp
from femprep.cli import main
from femprep.image import Grid
from femprep.phantoms import lv_ellipsoid

SIZES = ["--preset", "acdc", "--mesher", "sweep", "--edge-length", "8", "--vertices", "300", "--quiet"]


@pytest.fixture(scope="module")
def maps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A label map, its image, one of another grid that reaches half of it, and one of three frames."""
    folder = tmp_path_factory.mktemp("maps")
    seg = lv_ellipsoid().segmentation(spacing=(2.0, 2.0, 8.0))
    fp.write_segmentation(seg, folder / "gt.nii.gz")
    write_image(cine(seg), folder / "cine.nii.gz")
    write_image(
        linear(Grid((60, 60, 30), (1.5, 1.5, 4.0), (0.0, -45.0, -80.0), seg.grid.direction)), folder / "half.nrrd"
    )
    far = Grid((9, 9, 9), (1.0, 1.0, 1.0), (500.0, 0.0, 0.0), seg.grid.direction)
    write_image(linear(far), folder / "far.nii.gz")
    beat = sitk.JoinSeries([sitk.ReadImage(str(folder / "cine.nii.gz"))] * 3)
    sitk.WriteImage(beat, str(folder / "several.nii.gz"))
    return folder


def run(maps: Path, out: Path, *more: str) -> int:
    return main(["mesh", str(maps / "gt.nii.gz"), "-o", str(out), *SIZES, *more])


@pytest.mark.slow
def test_image_stands_on_the_page_and_in_the_record(maps: Path, tmp_path: Path) -> None:
    assert run(maps, tmp_path / "out", "--image", str(maps / "cine.nii.gz")) in (0, 1)
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    assert record["image"]["path"] == "cine.nii.gz"
    assert re.fullmatch("[0-9a-f]{64}", record["image"]["sha256"])
    assert (record["image"]["resampled"], record["image"]["covered_percent"]) == (False, 100.0)
    page = (tmp_path / "out" / "report.html").read_text()
    assert page.count('aria-label="slice') == page.count('<svg class="lit"') - 2
    assert page.count("data:image/png;base64,") >= 2 * 2 + page.count('aria-label="slice')
    assert record["image"]["sha256"] in page


@pytest.mark.slow
def test_what_the_image_does_not_reach_is_told(maps: Path, tmp_path: Path) -> None:
    assert run(maps, tmp_path / "out", "--image", str(maps / "half.nrrd")) in (0, 1)
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    assert record["image"]["resampled"]
    assert 40.0 < record["image"]["covered_percent"] < 60.0
    told = [line for line in record["notices"] if "beyond the image" in line]
    assert len(told) == 1
    assert told[0].startswith(f"{100 - record['image']['covered_percent']:.0f} % of the labelled voxels")


@pytest.mark.parametrize(("more", "words"), [
    (["--image", "cine.nii.gz", "--image", "half.nrrd"], "--image is given 2 times; one is needed"),
    (["--image", "far.nii.gz"], "does not meet the labels"),
    (["--image", "none.nii.gz"], "none.nii.gz"),
    (["--image", "several.nii.gz"], "of --image FILE:N, counted from 1"),
    (["--image", "cine.nii.gz:3"], "has no frame 3, it holds 1"),
    (["--image", "cine.nii.gz", "--flip"], "mirror both files first"),
])  # fmt: skip
def test_wrong_images_are_one_line_and_make_nothing(
    maps: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], more: list[str], words: str
) -> None:
    given = [str(maps / one) if one[0] != "-" else one for one in more]
    assert run(maps, tmp_path / "out", *given) == 2
    said = capfd.readouterr().err
    assert words in said
    assert said.count("\n") == 1
    assert not (tmp_path / "out").exists()
