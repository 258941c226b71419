"""The folder of an annotated mesh: a page with the view of its names, and a methods paragraph with its references."""

from __future__ import annotations

import json
import re
from datetime import datetime
from pathlib import Path

import browser
import pytest
from meshes import truncated_ellipsoid

import femprep as fp
from femprep.anatomy.aha import SEGMENTS

pytest.importorskip("jinja2")
VIEW = "window.femprepView"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    mesh = truncated_ellipsoid("tetra", heights=8, around=24, layers=3)
    out = tmp_path_factory.mktemp("annotated") / "out"
    options = {"formats": ("abaqus",), "export": {"step": "inflation", "pressure": 2.0}}
    fp.write_annotation(fp.annotate(mesh, **options), out, source="heart.vtu", command="femprep annotate heart.vtu")
    return out


def test_paragraph_holds_names_elements_fibres_and_step(folder: Path) -> None:
    text, bib = (folder / "methods.md").read_text(), (folder / "methods.bib").read_text()
    for words in ("heart.vtu", "the epicardium (", "four-node (linear) tetrahedra", "helix angle", "2 kPa"):
        assert words in text
    assert set(re.findall(r"@(\w+)", text)) == set(re.findall(r"^@\w+\{(\w+),", bib, re.M))
    assert "helix angle" in (folder / "report.html").read_text()


def test_record_holds_command_date_and_thickness_by_segment(folder: Path) -> None:
    record, quality = (json.loads((folder / name).read_text()) for name in ("run.json", "quality.json"))
    assert record["command"] == "femprep annotate heart.vtu"
    assert datetime.fromisoformat(record["date"]).tzinfo is not None
    assert list(record["thickness_mm"]) == [SEGMENTS[number] for number in range(1, 18)]
    assert record["thickness_mm"] == quality["thickness_mm"]
    assert {"methods.md", "methods.bib"} <= set(record["files"])


@pytest.mark.slow
def test_view_shows_the_names(folder: Path) -> None:
    with browser.opened(folder / "report.html") as page:
        page.wait_for_function(f"{VIEW} && {VIEW}.state.shown > 0")
        legend = page.locator("#legend").inner_text()
        assert all(name in legend for name in ("endo", "epi", "base"))
        page.select_option("#colour", label="region")
        assert "lv" in page.locator("#legend").inner_text()
