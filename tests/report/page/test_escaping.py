"""Names and words of others stand in pages as they are, and run nowhere: file, structures, tags, reasons."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import browser
import numpy as np
import pytest
from second_images import ventricle

import femprep as fp
from femprep.cli import main
from femprep.cohort.records import CohortRecord, SubjectRecord, Timing
from femprep.phantoms import lv_ellipsoid
from femprep.report.page.cohort import cohort_page

pytest.importorskip("jinja2")
#: What runs where it is not escaped, in text, in an attribute and in a script; a file may be called so, too.
WORDS = "<img src=x onerror='window.taken=1'>\"><script>window.taken=1<\\script><b>"


def faults(page: Path, count: int = 1) -> list[str]:
    """What of the words stands in the text of a page as a tag."""
    text = page.read_text()
    assert text.count("&lt;img src=x") + text.count("\\u003cimg src=x") >= count
    return [tag for tag in ("<img src=x", "<script>window.taken", "<b>") if tag in text]


def runs(page: Path) -> bool:
    """Whether the words run in a browser."""
    with browser.opened(page) as shown:
        shown.wait_for_timeout(300)
        return bool(shown.evaluate("window.taken === 1"))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Page of a run on a file, with structures, that are called so."""
    folder = tmp_path_factory.mktemp("run")
    path = folder / f"{WORDS}.nii.gz"
    fp.write_segmentation(lv_ellipsoid().segmentation((2.0, 2.0, 8.0)), path)
    config = folder / "options.toml"
    config.write_text(f"[structures]\n{json.dumps(WORDS)} = [1]\n")
    given = ["--preset", "acdc", "--config", str(config), "--mesher", "sweep", "--edge-length", "8", "-q"]
    status = main(["mesh", str(path), "-o", str(folder / "out"), "--vertices", "300", *given])
    assert status in (0, 1)
    return folder / "out" / "report.html"


@pytest.fixture(scope="module")
def annotated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Page of somebody's mesh whose regions are called so."""
    folder = tmp_path_factory.mktemp("annotated")
    mesh = ventricle("tetra", 3, 2)
    region = np.where(np.arange(mesh.n_cells) % 2, 77, mesh.region).astype(np.int32)
    fp.write_mesh(replace(mesh, region=region, info={"tag_names": {WORDS: 77}}), folder / f"{WORDS}.vtu")
    status = main(["annotate", str(folder / f"{WORDS}.vtu"), "-o", str(folder / "out"), "-q", "--no-fibres"])
    assert status in (0, 1)
    return folder / "out" / "report.html"


@pytest.fixture(scope="module")
def cohort(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Page of a cohort with a heart that was refused in such words."""
    folder = tmp_path_factory.mktemp("cohort")
    known = {"kind": "mesh", "exit_status": 2, "status": "refused", "reason": "image-unreadable"}
    row = SubjectRecord(subject=WORDS, images=[f"{WORDS}.nii.gz"], message=WORDS, **known)
    counts = {"counts": {"refused": 1}, "reasons": {"image-unreadable": 1}}
    record = CohortRecord(options=fp.Options(preset="acdc"), asked=1, subjects=[row], **counts)
    timings = [Timing(subject=WORDS, seconds=3.0).model_dump()]
    text = cohort_page(record.model_dump(mode="json"), timings, [], {}, folder, title=WORDS)
    (folder / "cohort.html").write_text(text)
    return folder / "cohort.html"


@pytest.mark.parametrize("page", ["annotated", "cohort", pytest.param("run", marks=pytest.mark.slow)])
def test_words_are_escaped(page: str, request: pytest.FixtureRequest) -> None:
    assert faults(request.getfixturevalue(page)) == []


@pytest.mark.slow
@pytest.mark.parametrize("page", ["annotated", "cohort", "run"])
def test_words_do_not_run_in_a_browser(page: str, request: pytest.FixtureRequest) -> None:
    assert not runs(request.getfixturevalue(page))


@pytest.mark.slow
def test_what_is_not_escaped_would_be_found(tmp_path: Path) -> None:
    (tmp_path / "page.html").write_text("<html><body><img src='data:,' onerror='window.taken=1'>")
    assert runs(tmp_path / "page.html")
