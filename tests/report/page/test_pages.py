"""Pages as a person sees them: the view turns, cuts and colours; the table sorts, filters and searches."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import browser
import numpy as np
import pytest
from meshes import truncated_ellipsoid, with_fibres

import femprep as fp
from femprep.cohort.reasons import REASONS
from femprep.cohort.records import CohortRecord, SubjectRecord, Timing
from femprep.options import Options
from femprep.phantoms import lv_ellipsoid
from femprep.report.page.checks import check_lines
from femprep.report.page.cohort import OUTLIER, _pictures, cohort_page, robust_z
from femprep.volume.quality.report import LimitRecord

pytest.importorskip("jinja2")
VIEW = "window.femprepView"


@pytest.fixture(scope="module")
def heart(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Page of a swept phantom with fibres."""
    seg = lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0))
    options = {"surface": {"vertices": 300}, "volume": {"mesher": "sweep", "edge_length": 6.0}, "fibres": {}}
    run = fp.mesh_segmentation(seg, **options)
    out = tmp_path_factory.mktemp("heart") / "out"
    fp.write_run(run, out, command="femprep mesh <&> -o out")
    return out / "report.html"


def picture(page) -> bytes:
    return page.locator("#viewer canvas").screenshot()


@pytest.mark.slow
def test_view_is_turned_cut_and_coloured(heart: Path) -> None:
    with browser.opened(heart) as page:
        page.wait_for_function(f"{VIEW} && {VIEW}.state.shown > 0")
        whole, faces = picture(page), page.evaluate(f"{VIEW}.state.shown")
        box = page.locator("#viewer canvas").bounding_box()
        page.mouse.move(box["x"] + 300, box["y"] + 200)
        page.mouse.down()
        page.mouse.move(box["x"] + 420, box["y"] + 260, steps=4)
        page.mouse.up()
        turned = picture(page)
        assert turned != whole
        page.select_option("#cut", "0")
        cut = picture(page)
        assert cut != turned
        assert page.evaluate(f"{VIEW}.state.shown") != faces
        titles = page.locator("#colour option").all_text_contents()
        assert {"facet tag", "region", "AHA segment", "wall thickness, mm", "mean ratio"} <= set(titles)
        page.select_option("#colour", label="wall thickness, mm")
        assert picture(page) != cut
        assert "wall thickness" in page.locator("#legend").inner_text()
        page.select_option("#cut", "-1")
        page.select_option("#colour", label="AHA segment")
        shown = page.evaluate(f"{VIEW}.state.shown")
        page.locator("#legend button", has_text="17").click()
        assert page.evaluate(f"{VIEW}.state.shown") != shown
        assert page.locator("#legend button", has_text="17").get_attribute("aria-pressed") == "false"
        page.locator("#legend button", has_text="17").click()
        assert page.evaluate(f"{VIEW}.state.shown") == shown
        for name in ("fibres", "worst"):
            before = picture(page)
            page.check(f"#{name}")
            assert picture(page) != before
        page.click("#reset")
        page.locator("[data-place]").first.click()
        assert page.is_checked("#worst")


@pytest.mark.slow
def test_page_of_a_heart_tells_checks_command_and_hash_and_fits_a_phone(heart: Path) -> None:
    text = heart.read_text()
    assert "femprep mesh &lt;&amp;&gt; -o out" in text
    assert len(text) < 5_000_000
    with browser.opened(heart, width=390, height=800) as page:
        assert page.locator("#checks ~ table .light.green").count() > 10
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
        for link in page.locator("nav a").all():
            assert page.locator(link.get_attribute("href")).count() == 1


@pytest.fixture
def cohort(tmp_path: Path) -> Path:
    """Page of twelve hearts that are none, one of them far off, and one that was refused."""
    known = {"kind": "mesh", "images": ["map.nii.gz"]}
    rows = [
        SubjectRecord(
            subject=f"heart{k:02d}", status="meshed", exit_status=0, reason="done", cavity_ml=100.0 + k % 5, **known
        )
        for k in range(12)
    ]
    rows[7] = rows[7].model_copy(update={"cavity_ml": 300.0})
    words = "</script><script>document.title = 'taken'</script>"
    rows.append(
        SubjectRecord(
            subject="none", status="refused", exit_status=2, reason="image-unreadable", message=words, **known
        )
    )
    for row in rows[:-1]:
        (tmp_path / row.subject).mkdir()
        (tmp_path / row.subject / "report.html").write_text('<svg viewBox="0 0 9 9" aria-label="slice 3"></svg>')
    record = CohortRecord(
        options=fp.Options(preset="acdc"),
        asked=13,
        counts={"meshed": 12, "refused": 1},
        reasons={"done": 12, "image-unreadable": 1},
        subjects=rows,
    )
    timings = [Timing(subject=row.subject, seconds=3.0 + 0.1 * k).model_dump() for k, row in enumerate(rows)]
    timings[-1]["seconds"] = 0.01  # refused at once
    reasons = [one._asdict() for one in REASONS if one.code in record.reasons]
    text = cohort_page(record.model_dump(mode="json"), timings, reasons, {}, tmp_path, title="hearts")
    (tmp_path / "cohort.html").write_text(text)
    return tmp_path / "cohort.html"


def test_of_a_heart_that_was_not_made_nobody_knows_what_was_repaired(cohort: Path) -> None:
    rows = json.loads(re.search(r'<script[^>]*id="rows">(.*?)</script>', cohort.read_text(), re.DOTALL)[1])
    found = {row["subject"]: row["repaired"] for row in rows}
    assert found["heart00"] == 0
    assert found["none"] is None


def svg(number: int, size: int = 0) -> str:
    image = f'<g class="image"><image href="data:{"A" * size}"/></g>' if size else ""
    return f'<svg class="lit" viewBox="0 0 9 9" aria-label="slice {number}"><g>{image}<g class="labels"></g></g></svg>'


def test_thumbnail_is_the_middle_slice_of_the_first_phase(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "report.html").write_text("".join(map(svg, (2, 3, 4, 5, 6, 1, 2, 3, 4, 5, 6, 7))))
    rows = [{"subject": "a", "status": "meshed", "_link": "a/report.html"}]
    assert [one["svg"] for one in _pictures(rows, tmp_path)] == [svg(4)]


def test_images_that_are_too_many_for_a_page_are_left_out_of_its_thumbnails(tmp_path: Path) -> None:
    rows = [{"subject": f"h{k}", "status": "meshed", "_link": f"h{k}/report.html"} for k in range(40)]
    for row in rows:
        (tmp_path / row["subject"]).mkdir()
        (tmp_path / row["subject"] / "report.html").write_text(svg(3, 100_000))
    assert all("<image" in one["svg"] for one in _pictures(rows[:30], tmp_path))
    many = _pictures(rows, tmp_path)
    assert len(many) == 40
    assert not any("<image" in one["svg"] or "lit" in one["svg"] for one in many)
    assert all('class="labels"' in one["svg"] for one in many)


def test_what_a_refused_heart_took_is_no_outlier(cohort: Path) -> None:
    rows = json.loads(re.search(r'<script[^>]*id="rows">(.*?)</script>', cohort.read_text(), re.DOTALL)[1])
    assert {row["subject"]: row["_out"] for row in rows if row["_out"]} == {"heart07": ["cavity_ml"]}


def names(page) -> list[str]:
    return page.locator(".tabulator-row .tabulator-cell[tabulator-field=subject]").all_text_contents()


@pytest.mark.slow
def test_table_of_a_cohort_is_sorted_filtered_and_searched(cohort: Path) -> None:
    with browser.opened(cohort) as page:
        page.wait_for_selector(".tabulator-row")
        assert page.title() == "hearts - femprep cohort"
        head = page.locator(".tabulator-col[tabulator-field=cavity_ml] .tabulator-col-title")
        head.click()
        head.click()
        assert names(page)[0] == "heart07"
        page.fill("#search", "unreadable")
        page.wait_for_function("document.querySelectorAll('.tabulator-row').length === 1")
        assert names(page) == ["none"]
        page.click("#all")
        page.locator(".tabulator-col[tabulator-field=cavity_ml] input").press_sequentially("> 200")
        page.wait_for_function("document.querySelectorAll('.tabulator-row').length === 1")
        assert names(page) == ["heart07"]
        page.click("#all")
        page.click("a.only[data-reason='image-unreadable']")
        page.wait_for_function("document.querySelectorAll('.tabulator-row').length === 1")
        assert names(page) == ["none"]
        assert page.locator("#outliers ~ table tr", has_text="heart07").count() == 1
        assert page.locator("circle.out").count() == 1
        page.locator("svg a:has(circle.out)").first.click()
        assert page.url.endswith("/heart07/report.html")


def test_robust_z_is_that_of_a_normal_distribution_and_of_no_few() -> None:
    values = np.random.default_rng(1).normal(50.0, 4.0, 20_001)
    assert abs(robust_z(np.append(values, 50.0 + 4.0 * OUTLIER))[-1] - OUTLIER) < 0.1
    assert not robust_z(np.array([1.0, 2.0, 3.0, 99.0])).any()
    assert not robust_z(np.array([1.0, 1.0, 1.0, 1.0, 1.0, 99.0])).any()
    assert robust_z(np.array([1.0, np.nan, 2.0, 3.0, 4.0, 5.0]))[1] == 0.0


def test_lights_of_checks() -> None:
    def line(value: float, passed: bool) -> LimitRecord:
        return LimitRecord(name="minimum_dihedral", kind="at least", limit=10.0, value=value, passed=passed)

    lines = check_lines([line(20.0, True), line(10.5, True), line(9.0, False)], Options())
    assert [one["light"] for one in lines] == ["red", "amber", "green"]
    assert all(one["remedy"] for one in lines)


@pytest.mark.slow
@pytest.mark.parametrize(("heights", "around"), [(26, 104), (50, 130)], ids=["130,000", "312,000 thinned"])
def test_view_of_a_large_mesh(tmp_path: Path, heights: int, around: int) -> None:
    seg = lv_ellipsoid().segmentation(spacing=(1.4, 1.4, 8.0))
    options = {"surface": {"vertices": 300}, "volume": {"mesher": "sweep", "edge_length": 6.0}}
    mesh = with_fibres(truncated_ellipsoid("tetra", heights=heights, around=around, layers=8))
    run = replace(fp.mesh_segmentation(seg, **options), mesh=mesh, quality=fp.check(mesh))
    fp.write_run(run, tmp_path / "out")
    assert (tmp_path / "out" / "report.html").stat().st_size < 8_000_000
    with browser.opened(tmp_path / "out" / "report.html") as page:
        page.wait_for_function(f"{VIEW} && {VIEW}.state.shown > 0")
        assert page.locator("#colour option").count() >= 4
        whole = picture(page)
        page.select_option("#cut", "0")
        page.fill("#share", "45")
        assert picture(page) != whole
        thinned = mesh.n_cells > 250_000
        assert page.locator("#share").input_value() == ("50" if thinned else "45")
        assert (f"of {mesh.n_cells} elements" in page.locator("body").inner_text()) == thinned
