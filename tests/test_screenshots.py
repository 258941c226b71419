"""Pictures of the pages for the documentation, taken in a browser of phantoms alone.

``FEMPREP_SCREENSHOTS=docs/images pytest -m slow tests/test_screenshots.py`` keeps them.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import browser
import cohorts
import numpy as np
import pytest
from greys import cine, write_image

import femprep as fp
from femprep.phantoms import lv_ellipsoid

pytestmark = pytest.mark.slow
pytest.importorskip("distributed", reason="a cohort runs on dask.distributed")

VIEW = "window.femprepView"
#: A picture is no larger, so that the repository stays small, bytes; and no smaller, so that something is on it.
_MOST, _LEAST = 150_000, 20_000
OPTIONS = ("--preset", "acdc", "--edge-length", "5", "--vertices", "300", "--fibres", "--mesher", "sweep")
#: Radius of the cavity and thickness of the wall of each heart; the last is dilated.
HEARTS = [*((22.0 + 0.7 * (k * 5 % 7), 8.0 + 0.3 * (k % 4)) for k in range(7)), (36.0, 8.5)]


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where pictures are kept."""
    kept = os.environ.get("FEMPREP_SCREENSHOTS")
    folder = Path(kept) if kept else tmp_path_factory.mktemp("pictures")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def write(folder: Path, name: str, radius: float, wall: float) -> fp.Segmentation:
    """The label map of a phantom, and its image."""
    long = 34.0 + radius
    heart = lv_ellipsoid((radius, radius, long), (radius + wall, radius + wall, long + wall))
    seg = heart.segmentation(spacing=(1.6, 1.6, 8.0))
    fp.write_segmentation(seg, folder / f"{name}.nii.gz")
    write_image(cine(seg, noise=0.0, blur=0.8), folder / f"{name}-cine.nii.gz")
    return seg


@pytest.fixture(scope="module")
def cohort(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a cohort of hearts at end-diastole, one of them dilated, and one of which a slice is not labelled."""
    source = tmp_path_factory.mktemp("hearts")
    lines = ["subject\timage\tintensity_image"]
    for number, (radius, wall) in enumerate(HEARTS, start=1):
        name = f"heart{number:02d}"
        seg = write(source, name, radius, wall)
        lines.append(f"{name}\t{name}.nii.gz\t{name}-cine.nii.gz")
    # Of the last one a slice in the middle is not labelled.
    labels = np.array(seg.labels)
    labels[..., labels.shape[2] // 2] = 0
    fp.write_segmentation(replace(seg, labels=labels), source / "heart09.nii.gz")
    lines.append("heart09\theart09.nii.gz\tn/a")
    (source / "subjects.tsv").write_text("\n".join(lines) + "\n")
    out = tmp_path_factory.mktemp("cohort") / "hearts"
    done = cohorts.run(source / "subjects.tsv", out, options=OPTIONS)
    assert done.returncode == 1, done.stderr
    return out


@pytest.fixture(scope="module")
def beat(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a sequence of five phases of one heart."""
    phases = []
    for turn in np.linspace(0.0, 2.0 * np.pi, 5, endpoint=False):
        share = 0.5 - 0.5 * np.cos(turn)
        radius, wall = 25.0 - 7.0 * share, 9.0 + 3.2 * share
        heart = lv_ellipsoid((radius, radius, 60.0 - 5.0 * share), (radius + wall, radius + wall, 69.0 - 3.0 * share))
        phases.append(heart.segmentation(spacing=(1.6, 1.6, 8.0)))
    options = {"surface": {"vertices": 300}, "volume": {"edge_length": 6.0}, "fibres": {}}
    found = fp.mesh_sequence(phases, **options, times=[0.0, 160.0, 320.0, 480.0, 640.0])
    out = tmp_path_factory.mktemp("beat") / "out"
    fp.write_sequence(found, out, images=[cine(one, noise=0.0, blur=0.8) for one in phases])
    return out


def taken(page: Any, path: Path, top: str, height: int) -> None:
    """Take a picture from an element on, and look whether something is on it."""
    page.mouse.move(0, 0)
    page.evaluate("document.activeElement.blur()")
    page.wait_for_timeout(300)
    page.evaluate("document.querySelector('nav').style.position = 'static'")
    y = page.locator(top).bounding_box()["y"] + page.evaluate("window.scrollY")
    width = page.viewport_size["width"]
    page.screenshot(path=path, full_page=True, clip={"x": 0, "y": y, "width": width, "height": height})
    assert _LEAST < path.stat().st_size < _MOST, path


@pytest.fixture
def heart(cohort: Path) -> Iterator[Any]:
    with browser.opened(cohort / "heart03" / "report.html", width=1000) as page:
        page.wait_for_function(f"{VIEW} && {VIEW}.state.shown > 0")
        yield page


def test_view_of_a_heart(heart: Any, pictures: Path) -> None:
    heart.select_option("#cut", "0")
    heart.select_option("#colour", label="AHA segment")
    heart.check("#fibres")
    heart.uncheck("#edges")
    taken(heart, pictures / "heart-view.png", "h1", 800)


def test_worst_elements_of_a_heart(heart: Any, pictures: Path) -> None:
    heart.check("#worst")
    taken(heart, pictures / "heart-worst.png", "#view", 660)


def test_data_of_a_heart(heart: Any, pictures: Path) -> None:
    assert heart.locator("svg image").count() >= 13  # eleven slices and two cuts along the long axis, on the image
    heart.evaluate("document.body.style.zoom = 0.8")
    taken(heart, pictures / "heart-data.png", "#data", 960)


def test_checks_of_a_heart(heart: Any, pictures: Path) -> None:
    assert "smallest dihedral angle" in heart.locator("body").inner_text()
    taken(heart, pictures / "heart-checks.png", "#checks", 800)


def test_page_of_a_cohort(cohort: Path, pictures: Path) -> None:
    with browser.opened(cohort / "cohort.html", width=1250) as page:
        page.wait_for_selector(".tabulator-row")
        assert page.locator("#outliers ~ table tr", has_text="heart08").count() > 0
        taken(page, pictures / "cohort.png", "h1", 1120)
        taken(page, pictures / "cohort-distributions.png", "#distributions", 760)
        taken(page, pictures / "cohort-pictures.png", "#pictures", 480)


def test_page_of_a_sequence(beat: Path, pictures: Path) -> None:
    with browser.opened(beat / "report.html", width=1000) as page:
        page.wait_for_function(f"{VIEW} && {VIEW}.state.shown > 0")
        page.select_option("#cut", "0")
        page.select_option("#colour", label="wall thickness, mm")
        page.locator("#phase").fill("2")
        assert page.locator("#phase").input_value() == "2"
        assert "ejection fraction" in page.locator("body").inner_text()
        taken(page, pictures / "sequence-view.png", "h1", 810)
        taken(page, pictures / "sequence-volumes.png", "#volumes", 1080)
