"""``--contours``: alone in place of a label map, beside one, and what it is refused with."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drawn_hearts import drawn, phantom

import femprep as fp
from femprep.cli import main

COARSE = ["--vertices", "300", "--quiet"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Contours of a phantom, the same without long-axis planes, and its label map."""
    folder = tmp_path_factory.mktemp("contours")
    made = drawn()
    made.save(folder / "heart.json")
    short = {plane.name for plane in made.planes if plane.short_axis}
    replace(made, contours=[one for one in made.contours if one.plane in short]).save(folder / "stack.json")
    fp.write_segmentation(phantom().segmentation(spacing=(1.4, 1.4, 9.0)), folder / "gt.nii.gz")
    return folder


def test_a_surface_from_contours_alone_lies_on_the_phantom(folder, tmp_path):
    status = main(["surface", "--contours", str(folder / "heart.json"), "-o", str(tmp_path / "out"), "--object", "lv"])
    assert status == 0
    surface = fp.read_surface(tmp_path / "out" / "surfaces" / "lv.vtp")
    heart = phantom()
    below = surface.points[heart.height(surface.points) < 12.0]
    assert np.abs(heart.distance("lv", below)).mean() < 0.3
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    assert record["input"]["path"].endswith("heart.json")


def test_long_axis_contours_are_added_to_a_label_map(folder, tmp_path):
    seg = fp.read_segmentation(folder / "gt.nii.gz", preset="acdc", contours=(str(folder / "heart.json"),))
    assert [view.name for view in seg.views] == ["2CH", "3CH", "4CH"]
    with pytest.raises(fp.InputError, match="no long-axis contours"):
        fp.read_segmentation(folder / "gt.nii.gz", preset="acdc", contours=(str(folder / "stack.json"),))


@pytest.mark.parametrize(
    ("more", "word"),
    [
        (["--contours", "{0}/heart.json", "--preset", "acdc"], "preset"),
        (["--contours", "{0}/*.json"], "2 files"),
        (["--contours", "{0}/none*.json"], "no file matches"),
        (["--contours", "{0}/gt.nii.gz"], "no file of contours"),
        (["--contours", "{0}/heart.json", "--sequence"], "several"),
        (["--contours", "{0}/heart.json:lv=LV"], "fixed names"),
        (["--contours", "{0}/heart.json", "--mask", "lv={0}/gt.nii.gz"], "masks"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(folder, tmp_path, capsys, more, word):
    out = tmp_path / "out"
    assert main(["mesh", "-o", str(out), *COARSE, *(item.format(folder) for item in more)]) == 2
    message = capsys.readouterr().err
    assert word in message
    assert not out.exists()


@pytest.mark.slow
@pytest.mark.parametrize("anatomy", ["lv", "biv"])
def test_contours_alone_make_a_heart(folder, tmp_path, anatomy):
    out = tmp_path / "out"
    sizes = ["--anatomy", anatomy, "--edge-length", "4", "--quiet"]
    assert main(["mesh", "--contours", str(folder / "heart.json"), "-o", str(out), *sizes]) == 0
    found = {path.stem for path in (out / "cavities").glob("*.vtp")}
    assert found == ({"lv"} if anatomy == "lv" else {"lv", "rv"})
