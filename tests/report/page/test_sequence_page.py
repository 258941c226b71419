"""The page of a moving heart: its curve, its table, its bull's eyes, and a view whose points go with the slider."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import browser
import numpy as np
import pytest
from greys import cine

import femprep as fp
from femprep.phantoms import lv_ellipsoid
from femprep.report.manifest import PhaseRecord
from femprep.report.page.sequence import _chart, _round_marks
from femprep.report.pictures.scene import _spread

VIEW = "window.femprepView"
#: Radius of the cavity and thickness of the wall in each phase; the third is end-systole.
SHAPES = ((25.0, 9.0), (21.0, 10.5), (18.0, 12.0), (23.0, 9.5))


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    phases = []
    for radius, wall in SHAPES:
        heart = lv_ellipsoid((radius, radius, radius + 33.0), (radius + wall, radius + wall, radius + 33.0 + wall))
        phases.append(heart.segmentation(spacing=(1.4, 1.4, 8.0)))
    options = {"surface": {"vertices": 300}, "volume": {"edge_length": 6.0}, "fibres": {}}
    found = fp.mesh_sequence(phases, **options)
    out = tmp_path_factory.mktemp("moving") / "out"
    fp.write_sequence(found, out, images=[cine(one) for one in phases], command="femprep mesh <&>")
    return out


def record(number: int, volume: float) -> PhaseRecord:
    known = {"passed": True, "base_offset_mm": 0.0, "displacement_mean_mm": 0.0, "displacement_maximum_mm": 0.0}
    volumes = {"cavity_ml": volume, "label_cavity_ml": volume + 1.0, "label_total_ml": volume + 5.0}
    return PhaseRecord(name=f"p{number}", time=30.0 * number, **known, **volumes)


def test_curve_stands_at_the_heights_of_its_volumes() -> None:
    volumes = [120.0, 60.0, 30.0, 90.0]
    root = ElementTree.fromstring(_chart([record(k, value) for k, value in enumerate(volumes)]))
    dots = [one for one in root.iter("circle") if ", mesh:" in one[0].text]
    height = np.array([float(one.get("cy")) for one in dots])
    place = np.array([float(one.get("cx")) for one in dots])
    assert np.ptp(np.diff(place)) < 0.2
    slope = np.diff(height) / np.diff(volumes)
    assert np.allclose(slope, slope[0], rtol=1e-2)
    marks = [text.text for text in root.iter("text")]
    assert {"0", "20", "120", "time", "cavity, mL"} <= set(marks)


def test_names_of_phases_are_escaped() -> None:
    words = '<img src=x onerror="window.taken=1">&'
    phases = [record(k, 50.0 + k).model_copy(update={"name": words}) for k in range(2)]
    titles = [one.text for one in ElementTree.fromstring(_chart(phases)).iter("title")]
    assert len(titles) == 4
    assert all(title.startswith(words) for title in titles)


@pytest.mark.parametrize("top", [0.3, 7.0, 95.0, 101.0, 310.0])
def test_scale_begins_at_nothing_and_reaches_above_the_greatest(top: float) -> None:
    marks = _round_marks(top)
    assert marks[0] == 0.0
    assert marks[-2] < top <= marks[-1]
    assert 4 <= len(marks) <= 10


def test_of_many_phases_some_are_shown_with_the_first_among_them() -> None:
    assert _spread(4, 9, 0) == [0, 1, 2, 3]
    some = _spread(100, 8, 33)
    assert {0, 33, 99} <= set(some)
    assert len(some) <= 8


@pytest.mark.slow
def test_page_tells_volumes_thickening_and_checks_of_each_phase(out: Path) -> None:
    page = (out / "report.html").read_text()
    assert len(page) < 5_000_000
    assert "femprep mesh &lt;&amp;&gt;" in page
    for name in ("000", "001", "002", "003"):
        assert f'href="phases/{name}/report.html"' in page
        assert (out / "phases" / name / "report.html").is_file()
    label = re.search(r'aria-label="thickening, %".*?</svg>', page, re.DOTALL)[0]
    gained = [float(text) for text in re.findall(r'dy="0.12"[^>]*>(-?\d+)<', label)]
    assert len(gained) == 17
    # 9 mm to 12 mm, a third, at the girth.
    assert np.median(gained[:6]) == pytest.approx(33.0, abs=4.0)


@pytest.mark.slow
def test_view_moves_with_the_slider(out: Path) -> None:
    with browser.opened(out / "report.html") as page:
        page.wait_for_function(f"{VIEW} && {VIEW}.state.shown > 0")
        canvas = page.locator("#viewer canvas")
        first = canvas.screenshot()
        slider = page.locator("#phase")
        assert slider.get_attribute("max") == "3"
        page.select_option("#colour", label="wall thickness, mm")
        rest = canvas.screenshot()
        assert rest != first
        slider.fill("2")
        assert page.locator("#phase-name").inner_text() == "002"
        assert canvas.screenshot() != rest
        reach = f"Math.max(...Array.from({{length: {VIEW}.points.length / 3}}, (_, i) => {VIEW}.points[3 * i]))"
        contracted = page.evaluate(reach)
        slider.fill("0")
        assert page.evaluate(reach) - contracted == pytest.approx(34.0 - 30.0, abs=0.5)
        page.click("#play")
        page.wait_for_function(f"{VIEW}.state.phase === 3")
        page.click("#play")
        page.check("#worst")
        for link in page.locator("nav a").all():
            assert page.locator(link.get_attribute("href")).count() == 1
        page.locator("a[href='phases/002/report.html']").click()
        page.wait_for_function(f"{VIEW} && {VIEW}.state.shown > 0")


@pytest.mark.slow
def test_layers_under_the_outlines_are_left_out_by_themselves(out: Path) -> None:
    with browser.opened(out / "report.html", width=390, height=800) as page:
        picture = page.locator(".layers svg").nth(5)
        seen = {name: picture.locator(f".{name}") for name in ("image", "labels", "outlines")}
        assert [seen[name].is_visible() for name in seen] == [True, False, True]
        page.check(".show-labels")
        page.uncheck(".show-image")
        page.uncheck(".show-outlines")
        assert [seen[name].is_visible() for name in seen] == [False, True, False]
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
