"""The page of the paper's table and figures is made, and says what the paper says."""

from __future__ import annotations

import base64
import re
import runpy
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.slow

EXAMPLE = Path(__file__).parent.parent / "examples" / "05_the_paper.py"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory):
    pytest.importorskip("matplotlib", reason="matplotlib is not installed: no page")
    folder = tmp_path_factory.mktemp("paper")
    example = runpy.run_path(str(EXAMPLE))
    figures = example["main"](folder / "paper.html", subjects=1, quick=True, picture=folder / "contours.png")
    return example, figures, folder


def test_rows_are_as_good_as_the_papers(made):
    example, figures, _ = made
    rows = {(row.name, row.method): row for row in figures["rows"]}
    assert set(rows) == {(name, m) for name in ("lv", "rv") for m in ("marching cubes", "paper", "even")}
    for name in ("lv", "rv"):
        cubes, paper, even = (rows[name, method] for method in ("marching cubes", "paper", "even"))
        assert paper.in_slice <= example["FIRST"]["PAPER"][name][0]
        assert cubes.in_slice < 0.06  # half a step of the samples
        assert max(paper.truth, even.truth) < cubes.truth
        assert even.q_min > paper.q_min - 0.05
        assert even.q_mean > paper.q_mean - 0.01
        assert paper.triangles < 0.5 * cubes.triangles


def test_meshes_converge_and_quality_does_not_depend_on_their_size(made):
    _, figures, _ = made
    for curves in figures["curves"].values():
        for found in curves.values():
            assert found[-1] < found[0]
            assert found[-1] < 0.35
    for by_count in figures["quality"].values():
        means = [q.mean() for q in by_count.values()]
        assert min(means) > 0.84
        assert np.ptp(means) < 0.05
    assert all(figures["sound"].values())


def test_the_page_holds_the_table_and_every_figure(made):
    example, figures, folder = made
    page = (folder / "paper.html").read_text()
    for title in ("Table 1", "Figures 3, 4, 5", "Figure 6", "Figure 7, phantom", "Figure 10, phantom"):
        assert f"<h2>{title}</h2>" in page
    pictures = re.findall(r"data:image/png;base64,([^']+)'", page)
    assert len(pictures) == 4
    assert all(base64.b64decode(data).startswith(b"\x89PNG") for data in pictures)
    for row in figures["rows"]:
        assert f"<td>{row.in_slice:.2f} ± {row.deviation:.2f}" in page
    for name in ("lv", "rv"):
        assert "<td>{} ± {}".format(*example["FIRST"]["PAPER"][name]) in page
    assert (folder / "contours.png").stat().st_size > 10_000
    assert (folder / "contours_convergence.png").stat().st_size > 10_000
